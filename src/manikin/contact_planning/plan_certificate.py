"""Certificate of a contact plan: every posture measured afresh, balance by other means than the search's."""

from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactKind, ContactModel, Stance
from manikin.contact_planning.stage import ContactPlan
from manikin.contact_planning.static_forces import static_room, static_torque_share
from manikin.posture import touching_pairs
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray


@dataclass(frozen=True)
class PlanCertificate:
    """Largest violations of the postures of a plan.

    Attributes:
        postures: Number of postures: at every change, in the middle of flights, at the goal.
        changes: Largest number of contacts made and broken at one change.
        max_contact_error_m: Distance of an effector from a contact that it holds [m].
        max_sole_turn_rad: Angle of a sole from its contact [rad].
        min_clearance_m: Least distance of what does not touch [m].
        closest_pair: Names of the shapes at that distance.
        max_range_violation_rad: Violation of a joint range [rad].
        min_room_m: Least room of the centre of mass on the contacts that stay, see
            :func:`~manikin.contact_planning.static_forces.static_room` [m].
        max_torque_share: Largest share of a torque limit with which the postures can be held at rest.
    """

    postures: int
    changes: int
    max_contact_error_m: float
    max_sole_turn_rad: float
    min_clearance_m: float
    closest_pair: tuple[str, str]
    max_range_violation_rad: float
    min_room_m: float
    max_torque_share: float

    def as_dict(self) -> dict[str, Any]:
        """The values by name."""
        return {**asdict(self), "closest_pair": list(self.closest_pair)}


@dataclass(frozen=True, eq=False)
class _Held:
    """A posture, what it holds and what carries it."""

    q: FloatArray
    held: tuple[Contact, ...]
    carrying: tuple[Contact, ...]


def certify_plan(
    body: BodyModel, scene: Scene, plan: ContactPlan, model: ContactModel | None = None
) -> PlanCertificate:
    """Measure every posture of a plan.

    Args:
        body: The body.
        scene: Its surroundings.
        plan: The plan.
        model: Contact model; with the default cap of the body when omitted.
    """
    model = model or ContactModel.of_body(body.mass)
    postures = _postures(plan)
    proximity = Proximity(body, scene)
    error = turn = beyond = share = 0.0
    room, nearest, pair = np.inf, np.inf, ("", "")
    for item in postures:
        state = Configuration(body, item.q)
        for contact in item.held:
            rotation, place = state.effector_placement(contact.effector)
            error = max(error, float(np.linalg.norm(place - contact.position)))
            if contact.kind is ContactKind.SOLE:
                off = rotation.T @ contact.rotation_contact_to_world
                turn = max(turn, float(np.linalg.norm(pin.log3(off))))
        touched = [(contact.effector, scene.touched_obstacle(contact)) for contact in item.held]
        found = proximity.evaluate(item.q, 0.2, touching_pairs(body, touched))
        if len(found.distance) and found.distance.min() < nearest:
            nearest, pair = float(found.distance.min()), found.pairs[int(np.argmin(found.distance))]
        angles = item.q[7:]
        beyond = max(beyond, float(np.maximum(body.lower - angles, angles - body.upper).max(initial=0.0)))
        stance = Stance(item.carrying, model=model)
        room = min(room, static_room(stance, body.mass, state.com))
        share = max(share, static_torque_share(body, item.q, stance))
    return PlanCertificate(
        len(postures), _changes(plan), error, turn, nearest, pair, beyond, float(room), share
    )


def _postures(plan: ContactPlan) -> list[_Held]:
    """At a change the contacts of both sides are held, and those that are in both carry."""
    first = tuple(plan.stages[0].contacts.values())
    found = [_Held(plan.stages[0].q, first, first)]
    for before, after in pairwise(plan.stages):
        both = tuple(c for name, c in after.contacts.items() if before.contacts.get(name) is c)
        every = tuple({id(c): c for c in (*before.contacts.values(), *after.contacts.values())}.values())
        found.append(_Held(after.q, every, both))
        if after.via is not None:
            own = tuple(after.contacts.values())
            found.append(_Held(after.via, own, own))
    last = tuple(plan.stages[-1].contacts.values())
    return [*found, _Held(plan.goal, last, last)]


def _changes(plan: ContactPlan) -> int:
    most = 0
    for before, after in pairwise(plan.stages):
        changed = {name for name, c in after.contacts.items() if before.contacts.get(name) is not c}
        most = max(most, len(changed | (set(before.contacts) - set(after.contacts))))
    return most
