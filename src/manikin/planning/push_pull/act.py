"""What is to be pushed or pulled, and what a posture can exert: linear programs of the whole body at rest.

    max F   over the forces of feet and hands and F
    s.t.    g(q) = tau + sum J^T f,   tau_min <= tau <= tau_max,   feet and pressing hands inside their
            friction pyramids,   sum of the forces on the hands = -F d

The points are those of the contacts, each on the segment that carries it, so that a load on the tip of a sole
is paid for by the toes. The pyramids never hold more than the circular cone: with the friction model
``outer`` they are those of ``cone``.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.balance.contact_forces import ContactGenerators
from manikin.body import BodyModel, Configuration
from manikin.body.limbs import carrying_segment
from manikin.body.segments import HANDS
from manikin.contact import Contact, ContactKind, ContactModel, FrictionModel, Stance, point
from manikin.errors import InputError
from manikin.kinematics.efort import Task, unit_direction
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number
from manikin.planning.contacts import Efort


class ActKind(StrEnum):
    """Kind of an act of the hands."""

    PUSH = "push"
    """They press with their palms."""
    PULL = "pull"
    """They hold on and draw."""


@dataclass(frozen=True, eq=False)
class Act:
    """A force that the hands shall exert on an object.

    Attributes:
        kind: Push or pull.
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
        size = finite_number(force, "act force [N]", above=0.0)
        vars(self).update(kind=ActKind(kind), obstacle=obstacle, direction=unit, force=size)

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
        """Task of the legs: the whole force that they need at rest, ``F d + m g``.

        The thesis has the direction of the act alone, for which no level floor scores.
        """
        return Task(self.force * self.direction + np.array([0.0, 0.0, body.mass * GRAVITY]))

    def reaction(self, force: float | None = None) -> FloatArray:
        """(3,) force of the object on both hands [N], for the act's force or another one [N]."""
        return -(self.force if force is None else force) * self.direction

    def load(self, hands: Iterable[Contact]) -> FloatArray:
        """(6,) force and moment about the world origin of the object on the hands, shared evenly."""
        pull, place = self.reaction(), np.mean([hand.position for hand in hands], axis=0)
        return np.concatenate([pull, np.cross(place, pull)])


@dataclass(frozen=True, eq=False)
class BracedForces:
    """Forces of a posture at rest that acts on an object.

    Attributes:
        force: Force on the object along the act's direction [N].
        torque_share: Largest torque of a joint as a share of its limit.
        tightest: Name of the joint with the largest share.
        tau: (nv - 6,) torques [N.m].
        contact_force: (c, 6) force of the scene on each contact and moment about its position [N, N.m].
        residual: Largest error of the six equations of the root [N, N.m].
    """

    force: float
    torque_share: float
    tightest: str
    tau: FloatArray
    contact_force: FloatArray
    residual: float


RESERVE = 0.7
"""Share of their friction that palms and soles use for a wanted force, so as not to slide: what is left of a
cone in its inscribed pyramid of four edges, with which motions are controlled."""

STRONG = 0.9
"""Share of a joint's strength up to which soles keep that reserve, and a posture may act; our choice."""


def largest_force(
    body: BodyModel, q: FloatArray, contacts: Sequence[Contact], act: Act, friction: float = 0.7,
    friction_model: FrictionModel = "outer",
) -> BracedForces | None:  # fmt: skip
    """The largest force that a posture (nq,) can exert the way of an act, or None where it cannot even stand.

    The contacts are those of feet and hands; the friction is the Coulomb coefficient of pressing palms, the
    friction model that of feet and palms.
    """
    programme = _Programme(body, q, contacts, act, friction, friction_model)
    return programme.solve((-1.0, 0.0), (0.0, None), (1.0, 1.0))


def share_force(
    body: BodyModel, q: FloatArray, contacts: Sequence[Contact], act: Act, friction: float = 0.7,
    friction_model: FrictionModel = "outer",
) -> BracedForces | None:  # fmt: skip
    """The act's force with the smallest share of any joint's strength, or None where friction forbids it.

    A share above 1 is more than the joints have. Pressing palms use :data:`RESERVE` of their friction, soles
    as well where that takes no more than :data:`STRONG`. The arguments are those of :func:`largest_force`.
    """
    found = None
    for reserve in (RESERVE, 1.0):
        used = [replace(item, friction=reserve * item.friction) for item in contacts]
        programme = _Programme(body, q, used, act, RESERVE * friction, friction_model)
        found = programme.solve((0.0, 1.0), (act.force, act.force), (0.0, None))
        if found is not None and found.torque_share <= STRONG:
            break
    return found


class _Programme:
    """Variables: magnitudes of the contacts' generators, then ``F``, then the torque share."""

    def __init__(
        self, body: BodyModel, q: FloatArray, contacts: Sequence[Contact], act: Act, friction: float,
        friction_model: FrictionModel,
    ) -> None:  # fmt: skip
        self._body, self._direction, state = body, act.direction, Configuration(body, q)
        model = ContactModel("cone" if friction_model == "outer" else friction_model)
        touching = [_touching(contact, act, friction) for contact in contacts]
        generators = ContactGenerators.of(Stance(touching, model=model), grasp_moments=False)
        # Of a grasp the first of two opposite generators stands for both, with a magnitude of either sign.
        kept = (generators.normal > 0.0) | (generators.force.sum(axis=1) > 0.0)
        self._owner, force = generators.contact[kept], generators.force[kept]
        places = np.array([contact.position for contact in contacts])[generators.contact]
        self._wrenches = generators.about(places)[:, kept]
        maps = []
        rows = np.array_split(np.arange(len(force)), np.flatnonzero(np.diff(self._owner)) + 1)
        for contact, mine in zip(touching, rows, strict=True):
            parts = np.split(mine, len(contact.points))
            for jacobian, part in zip(_jacobians(state, contact), parts, strict=True):
                maps.append(jacobian.T @ force[part].T)
        self._maps = np.hstack(maps)
        held = [contact.max_force if contact.kind is ContactKind.GRASP else np.inf for contact in contacts]
        upper = np.array(held)[self._owner]
        lower = np.where(generators.normal[kept] > 0.0, 0.0, -upper)
        self._limits = list(zip(lower.tolist(), upper.tolist(), strict=True))
        self._bias = np.array(state.nonlinear_effects)
        self._on_hands = np.isin(self._owner, [k for k, c in enumerate(contacts) if c.effector in HANDS])

    def solve(
        self, cost: tuple[float, float], force: tuple[float, float | None], share: tuple[float, float | None]
    ) -> BracedForces | None:
        """Least ``cost`` of force and share within their bounds, or None where there is no solution."""
        body, on_hands = self._body, self._wrenches[:3] * self._on_hands
        equal = np.vstack([
            np.hstack([self._maps[:6], np.zeros((6, 2))]),
            np.hstack([on_hands, self._direction[:, None], np.zeros((3, 1))]),
        ])  # fmt: skip
        joints = np.hstack([self._maps[6:], np.zeros((len(body.torque_upper), 1))])
        most, least = body.torque_upper[:, None], body.torque_lower[:, None]
        below = np.vstack([np.hstack([-joints, -most]), np.hstack([joints, least])])
        result = linprog(
            np.concatenate([np.zeros(self._maps.shape[1]), cost]),
            A_ub=below, b_ub=np.concatenate([-self._bias[6:], self._bias[6:]]),
            A_eq=equal, b_eq=np.concatenate([self._bias[:6], np.zeros(3)]),
            bounds=[*self._limits, force, share],
        )  # fmt: skip
        if result.status in (2, 3):
            return None
        if result.status != 0:
            raise InputError(
                f"forces of the posture cannot be computed ({result.message}); valid: finite values"
            )
        x, multipliers = result.x, result.x[:-2]
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


def _touching(contact: Contact, act: Act, friction: float) -> Contact:
    """A contact as it is in an act: hands rub as palms, and hold on only where they pull."""
    if contact.effector not in HANDS:
        return contact
    if contact.kind is not ContactKind.GRASP:
        return replace(contact, friction=friction)
    if act.kind is not ActKind.PUSH:
        return contact
    rotation = contact.rotation_contact_to_world
    return point(contact.effector, contact.position, friction=friction, rotation=rotation)


def _jacobians(state: Configuration, contact: Contact) -> Iterator[FloatArray]:
    """(3, nv) of each point of a contact, on the segment that carries it."""
    body, effector = state.body, state.body.effector(contact.effector)
    for local in contact.points:
        segment = carrying_segment(body, contact.effector, local)
        offset = effector.translation + effector.rotation @ local
        if segment != effector.segment:
            offset = offset - body.segment(segment).origin
        yield state.point_jacobian(segment, offset)
