"""Requirements of postures: they hold their contacts, within the joints' ranges, clear of everything else.

For plans without postures there are a bound of the reach from lengths, and a search for a posture.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind
from manikin.numerics.spatial import FloatArray, turned_root
from manikin.runtime.requirement import Requirement, Worst
from manikin.verification.clearance import BodySolids, worst
from manikin.verification.solids import REACH, Solid

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
        on_toes: Feet of which the toes alone lie on their contact.
    """

    q: FloatArray
    held: tuple[Contact, ...]
    where: str
    on_toes: frozenset[str] = frozenset()


class HoldingRows:
    """Measures the postures of a plan."""

    def __init__(self, body: BodyModel, solids: Sequence[Solid]) -> None:
        self._body, self._solids, self._data = body, solids, body.pinocchio.createData()
        what = "distance of an effector from its contact"
        self._error = Worst("max_contact_error_m", what, CONTACT_ERROR, 1e-9)
        self._turn = Worst("max_contact_turn_deg", "angle of a sole from its contact", CONTACT_TURN_DEG, 1e-9)
        self._range = Worst("max_range_violation_deg", "joint range violation", 0.0, np.rad2deg(1e-6))
        self._clearance = Worst("min_clearance_m", "clearance", 0.0, ROUNDING)
        self._sinking = Worst("min_touching_clearance_m", "clearance of what touches", -SINKING, ROUNDING)
        self._flesh = Worst("min_flesh_clearance_m", "clearance of flesh that rests", -FLESH, ROUNDING)
        self._grasped = Worst("min_grasp_clearance_m", "clearance of a hand that grasps", -GRASPED, ROUNDING)
        self._self = Worst("min_self_clearance_m", "clearance of the body from itself", 0.0, ROUNDING)

    @property
    def rows(self) -> list[Requirement | None]:
        """The requirements in the order of their attributes."""
        return [item.row for item in vars(self).values() if isinstance(item, Worst)]

    def com(self, q: FloatArray) -> FloatArray:
        """(3,) centre of mass in a posture [m]."""
        return np.array(pin.centerOfMass(self._body.pinocchio, self._data, q))

    def measure(self, postures: Sequence[HeldPosture], touched: Mapping[int, frozenset[str]]) -> None:
        """Measure postures; ``touched`` names the obstacles on which each contact lies, by its id."""
        for item in postures:
            self._holds(item)
        if postures:
            self._clear(postures, touched)

    def _holds(self, item: HeldPosture) -> None:
        pin.framesForwardKinematics(self._body.pinocchio, self._data, item.q)
        for contact in item.held:
            place = self._data.oMf[self._body.effector_frame(contact.effector)]
            where = f"{contact.effector}, {item.where}"
            if contact.effector in item.on_toes:
                self._error.take(self._toes_away(contact), f"toes of {where}")
                continue
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

    def _toes_away(self, contact: Contact) -> float:
        """Largest distance of a corner of the toes from where it is when the foot lies flat [m]."""
        effector, away = self._body.effector(contact.effector), 0.0
        toes = next(segment for segment in self._body.segments if segment.parent == effector.segment)
        hinge = effector.rotation.T @ (toes.origin - effector.translation)
        place = self._data.oMf[self._body.segment_frame(toes.name)]
        for x, y in product((hinge[0], 0.5 * contact.length), (-0.5 * contact.width, 0.5 * contact.width)):
            corner = np.array([x, y, 0.0])
            wanted = contact.position + contact.rotation_contact_to_world @ corner
            inside = effector.translation + effector.rotation @ corner - toes.origin
            away = max(away, float(np.linalg.norm(place.act(inside) - wanted)))
        return away

    def _clear(self, postures: Sequence[HeldPosture], touched: Mapping[int, frozenset[str]]) -> None:
        shapes, every = BodySolids(self._body), np.array([item.q for item in postures])
        for solid in self._solids:
            clearance = shapes.to_obstacle(every, solid)
            # Of all that may touch the obstacle in any way, the loosest holds.
            ways = (self._clearance, self._sinking, self._flesh, self._grasped)
            way = np.full(clearance.shape, 2 if solid.padded else 0)
            for number, item in enumerate(postures):
                for contact in item.held:
                    if solid.name in touched[id(contact)]:
                        rows = np.isin(shapes.segments, self._touching(contact))
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

    def _touching(self, contact: Contact) -> list[str]:
        """Segments with which a contact is made: the effector's own, and those that hang on it."""
        own = self._body.effector(contact.effector).segment
        return [segment.name for segment in self._body.segments if own in (segment.name, segment.parent)]

    def _way(self, contact: Contact) -> int:
        """Way in which a contact's segments touch: firmly (1), with flesh (2), as a hand that grasps (3)."""
        if contact.kind is ContactKind.GRASP:
            return 3
        return 2 if self._body.effector(contact.effector).segment == self._body.segments[0].name else 1


class ReachBounds:
    """Upper bounds of distances between parts of a body: the length of the way along its segments."""

    def __init__(self, body: BodyModel) -> None:
        self._body = body

    def between(self, first: str, second: str) -> float:
        """Largest distance between the origins of two effectors [m]."""
        a, b = self._body.effector(first), self._body.effector(second)
        return self._way(a.segment, a.translation, b.segment, b.translation)

    def to_com(self, effector: str) -> float:
        """Largest distance of an effector from the body's centre of mass [m]."""
        end, parts = self._body.effector(effector), self._body.segments
        ways = [part.mass * self._way(end.segment, end.translation, part.name, part.com) for part in parts]
        return sum(ways) / sum(part.mass for part in parts)

    def _way(self, first: str, at: FloatArray, second: str, other: FloatArray) -> float:
        """Length of the way from a point of one segment over the joints to a point of another [m]."""
        up, down = self._ancestors(first), self._ancestors(second)
        common = next(name for name in up if name in down)
        here, to_here = self._climbed(first, at, common)
        there, to_there = self._climbed(second, other, common)
        return to_here + to_there + float(np.linalg.norm(here - there))

    def _climbed(self, segment: str, point: FloatArray, until: str) -> tuple[FloatArray, float]:
        """Where the way from a point enters an ancestor, in its frame, and its length up to there [m]."""
        length, here = 0.0, np.array(point)
        while segment != until:
            length += float(np.linalg.norm(here))
            part = self._body.segment(segment)
            here, segment = np.array(part.origin), str(part.parent)
        return here, length

    def _ancestors(self, segment: str) -> list[str]:
        result = [segment]
        while (parent := self._body.segment(result[-1]).parent) is not None:
            result.append(parent)
        return result


REACHED = 5e-3
"""Distance from its contact at which an effector of a searched posture has reached it [m]."""

_TRIES, _STEPS = 4, 120
_LIKE_STANDING, _SOLE_END = 0.01, 0.15
_WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class PostureSearch:
    """Looks for a posture on contacts where a plan gives none: damped Gauss-Newton within the joints' ranges.

    Collisions are not avoided. A local search from a few starts may miss a posture: a plan has to give it.
    """

    def __init__(self, body: BodyModel) -> None:
        self._body, self._data = body, body.pinocchio.createData()
        self._standing = body.standing_posture()

    def gap(self, contacts: Sequence[Contact], com: FloatArray | None) -> float:
        """Least distance by which a posture misses one of its contacts or the centre of mass [m].

        Args:
            com: (3,) centre of mass, whose level place is to be kept; free when None.
        """
        rng, best = np.random.default_rng(0), np.inf
        for number in range(_TRIES):
            q = self._start(contacts, 0.12 * number)
            q[7:] += 0.2 * rng.normal(size=len(q) - 7) if number else 0.0
            for _ in range(_STEPS):
                q[7:] = np.clip(q[7:], self._body.lower, self._body.upper)
                missed, rows = self._linear(q, contacts, com)
                best = min(best, max((float(np.linalg.norm(part)) for part in missed), default=0.0))
                if best <= REACHED:
                    return best
                q = self._moved(q, np.concatenate(missed), np.concatenate(rows))
        return best

    def _start(self, contacts: Sequence[Contact], lowered: float) -> FloatArray:
        """(nq,) standing posture over the contacts, facing as the feet do."""
        feet = [contact for contact in contacts if "foot" in contact.effector] or list(contacts)
        heading = float(np.angle(np.sum([np.exp(1j * contact.yaw) for contact in feet])))
        start = turned_root(self._standing, heading)
        start[:2] = np.mean([contact.position[:2] for contact in feet], axis=0)
        start[2] += float(np.mean([contact.position[2] for contact in feet])) - lowered * start[2]
        return start

    def _linear(
        self, q: FloatArray, contacts: Sequence[Contact], com: FloatArray | None
    ) -> tuple[list[FloatArray], list[FloatArray]]:
        """What is missed [m], the turn of a sole as the way of its end, and how a motion (nv,) changes it."""
        model, data = self._body.pinocchio, self._data
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        missed, rows = [], []
        for contact in contacts:
            frame = self._body.effector_frame(contact.effector)
            place, jacobian = data.oMf[frame], pin.getFrameJacobian(model, data, frame, _WORLD_AXES)
            away, moves = contact.position - place.translation, jacobian[:3]
            turn, turns = pin.log3(contact.rotation_contact_to_world @ place.rotation.T), jacobian[3:]
            if contact.rolls:
                forward, across = contact.rotation_contact_to_world[:, :2].T
                arm, pitch = place.rotation @ contact.pivot, -float(across @ turn)
                rolled = contact.rotation_contact_to_world @ contact.pivot
                away = away + rolled + contact.edge_radius * pitch * forward - arm
                rolls = contact.edge_radius * np.outer(forward, across @ turns)
                moves = moves - pin.skew(arm) @ turns - rolls
                level = np.eye(3) - np.outer(across, across)
                turn, turns = level @ turn, level @ turns
            missed.append(away)
            rows.append(moves)
            if contact.kind is ContactKind.SOLE:
                missed.append(_SOLE_END * turn)
                rows.append(_SOLE_END * turns)
        if com is not None:
            rows.append(pin.jacobianCenterOfMass(model, data, q, False)[:2])
            missed.append((com - data.com[0])[:2])
        return missed, rows

    def _moved(self, q: FloatArray, missed: FloatArray, rows: FloatArray) -> FloatArray:
        """(nq,) posture after one step; joints that would leave their ranges stay."""
        pull = np.zeros(self._body.nv)
        pull[6:] = _LIKE_STANDING * (self._standing[7:] - q[7:])
        free = np.ones(self._body.nv, dtype=bool)
        for _ in range(3):
            active = rows * free
            matrix = active.T @ active + np.diag(np.where(free, _LIKE_STANDING**2, 1.0))
            step = np.linalg.solve(matrix, active.T @ missed + _LIKE_STANDING * pull * free)
            ahead = q[7:] + step[6:]
            leaving = (ahead < self._body.lower - 1e-9) | (ahead > self._body.upper + 1e-9)
            at_end = (q[7:] <= self._body.lower) | (q[7:] >= self._body.upper)
            if not np.any(leaving & at_end & free[6:]):
                break
            free[6:] &= ~(leaving & at_end)
        size = float(np.abs(step).max())
        return pin.integrate(self._body.pinocchio, q, step * min(1.0, 0.4 / max(size, 1e-9)))
