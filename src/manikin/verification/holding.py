"""Requirements of postures: they hold their contacts, within the joints' ranges, clear of everything else."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind
from manikin.numerics.spatial import FloatArray
from manikin.runtime.requirement import Requirement
from manikin.verification.clearance import BodyShapes, shape_rows, worst
from manikin.verification.solids import REACH, Solid
from manikin.verification.worst import Worst

CONTACT_ERROR = 1e-3
"""Largest distance of an effector from its contact [m]."""

CONTACT_TURN_DEG = 0.5
"""Largest angle between a sole and its contact [deg]."""

SINKING = 5e-3
"""Depth up to which what touches may be inside what it touches [m]."""

FLESH = 0.02
"""The same of flesh on a seat, and of whatever leans on padding [m]."""

GRASPED = 0.06
"""The same of an open hand that stands for one whose fingers close round something [m]."""

ROUNDING = 1e-4
"""Rounding of clearances [m]."""


@dataclass(frozen=True, eq=False)
class HeldPosture:
    """A posture, what it holds and where it is in the plan.

    Attributes:
        q: (nq,) posture.
        held: Contacts that it has to hold.
        where: Its place in the plan.
    """

    q: FloatArray
    held: tuple[Contact, ...]
    where: str


class Kinematics:
    """Forward kinematics of a body."""

    def __init__(self, body: BodyModel) -> None:
        self._body, self._data = body, body.pinocchio.createData()

    def placements(self, q: FloatArray, effectors: Iterable[str]) -> dict[str, pin.SE3]:
        """Effector-to-world transforms in a posture (nq,)."""
        pin.framesForwardKinematics(self._body.pinocchio, self._data, q)
        return {name: self._data.oMf[self._body.effector_frame(name)].copy() for name in effectors}

    def com(self, q: FloatArray) -> FloatArray:
        """(3,) centre of mass in a posture [m]."""
        return np.array(pin.centerOfMass(self._body.pinocchio, self._data, q))


class HoldingRows:
    """Measures the postures of a plan."""

    def __init__(self, body: BodyModel, solids: Sequence[Solid], kinematics: Kinematics) -> None:
        self._body, self._solids, self._kinematics = body, solids, kinematics
        self._error = Worst(
            "max_contact_error_m", "distance of an effector from its contact", "m", "<=", CONTACT_ERROR, 1e-9
        )
        self._turn = Worst(
            "max_contact_turn_deg", "angle of a sole from its contact", "deg", "<=", CONTACT_TURN_DEG, 1e-9
        )
        self._range = Worst(
            "max_range_violation_deg", "joint range violation", "deg", "<=", 0.0, np.rad2deg(1e-6)
        )
        self._clearance = Worst("min_clearance_m", "clearance", "m", ">=", 0.0, ROUNDING)
        self._sinking = Worst(
            "min_touching_clearance_m", "clearance of what touches", "m", ">=", -SINKING, ROUNDING
        )
        self._flesh = Worst(
            "min_flesh_clearance_m", "clearance of flesh that rests", "m", ">=", -FLESH, ROUNDING
        )
        self._grasped = Worst(
            "min_grasp_clearance_m", "clearance of a hand that grasps", "m", ">=", -GRASPED, ROUNDING
        )
        self._self = Worst(
            "min_self_clearance_m", "clearance of the body from itself", "m", ">=", 0.0, ROUNDING
        )

    @property
    def rows(self) -> list[Requirement | None]:
        """The requirements."""
        quantities = (
            self._error, self._turn, self._range, self._clearance, self._sinking, self._flesh, self._grasped,
            self._self,
        )  # fmt: skip
        return [item.row for item in quantities]

    def measure(self, postures: Sequence[HeldPosture], touched: Mapping[int, frozenset[str]]) -> None:
        """Measure postures.

        Args:
            touched: Names of the obstacles on which each contact lies, by its id.
        """
        if not postures:
            return
        for item in postures:
            self._holds(item)
        self._clear(postures, touched)

    def _holds(self, item: HeldPosture) -> None:
        places = self._kinematics.placements(item.q, [contact.effector for contact in item.held])
        for contact in item.held:
            place, where = places[contact.effector], f"{contact.effector}, {item.where}"
            frame = contact.rotation_contact_to_world
            missed, turn = place.translation - contact.position, place.rotation.T @ frame
            if contact.rolls:  # the axis of its edge goes forward with the pitch, which is free
                pitch = float(np.arctan2(-turn[0, 2], turn[0, 0]))
                turn = turn @ pin.utils.rotate("y", pitch)
                missed = missed + (place.rotation - frame) @ contact.pivot
                missed = missed - contact.edge_radius * pitch * frame[:, 0]
            self._error.take(float(np.linalg.norm(missed)), where)
            if contact.kind is ContactKind.SOLE:
                self._turn.take(float(np.rad2deg(np.linalg.norm(pin.log3(turn)))), where)
        angles = item.q[7:]
        beyond = np.maximum(self._body.lower - angles, angles - self._body.upper)
        if len(beyond):
            most = int(np.argmax(beyond))
            where = f"{self._body.joint_names[most]}, {item.where}"
            self._range.take(float(np.rad2deg(max(beyond[most], 0.0))), where)

    def _clear(self, postures: Sequence[HeldPosture], touched: Mapping[int, frozenset[str]]) -> None:
        shapes, every = BodyShapes(self._body), np.array([item.q for item in postures])
        for solid in self._solids:
            clearance = shapes.to_obstacle(every, solid)
            # Of all that may touch the obstacle in any way, the loosest holds.
            ways = (self._clearance, self._sinking, self._flesh, self._grasped)
            way = np.full(clearance.shape, 2 if solid.padded else 0)
            for number, item in enumerate(postures):
                for contact in item.held:
                    if solid.name in touched[id(contact)]:
                        rows = shape_rows(shapes, self._touching(contact))
                        way[number, rows] = np.maximum(way[number, rows], self._way(contact))
            for index, quantity in enumerate(ways):
                value, (posture, shape) = worst(clearance, way == index)
                if value < REACH or (index == 0 and np.any(way == 0)):
                    pair = f"{shapes.names[shape].partition('/')[0]} and {solid.name}"
                    quantity.take(min(value, REACH), f"{pair}, {postures[posture].where}")
        own = shapes.to_itself(every)
        value, (posture, pair) = worst(own, np.full(own.shape, True))
        if own.size:
            names = " and ".join(name.partition("/")[0] for name in self._body.collision_pairs[pair])
            self._self.take(value, f"{names}, {postures[posture].where}")

    def _touching(self, contact: Contact) -> set[str]:
        """Segments with which a contact is made: the effector's own, and those that hang on it."""
        own = self._body.effector(contact.effector).segment
        return {own} | {segment.name for segment in self._body.segments if segment.parent == own}

    def _way(self, contact: Contact) -> int:
        """Way in which a contact's segments touch: firmly (1), with flesh (2), as a hand that grasps (3)."""
        if contact.kind is ContactKind.GRASP:
            return 3
        return 2 if self._body.effector(contact.effector).segment == self._body.segments[0].name else 1
