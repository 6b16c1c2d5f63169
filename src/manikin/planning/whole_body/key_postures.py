"""Postures at the key instants of a centre-of-mass plan, and new plans where one fails ([Qiu2012]_ 7.2.3).

Before the whole body is planned, the posture generator looks for a collision-free posture at
every key instant ``T_0 ... T_n``, on the contacts of both phases that meet there and with the
planned centre of mass.  Where there is none, it looks for the nearest centre of mass with
which there is one: that is where a new plan has to pass.

The thesis goes on with a plan when every key posture is found and otherwise modifies some
constraints by hand.  Here the centre of mass is planned again, and each failed posture gives a constraint: at
its key instant the centre of mass must be beyond the plane through the nearest one with a posture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.configuration import Configuration
from manikin.body.limbs import hanging_segment
from manikin.contact import Contact, ContactSchedule, SolePart
from manikin.kinematics import Placement, PostureProblem, PostureResult, SolverSettings, generate_posture
from manikin.motion.configuration_spline import align_quaternions
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalProblem, CentroidalResult, CentroidalTrajectory, KeyPlane, plan_com
from manikin.planning.whole_body.certificate import WholeBodyRequirements
from manikin.planning.whole_body.fit_targets import ignored_pairs
from manikin.planning.whole_body.foot_roll import FootRoll, foot_roll
from manikin.planning.whole_body.posture_style import READY, Guide, PostureStyle, reference_motion
from manikin.planning.whole_body.sliding_touchdown import Ignored
from manikin.planning.whole_body.swing_planner import leaning_pairs
from manikin.scene import Proximity, Scene

SETTINGS = SolverSettings(tolerance=1e-3, clearance_tolerance=2e-3, settled=2e-2, explain=False)
"""A posture counts when it is as exact as the finished motion has to be, by default."""

NEARNESS = (200.0, 1000.0)
"""Weights of the planned centre of mass where it is only wished, one search after the other [1/m^2]: far
above the other wishes, and below the requirements."""

SETTLING = 10.0
"""Weight of the place [1/m^2] and orientation [1/rad^2] of a contact that has yet to settle there."""

JUST_BEFORE = 1e-6
"""Time before a key instant at which the phase before it still lasts [s]."""


@dataclass(frozen=True, eq=False)
class KeyPosture:
    """The posture at one key instant.

    Attributes:
        key: Index of the key instant.
        time: [s].
        phase: Index of the phase that ends there; of the first one at the start.
        contacts: Effectors that must be in contact.
        com: (3,) planned centre of mass [m].
        q: (nq,) the posture, or the best attempt.
        reason: What it misses and what helps, in one line; None when it is found.
        nearest_com: (3,) nearest centre of mass found with which there is a posture [m]; None when the
            posture is found, or there is none with any centre of mass.
    """

    key: int
    time: float
    phase: int
    contacts: tuple[str, ...]
    com: FloatArray
    q: FloatArray
    reason: str | None = None
    nearest_com: FloatArray | None = None

    @property
    def found(self) -> bool:
        """Whether there is a posture."""
        return self.reason is None

    def __str__(self) -> str:
        place = f"T_{self.key} = {self.time:.2f} s, end of phase {self.phase}"
        if self.key == 0:
            place = "T_0 = 0 s, start of phase 0"
        return f"no posture at {place}, on {', '.join(self.contacts) or 'no contact'}: {self.reason}"


@dataclass(frozen=True, eq=False)
class KeyPostures:
    """Postures at the key instants of a plan, in order of time."""

    postures: tuple[KeyPosture, ...]

    @property
    def failed(self) -> tuple[KeyPosture, ...]:
        """Key postures that were not found."""
        return tuple(posture for posture in self.postures if not posture.found)

    def guide(self) -> Guide:
        """The postures as a guide, to be gone through one after the other."""
        time = np.array([item.time for item in self.postures])
        return Guide(time, align_quaternions(np.array([item.q for item in self.postures])), ())

    def summary(self) -> dict[str, Any]:
        """Return the block ``key_postures`` of the summary."""
        failed = [
            {"key": item.key, "phase": item.phase, "time_s": item.time, "reason": item.reason}
            for item in self.failed
        ]
        return {"count": len(self.postures), "failed": failed}

    def to_dict(self) -> dict[str, Any]:
        """Time, centre of mass and configuration of every posture, with what the failed ones miss."""
        return {
            "time_s": [item.time for item in self.postures],
            "com_m": [item.com.tolist() for item in self.postures],
            "q": [item.q.tolist() for item in self.postures],
            "reason": [item.reason for item in self.postures],
        }


def find_key_postures(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, *, manner: PostureStyle = READY,
    requirements: WholeBodyRequirements | None = None, range_margin: float = 0.0,
    tolerance: float = SETTINGS.tolerance, known: FloatArray | None = None, padded: Sequence[str] = (),
) -> KeyPostures:  # fmt: skip
    """Look for a posture at every key instant until which the trajectory binds.

    Args:
        manner: How the body carries itself where the task leaves freedom.
        requirements: What the finished motion must keep; the clearance is asked of the postures.
        range_margin: Angle that the postures keep from the ends of the hinge ranges [rad].
        tolerance: How exact contacts and centre of mass have to be [m].
        known: (phases + 1, nq) postures from which each search starts and to which it stays near; the
            posture before and the manner's when omitted.
        padded: Obstacles that any part of the body may lean on.
    """
    instants = trajectory.schedule.instants
    time = instants[trajectory.binds(instants)]
    search = _KeyPostureSearch(
        body, scene, trajectory, time, manner, (requirements or WholeBodyRequirements()).clearance,
        range_margin, replace(SETTINGS, tolerance=tolerance), leaning_pairs(body, padded),
        None if known is None else align_quaternions(np.array(known[: len(time)])),
    )  # fmt: skip
    return KeyPostures(search.run())


class _KeyPostureSearch:
    """The search for one plan, each posture starting from the one before."""

    def __init__(
        self, body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, time: FloatArray,
        manner: PostureStyle, clearance: float, range_margin: float, settings: SolverSettings,
        leaning: Ignored, known: FloatArray | None,
    ) -> None:  # fmt: skip
        self._body, self._schedule, self._time = body, trajectory.schedule, time
        self._proximity = Proximity(body, scene)
        self._manner, self._clearance = manner, clearance
        self._range_margin, self._settings = range_margin, settings
        self._com = trajectory.position(time)
        self._rolls = rolls_of(body, trajectory.schedule)
        self._is_known = known is not None
        if known is None:
            known = reference_motion(body, trajectory, time, manner)
            _extend_toes(body, self._rolls, time, known)
        self._reference = known
        self._explained_one = False  # An examination takes seconds; the first is the one that is reported.
        ignored = _ignored(body, scene, trajectory.schedule, time)
        self._ignored = tuple(pairs | leaning for pairs in ignored)

    def run(self) -> tuple[KeyPosture, ...]:
        q, found = self._reference[0], []
        for key in range(len(self._time)):
            q = self._reference[key] if self._is_known else q
            problem = self._problem(key)
            result = generate_posture(problem, q, settings=self._settings)
            found.append(self._posture(key, problem, result))
            q = found[-1].q
        return tuple(found)

    def _problem(self, key: int) -> PostureProblem:
        contacts, placements = requirements_at(self._schedule, key, self._rolls)
        return PostureProblem(
            self._body, contacts, placements, com=self._com[key], proximity=self._proximity,
            clearance=self._clearance, self_clearance=self._clearance, ignore=self._ignored[key],
            reference=self._reference[key], preferences=self._manner.preferences,
            range_margin=self._range_margin,
        )  # fmt: skip

    def _posture(self, key: int, problem: PostureProblem, result: PostureResult) -> KeyPosture:
        contacts = (*(contact.effector for contact in problem.contacts), *problem.placements)
        posture = KeyPosture(key, float(self._time[key]), max(key - 1, 0), contacts, self._com[key], result.q)
        return posture if result.succeeded else self._explained(posture, problem, result)

    def _explained(self, posture: KeyPosture, problem: PostureProblem, result: PostureResult) -> KeyPosture:
        """The posture with the reason why it fails, and the nearest centre of mass with which one exists.

        The nearest posture is also where a search that only ended in a poor minimum finds its way.
        """
        near = self._nearest(problem, result.q)
        if near is None:
            explain = replace(self._settings, explain=not self._explained_one)
            self._explained_one = True
            result = generate_posture(problem, result.q, settings=explain)
            return replace(posture, reason=result.failure or "posture not found")
        again = generate_posture(problem, near.q, settings=self._settings)
        if again.succeeded:
            return replace(posture, q=again.q)
        com = np.array(Configuration(self._body, near.q).com)
        away = float(np.linalg.norm(com - posture.com))
        reason = (
            f"{result.failure}; a posture exists without the centre-of-mass requirement, the nearest with "
            f"it {away:.3f} m from {np.round(posture.com, 3).tolist()}, at {np.round(com, 3).tolist()} m"
        )
        return replace(posture, reason=reason, nearest_com=com)

    def _nearest(self, problem: PostureProblem, start: FloatArray) -> PostureResult | None:
        """The posture with the nearest centre of mass; None when there is none with any."""
        free = generate_posture(replace(problem, com=None), start, settings=self._settings)
        if not free.succeeded:
            return None
        nearest = free
        for weight in NEARNESS:
            wished = replace(problem, com_weight=weight)
            found = generate_posture(wished, nearest.q, settings=replace(self._settings, restarts=False))
            nearest = found if found.succeeded else nearest
        return nearest


Rolls = tuple[tuple[str, FootRoll], ...]
"""Effector and roll of every flight of a foot that does not leave and land flat."""


def rolls_of(body: BodyModel, schedule: ContactSchedule) -> Rolls:
    """Rolls of the feet about their flights."""
    found = ((swing.effector, foot_roll(body, schedule, swing)) for swing in schedule.sequence.swings())
    return tuple((name, roll) for name, roll in found if roll is not None)


def requirements_at(
    schedule: ContactSchedule, key: int, rolls: Rolls = ()
) -> tuple[tuple[Contact, ...], dict[str, Placement]]:
    """Contacts and placements at a key instant: the contacts of both phases that meet there.

    A sole that lies flat in one of them lies flat; one that only touches with an edge has the
    pitch of its roll.  A contact that has yet to settle is only wished at its place.

    Args:
        key: Index of the key instant.
        rolls: Of :func:`rolls_of`.

    Returns:
        The contacts, and placements of the other effectors.
    """
    time = float(schedule.instants[key])
    contacts, placements = [], {}
    for name, contact in _held_at(schedule, key).items():
        if contact.part is not SolePart.FULL and not contact.rolls:
            placements[name] = _tilted(contact, time, [roll for other, roll in rolls if other == name])
        elif schedule.settling(time, name)[0]:
            placements[name] = Placement(
                contact.position, contact.rotation_contact_to_world,
                rotation_weight=SETTLING, position_weight=SETTLING,
            )  # fmt: skip
        else:
            contacts.append(contact)
    return tuple(contacts), placements


def _held_at(schedule: ContactSchedule, key: int) -> dict[str, Contact]:
    """Contacts of both phases at a key instant; of an edge and a full sole, the full one."""
    held: dict[str, Contact] = {}
    for index in (key - 1, key):
        if 0 <= index < len(schedule.sequence):
            for contact in schedule.sequence[index].stance:
                if contact.effector not in held or contact.part is SolePart.FULL:
                    held[contact.effector] = contact
    return held


def _tilted(contact: Contact, time: float, rolls: Sequence[FootRoll]) -> Placement:
    """Placement of a sole that stands on an edge."""
    for roll in rolls:
        up, off, land, flat = roll.instants
        for pivot, start, end in zip(roll.pivots, (up, land), (off, flat), strict=True):
            if start <= time <= end:
                position, rotation = roll.pose(pivot.position[None], pivot.rotation[None], np.array([time]))
                return Placement(position[0], rotation[0])
    return Placement(contact.position, contact.rotation_contact_to_world)


def _extend_toes(body: BodyModel, rolls: Rolls, time: FloatArray, configurations: FloatArray) -> None:
    """Bend the toes of rolling feet so that they lie flat."""
    for name, roll in rolls:
        toes = hanging_segment(body, body.effector(name).segment)
        if toes is not None:
            joint = 7 + body.joint_index(toes.hinges[0].name)
            rows = (time >= roll.instants[0]) & (time < roll.instants[2])
            configurations[rows, joint] = roll.toe_extension(time[rows])


def _ignored(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray
) -> tuple[Ignored, ...]:
    """Pairs that may touch just before or at each key instant."""
    before = ignored_pairs(body, scene, schedule, np.maximum(time - JUST_BEFORE, 0.0))
    after = ignored_pairs(body, scene, schedule, time)
    return tuple(one | other for one, other in zip(before, after, strict=True))


ROOM = 0.01
"""Distance that a new plan is kept inside the place where a posture begins to exist [m]."""

Realise = Callable[[CentroidalTrajectory], CentroidalTrajectory | None]
"""Complete a plan (real supports, a seated part); None ends the search."""

Look = Callable[[CentroidalTrajectory], KeyPostures]
"""Find the key postures of a completed plan."""


@dataclass(frozen=True)
class IneligiblePlan:
    """Reason why no plan has all its key postures.

    Attributes:
        stage: ``"wholebody"``, or ``"centroidal"`` when no plan keeps the tightened constraints.
        posture: The first key posture that fails.
    """

    stage: str
    reason: str
    posture: KeyPosture


@dataclass(frozen=True, eq=False)
class Eligibility:
    """The last plan with its key postures.

    Attributes:
        centroidal: The last plan that was found.
        trajectory: It, completed; None when it could not be.
        postures: Its key postures; None without a trajectory.
        replans: Plans tried after the first one.
        failure: Why the plan cannot be done, or None.
    """

    centroidal: CentroidalResult
    trajectory: CentroidalTrajectory | None
    postures: KeyPostures | None
    replans: int
    failure: IneligiblePlan | None


def find_eligible_plan(
    first: CentroidalResult, realise: Realise, look: Look, *, replan: bool = True
) -> Eligibility:
    """Test a plan at its key instants; plan again, three times at most, with tightened constraints.

    Args:
        first: A plan that succeeded.
        replan: Whether its problem may be solved again; a recorded centre of mass is what it is.
    """
    plan, replans = first, 0
    while True:
        assert plan.trajectory is not None  # only plans that succeeded get here
        trajectory = realise(plan.trajectory)
        if trajectory is None:
            return Eligibility(plan, None, None, replans, None)
        postures = look(trajectory)
        if not postures.failed:
            return Eligibility(plan, trajectory, postures, replans, None)
        worst = _most_hopeless(plan.problem, postures.failed)
        tightened = tighten(plan.problem, postures.failed) if replan else None
        if tightened is None or replans == 3:
            failure = IneligiblePlan("wholebody", f"{worst}; {_tried(replans)}", worst)
            return Eligibility(plan, trajectory, postures, replans, failure)
        again, replans = plan_com(tightened), replans + 1
        if again.failure is not None:
            cause = f"no plan of the centre of mass passes there: {again.failure.reason}"
            failure = IneligiblePlan("centroidal", f"{worst}; {cause}; {_tried(replans)}", worst)
            return Eligibility(plan, trajectory, postures, replans, failure)
        plan = again


def tighten(problem: CentroidalProblem, failed: tuple[KeyPosture, ...]) -> CentroidalProblem | None:
    """The problem with a plane for every failed key posture; None where planning again cannot help.

    It cannot where there is no posture with any centre of mass, nor at the start and the goal,
    where the centre of mass is given.
    """
    planes = []
    for posture in failed:
        if not movable(problem, posture) or posture.nearest_com is None:
            return None
        planes.append(KeyPlane.towards(posture.key, posture.com, posture.nearest_com, ROOM))
    return replace(problem, key_planes=(*problem.key_planes, *planes))


def movable(problem: CentroidalProblem, posture: KeyPosture) -> bool:
    """Whether another plan may move the centre of mass so that the posture is found."""
    return posture.nearest_com is not None and 0 < posture.key < len(problem.sequence)


def _most_hopeless(problem: CentroidalProblem, failed: tuple[KeyPosture, ...]) -> KeyPosture:
    """The first key posture that no plan can help, or else the first."""
    return next((posture for posture in failed if not movable(problem, posture)), failed[0])


def _tried(replans: int) -> str:
    plans = "plan" if replans == 1 else "plans"
    return f"{replans} further {plans} of the centre of mass tried"
