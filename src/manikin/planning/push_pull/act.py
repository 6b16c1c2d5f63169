"""What is to be pushed or pulled, where to and how hard.

Also here. What a posture can exert on an object: linear programs of the whole body at rest.

    max F   over the forces of feet and hands and F
    s.t.    g(q) = tau + sum J^T f,   tau_min <= tau <= tau_max,   feet and pressing hands inside their
            friction pyramids,   sum of the forces on the hands = -F d

This knows nothing of how the posture was found; its points are those of the contacts, each on the
segment that carries it, so that a load on the tip of a sole is paid for by the toes. The pyramids are those
of the friction model that is asked for, and never hold more than the circular cone: with ``outer`` they
are those of ``cone``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.balance.friction import edges_in_world
from manikin.body import BodyModel, Configuration
from manikin.body.limbs import carrying_segment
from manikin.contact import Contact, ContactKind, FrictionModel
from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number
from manikin.planning.contacts import Efort, Task
from manikin.planning.contacts.efort import unit_direction

HANDS = ("left_hand", "right_hand")
"""Effectors that act."""


class ActKind(StrEnum):
    """What the hands do."""

    PUSH = "push"
    """They press with their palms."""
    PULL = "pull"
    """They hold on and draw."""


@dataclass(frozen=True, eq=False)
class Act:
    """A force that the hands shall exert on an object.

    Attributes:
        kind: Push or pull.
        obstacle: Name of the object.
        direction: (3,) unit, level: where the force on the object points.
        force: Its size [N].
    """

    kind: ActKind
    obstacle: str
    direction: FloatArray
    force: float

    def __init__(self, kind: ActKind, obstacle: str, direction: ArrayLike, force: float) -> None:
        unit = unit_direction(direction, "act direction")
        if abs(unit[2]) > 1e-6:
            raise InputError(f"act direction is {np.round(unit, 4).tolist()}; valid: a level one, its z 0")
        object.__setattr__(self, "kind", ActKind(kind))
        object.__setattr__(self, "obstacle", obstacle)
        object.__setattr__(self, "direction", unit)
        object.__setattr__(self, "force", finite_number(force, "act force [N]", above=0.0))

    @property
    def facing(self) -> FloatArray:
        """(3,) where the body looks: at the object."""
        return self.direction if self.kind is ActKind.PUSH else -self.direction

    @property
    def touch(self) -> ContactKind:
        """How the hands touch."""
        return ContactKind.POINT if self.kind is ActKind.PUSH else ContactKind.GRASP

    def hand_task(self, arms: tuple[str, ...]) -> Task:
        """Task of the arms: the object's reaction pushes them against the act ([Tonneau2015]_ 5.2)."""
        return Task(self.direction, set(arms))

    def hand_heuristic(self) -> Efort:
        """EFORT (5.12) of hands that press; pulling EFORT (5.13) of hands that hold on."""
        return Efort(pulling=self.kind is ActKind.PULL)

    def foot_task(self, body: BodyModel) -> Task:
        """Task of the legs: the ground pushes them the way of the act, and carries the body.

        The thesis has the direction of the act alone, for which no level floor scores. Ours is that
        of the whole force that the feet need at rest, ``F d + m g``.
        """
        return Task(self.force * self.direction + np.array([0.0, 0.0, body.mass * GRAVITY]))

    def reaction(self, force: float | None = None) -> FloatArray:
        """(3,) force of the object on both hands [N], for the act's force or another one [N]."""
        return -(self.force if force is None else force) * self.direction

    def load(self, hands: tuple[Contact, ...], force: float | None = None) -> FloatArray:
        """(6,) force and moment about the world origin of the object on the hands, shared evenly."""
        pull = self.reaction(force)
        place = np.mean([hand.position for hand in hands], axis=0)
        return np.concatenate([pull, np.cross(place, pull)])


@dataclass(frozen=True, eq=False)
class BracedForces:
    """Forces of a posture at rest that acts on an object.

    Attributes:
        force: On the object along the act's direction [N].
        torque_share: Largest torque of a joint as a share of its limit.
        tightest: Name of that joint.
        tau: (nv - 6,) torques [N.m].
        contact_force: (c, 6) force of the scene on each contact, in their order, and its moment about the
            contact's position [N, N.m].
        residual: Largest error of the six equations of the root [N, N.m].
    """

    force: float
    torque_share: float
    tightest: str
    tau: FloatArray
    contact_force: FloatArray
    residual: float


PALM_RESERVE = 0.75
"""Share of their friction that pressing palms use for a wanted force, so as not to slide; our choice."""


def largest_force(
    body: BodyModel,
    q: FloatArray,
    contacts: Sequence[Contact],
    act: Act,
    friction: float = 0.7,
    friction_model: FrictionModel = "outer",
) -> BracedForces | None:
    """The largest force that a posture can exert, or None where it cannot even stand.

    Args:
        body: The body.
        q: (nq,) posture.
        contacts: Of feet and hands.
        act: Where to; its force does not count.
        friction: Coulomb coefficient of pressing palms.
        friction_model: Of feet and palms.
    """
    return _Program(body, q, contacts, act, friction, friction_model).largest()


def share_force(
    body: BodyModel,
    q: FloatArray,
    contacts: Sequence[Contact],
    act: Act,
    friction: float = 0.7,
    friction_model: FrictionModel = "outer",
) -> BracedForces | None:
    """The act's force with the smallest share of any joint's strength, or None where friction forbids it.

    A share above 1 is more than the joints have. Pressing palms use :data:`PALM_RESERVE` of their friction.

    Args:
        body: The body.
        q: (nq,) posture.
        contacts: Of feet and hands.
        act: Where to and how hard.
        friction: Coulomb coefficient of pressing palms.
        friction_model: Of feet and palms.
    """
    return _Program(body, q, contacts, act, PALM_RESERVE * friction, friction_model).shared()


class _Program:
    """Variables: multipliers of the contacts' force directions, then ``F``, then the torque share."""

    def __init__(
        self,
        body: BodyModel,
        q: FloatArray,
        contacts: Sequence[Contact],
        act: Act,
        friction: float,
        friction_model: FrictionModel,
    ) -> None:
        self._body, self._act = body, act
        state = Configuration(body, q)
        inside: FrictionModel = "cone" if friction_model == "outer" else friction_model
        parts = [_generators(state, contact, act, friction, inside) for contact in contacts]
        self._wrenches = np.hstack([wrenches for _, wrenches, _ in parts])
        self._maps = np.hstack([maps for maps, _, _ in parts])
        self._limits = [limit for _, _, limits in parts for limit in limits]
        self._owner = np.repeat(np.arange(len(parts)), [part[0].shape[1] for part in parts])
        self._bias = np.array(state.nonlinear_effects)
        self._on_hands = np.isin(self._owner, [k for k, c in enumerate(contacts) if c.effector in HANDS])

    def largest(self) -> BracedForces | None:
        return self._solve(np.array([-1.0, 0.0]), (0.0, None), (1.0, 1.0))

    def shared(self) -> BracedForces | None:
        return self._solve(np.array([0.0, 1.0]), (self._act.force, self._act.force), (0.0, None))

    def _solve(
        self, cost: FloatArray, force: tuple[float, float | None], share: tuple[float, float | None]
    ) -> BracedForces | None:
        count, body = self._maps.shape[1], self._body
        zeros = np.zeros((6, 2))
        on_hands = self._wrenches[:3] * self._on_hands
        equal = np.vstack([
            np.hstack([self._maps[:6], zeros]),
            np.hstack([on_hands, self._act.direction[:, None], np.zeros((3, 1))]),
        ])  # fmt: skip
        joints = np.hstack([self._maps[6:], np.zeros((len(body.torque_upper), 1))])
        most, least = body.torque_upper[:, None], body.torque_lower[:, None]
        below = np.vstack([np.hstack([-joints, -most]), np.hstack([joints, least])])
        found = linprog(
            np.concatenate([np.zeros(count), cost]),
            A_ub=below, b_ub=np.concatenate([-self._bias[6:], self._bias[6:]]),
            A_eq=equal, b_eq=np.concatenate([self._bias[:6], np.zeros(3)]),
            bounds=[*self._limits, force, share],
        )  # fmt: skip
        if found.status in (2, 3):
            return None
        if found.status != 0:
            raise InputError(
                f"forces of the posture cannot be computed ({found.message}); valid: finite values"
            )
        return self._forces(np.array(found.x))

    def _forces(self, x: FloatArray) -> BracedForces:
        multipliers = x[:-2]
        needed = self._bias - self._maps @ multipliers
        shares = self._body.torque_share(needed[6:])
        worst = int(np.argmax(shares))
        forces = [
            self._wrenches[:, self._owner == k] @ multipliers[self._owner == k]
            for k in range(self._owner.max() + 1)
        ]
        return BracedForces(
            float(x[-2]), float(shares[worst]), self._body.joint_names[worst], needed[6:],
            np.array(forces), float(np.abs(needed[:6]).max()),
        )  # fmt: skip


def _generators(
    state: Configuration, contact: Contact, act: Act, friction: float, model: FrictionModel
) -> tuple[FloatArray, FloatArray, list[tuple[float | None, float | None]]]:
    """Generalised forces (nv, g), wrenches about the contact (6, g) and bounds of what a contact can do."""
    body = state.body
    hand = contact.effector in HANDS
    free = contact.kind is ContactKind.GRASP and not (hand and act.kind is ActKind.PUSH)
    rubbing = replace(contact, friction=friction) if hand else contact
    edges = edges_in_world(rubbing, model)
    directions = np.eye(3) if free else edges.T
    limit = contact.max_force if contact.kind is ContactKind.GRASP else None
    maps, wrenches = [], []
    for local in np.atleast_2d(contact.points):
        segment = carrying_segment(body, contact.effector, local)
        effector = body.effector(contact.effector)
        offset = effector.translation + effector.rotation @ local
        if segment != effector.segment:
            offset = offset - body.segment(segment).origin
        maps.append(state.point_jacobian(segment, offset).T @ directions)
        arm = contact.rotation_contact_to_world @ local
        wrenches.append(np.vstack([directions, np.cross(arm, directions.T).T]))
    count = directions.shape[1] * len(maps)
    low = None if limit is None else -limit
    bounds = [(low, limit) if free else (0.0, limit)] * count
    return np.hstack(maps), np.hstack(wrenches), bounds
