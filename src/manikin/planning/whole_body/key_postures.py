"""Postures at the key instants of a centre-of-mass plan, and new plans where one fails ([Qiu2012]_ 7.2.3).

Before the whole body is planned, the posture generator looks for a collision-free posture at every key
instant ``T_0 ... T_n``, on the contacts of both phases that meet there and with the planned centre of mass.
The thesis modifies some constraints by hand where there is none.  Here the centre of mass is planned again,
and each failed posture gives a constraint: at its key instant the centre of mass must be beyond the plane
through the nearest one with which there is a posture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.configuration import Configuration
from manikin.contact import Contact, ContactSchedule, SolePart
from manikin.kinematics import Placement, PostureProblem, PostureResult, SolverSettings, generate_posture
from manikin.motion.configuration_spline import align_quaternions
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalResult, CentroidalTrajectory, KeyPlane, plan_com
from manikin.planning.whole_body.certificate import WholeBodyRequirements
from manikin.planning.whole_body.fit_targets import ignored_pairs, lay_toes_flat, toe_angles
from manikin.planning.whole_body.foot_roll import FootRoll, Rolls, foot_roll
from manikin.planning.whole_body.posture_style import FAR, READY, Guide, PostureStyle, reference_motion
from manikin.planning.whole_body.swing_planner import leaning_pairs
from manikin.scene import Proximity, Scene

SETTINGS = SolverSettings(tolerance=1e-3, clearance_tolerance=2e-3, settled=2e-2, explain=False)
"""A posture counts when it is as exact as the finished motion has to be, by default."""


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
        easier_com: (3,) a centre of mass close by with which a posture is much nearer to the preferred one
            [m]; None where the posture found is near, or no other one is much nearer.
    """

    key: int
    time: float
    phase: int
    contacts: tuple[str, ...]
    com: FloatArray
    q: FloatArray
    reason: str | None = None
    nearest_com: FloatArray | None = None
    easier_com: FloatArray | None = None

    @property
    def found(self) -> bool:
        """Whether there is a posture."""
        return self.reason is None

    def __str__(self) -> str:
        end = f"T_{self.key} = {self.time:.2f} s, end of phase {self.phase}"
        place = end if self.key else "T_0 = 0 s, start of phase 0"
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
    ease: bool = True, similar: KeyPostures | None = None,
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
        ease: Whether postures far from the preferred ones ask for an easier centre of mass.
        similar: Those of a plan near to this one on the same contacts, from which each search starts.
    """
    schedule = trajectory.schedule
    time = schedule.instants[trajectory.binds(schedule.instants)]
    feet = ((swing.effector, foot_roll(body, schedule, swing)) for swing in schedule.sequence.swings())
    com, rolls = trajectory.position(time), [(name, roll) for name, roll in feet if roll is not None]
    if known is None:
        references = reference_motion(body, trajectory, time, manner)
        lay_toes_flat(toe_angles(body, rolls, time), references)
    else:
        references = align_quaternions(np.array(known[: len(time)]))
    leaning, proximity = leaning_pairs(body, padded), Proximity(body, scene)
    clearance = (requirements or WholeBodyRequirements()).clearance
    settings = replace(SETTINGS, tolerance=tolerance)
    # Pairs that may touch at each key instant, or just before it, when the phase before still lasts [s].
    before, at = (ignored_pairs(body, scene, schedule, when) for when in (np.maximum(time - 1e-6, 0.0), time))
    q, found = references[0], list[KeyPosture]()
    for key, reference in enumerate(references):
        contacts, placements = requirements_at(schedule, key, rolls)
        problem = PostureProblem(
            body, contacts, placements, com=com[key], proximity=proximity, clearance=clearance,
            self_clearance=clearance, ignore=before[key] | at[key] | leaning, reference=reference,
            preferences=manner.preferences, range_margin=range_margin,
        )  # fmt: skip
        result, near = None, None if similar is None else similar.postures[key]
        if near is not None and near.found:
            result = generate_posture(problem, near.q, settings=replace(settings, restarts=False))
        if result is None or not result.succeeded:
            result = generate_posture(problem, q if known is None else reference, settings=settings)
        names = (*(contact.effector for contact in contacts), *placements)
        posture = KeyPosture(key, float(time[key]), max(key - 1, 0), names, com[key], result.q)
        if not result.succeeded:
            # An examination takes seconds; the first is the one that is reported.
            first = all(item.found or item.nearest_com is not None for item in found)
            posture = _explained(posture, problem, result, settings, first)
        elif ease:
            posture = _eased(posture, problem, manner, settings)
        found.append(posture)
        q = posture.q
    return KeyPostures(tuple(found))


def _explained(
    posture: KeyPosture, problem: PostureProblem, result: PostureResult, settings: SolverSettings, first: bool
) -> KeyPosture:
    """The posture with the reason why it fails, and the nearest centre of mass with which one exists.

    The nearest posture is also where a search that only ended in a poor minimum finds its way.
    """
    free = generate_posture(replace(problem, com=None), result.q, settings=settings)
    if not free.succeeded:
        result = generate_posture(problem, result.q, settings=replace(settings, explain=first))
        return replace(posture, reason=result.failure or "posture not found")
    near = free.q
    # Weights of the planned centre of mass where it is only wished [1/m^2]: far above the other wishes, and
    # below the requirements.
    for weight in (200.0, 1000.0):
        wished = replace(problem, com_weight=weight)
        closer = generate_posture(wished, near, settings=replace(settings, restarts=False))
        near = closer.q if closer.succeeded else near
    # The other starts have failed before.
    again = generate_posture(problem, near, settings=replace(settings, restarts=False))
    if again.succeeded:
        return replace(posture, q=again.q)
    com = np.array(Configuration(problem.body, near).com)
    away = float(np.linalg.norm(com - posture.com))
    reason = (
        f"{result.failure}; a posture exists without the centre-of-mass requirement, the nearest with "
        f"it {away:.3f} m from {np.round(posture.com, 3).tolist()}, at {np.round(com, 3).tolist()} m"
    )
    return replace(posture, reason=reason, nearest_com=com)


BEYOND = (0.01, 0.002)
"""How far a new plan is kept inside the place where a posture begins to exist, the second where no plan keeps
the first [m]."""

EASIER_WEIGHT, EASIER, LITTLE_LONGER = 200.0, 0.7, 1.1
"""Weight of the planned centre of mass where an easier posture is sought [1/m^2]; share of the distance from
the preferred posture that it comes down to; most duration of a plan with it, over that of the one before."""


def _eased(
    posture: KeyPosture, problem: PostureProblem, manner: PostureStyle, settings: SolverSettings
) -> KeyPosture:
    """The posture with a centre of mass that makes it more natural, if it is far from the preferred one.

    At the end of their reach legs leave the rest to trunk and arms, which are thrown up.
    """
    body, preferred = problem.body, problem.reference
    if preferred is None or (strain := manner.strain(body, preferred, posture.q)) < FAR:
        return posture
    wished = generate_posture(replace(problem, com_weight=EASIER_WEIGHT), posture.q, settings=settings)
    com = np.array(Configuration(body, wished.q).com)
    easier = wished.succeeded and manner.strain(body, preferred, wished.q) < EASIER * strain
    return replace(posture, easier_com=com) if easier else posture


def requirements_at(
    schedule: ContactSchedule, key: int, rolls: Rolls = ()
) -> tuple[tuple[Contact, ...], dict[str, Placement]]:
    """Contacts of both phases that meet at a key instant, and placements of the other effectors.

    A sole that lies flat in one of them lies flat; one that only touches with an edge has the pitch of its
    roll.  A contact that has yet to settle is only wished at its place.
    """
    time, held = float(schedule.instants[key]), dict[str, Contact]()
    for phase in schedule.sequence.phases[max(key - 1, 0) : key + 1]:
        for contact in phase.stance:
            if contact.effector not in held or contact.part is SolePart.FULL:
                held[contact.effector] = contact
    contacts, placements = [], {}
    for name, contact in held.items():
        if contact.part is not SolePart.FULL and not contact.rolls:
            placements[name] = _tilted(contact, time, [roll for other, roll in rolls if other == name])
        elif schedule.settling(time, name)[0]:
            # Weights of its orientation [1/rad^2] and place [1/m^2].
            placements[name] = Placement(contact.position, contact.rotation_contact_to_world, 10.0, 10.0)
        else:
            contacts.append(contact)
    return tuple(contacts), placements


def _tilted(contact: Contact, time: float, rolls: Sequence[FootRoll]) -> Placement:
    """Placement of a sole that stands on an edge."""
    for roll in rolls:
        up, off, land, flat = roll.instants
        for pivot, start, end in zip(roll.pivots, (up, land), (off, flat), strict=True):
            if start <= time <= end:
                position, rotation = roll.pose(pivot.position[None], pivot.rotation[None], np.array([time]))
                return Placement(position[0], rotation[0])
    return Placement(contact.position, contact.rotation_contact_to_world)


@dataclass(frozen=True)
class IneligiblePlan:
    """Reason why no plan has all its key postures, and the first one that fails.

    Attributes:
        stage: ``"wholebody"``, or ``"centroidal"`` when no plan keeps the tightened constraints.
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
        replans: Plans tried after the first one because a posture failed.
        failure: Why the plan cannot be done, or None.
    """

    centroidal: CentroidalResult
    trajectory: CentroidalTrajectory | None
    postures: KeyPostures | None
    replans: int
    failure: IneligiblePlan | None


Look = Callable[[CentroidalTrajectory, KeyPostures | None], KeyPostures]


def _with_easier(
    found: Eligibility, realise: Callable[[CentroidalTrajectory], CentroidalTrajectory | None],
    look: Look, guesses: int | None,
) -> Eligibility:  # fmt: skip
    """A plan with easier key postures, where there is one that is hardly slower; else the one found."""
    plan, postures = found.centroidal, found.postures
    assert plan.trajectory is not None
    assert postures is not None
    last = len(plan.problem.sequence)
    planes = tuple(
        KeyPlane.towards(item.key, item.com, item.easier_com)
        for item in postures.postures if item.easier_com is not None and 0 < item.key < last
    )  # fmt: skip
    if not planes:
        return found
    problem = replace(plan.problem, key_planes=(*plan.problem.key_planes, *planes))
    again = plan_com(problem, guesses=guesses, near=plan)
    if again.trajectory is None or again.trajectory.duration > LITTLE_LONGER * plan.trajectory.duration:
        return found
    trajectory = realise(again.trajectory)
    easier = None if trajectory is None else look(trajectory, postures)
    if easier is None or easier.failed:
        return found
    return Eligibility(again, trajectory, easier, found.replans, None)


def find_eligible_plan(
    first: CentroidalResult, realise: Callable[[CentroidalTrajectory], CentroidalTrajectory | None],
    look: Look, *, replan: bool = True, guesses: int | None = None,
) -> Eligibility:  # fmt: skip
    """Test a plan at its key instants; plan again, three times at most, with tightened constraints.

    Args:
        first: A plan that succeeded.
        realise: Complete a plan (real supports, a seated part); None ends the search.
        look: Find the key postures of a completed plan, given those of the plan before it.
        replan: Whether its problem may be solved again; a recorded centre of mass is what it is.
        guesses: Guesses that another plan is sought from at most, after the plan before it; all where None.
    """
    plan, replans, postures = first, 0, None
    while True:
        assert plan.trajectory is not None  # only plans that succeeded get here
        trajectory = realise(plan.trajectory)
        if trajectory is None:
            return Eligibility(plan, None, None, replans, None)
        postures = look(trajectory, postures)
        if not postures.failed:
            found = Eligibility(plan, trajectory, postures, replans, None)
            return _with_easier(found, realise, look, guesses) if replan else found
        # None helps where there is no posture with any centre of mass, nor at both ends, where it is given.
        hopeless = [
            item for item in postures.failed
            if item.nearest_com is None or not 0 < item.key < len(plan.problem.sequence)
        ]  # fmt: skip
        worst = (hopeless or postures.failed)[0]
        stage, cause = "wholebody", ""
        if replan and replans < 3 and not hopeless:
            replans += 1
            for beyond in BEYOND:
                planes = tuple(
                    KeyPlane.towards(item.key, item.com, item.nearest_com, beyond)
                    for item in postures.failed if item.nearest_com is not None
                )  # fmt: skip
                tightened = replace(plan.problem, key_planes=(*plan.problem.key_planes, *planes))
                again = plan_com(tightened, guesses=guesses, near=plan)
                if again.failure is None:
                    break
            if again.failure is None:
                plan = again
                continue
            stage = "centroidal"
            cause = f"no plan of the centre of mass passes there: {again.failure.reason}; "
        plans = "plan" if replans == 1 else "plans"
        reason = f"{worst}; {cause}{replans} further {plans} of the centre of mass tried"
        failure = IneligiblePlan(stage, reason, worst)
        return Eligibility(plan, trajectory, postures, replans, failure)
