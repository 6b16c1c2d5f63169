"""Plan the centre of mass again where a key posture fails ([Qiu2012]_ 7.2.3).

The thesis goes on with a plan when every key posture is found and otherwise modifies some
constraints by hand.  Here each failed posture gives the constraint: at its key instant the
centre of mass must be beyond the plane through the nearest centre of mass with a posture.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from manikin.centroidal import CentroidalProblem, CentroidalResult, CentroidalTrajectory, KeyPlane, plan_com
from manikin.wholebody.key_postures import KeyPosture, KeyPostures

MOST_REPLANS = 3
"""Plans tried after the first one."""

ROOM = 0.01
"""Distance that a new plan is kept inside the place where a posture begins to exist [m]."""

Realise = Callable[[CentroidalTrajectory], CentroidalTrajectory | None]
"""Complete a plan (real supports, a seated part); None ends the search."""

Look = Callable[[CentroidalTrajectory], KeyPostures]
"""Find the key postures of a completed plan."""


@dataclass(frozen=True)
class IneligiblePlan:
    """Why no plan has all its key postures.

    Attributes:
        stage: ``"wholebody"``, or ``"centroidal"`` when no plan keeps the tightened constraints.
        reason: In one line.
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
    """Test a plan at its key instants; plan again with tightened constraints while that may help.

    Args:
        first: A plan that succeeded.
        realise: Completes a plan.
        look: Finds key postures.
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
        if tightened is None or replans == MOST_REPLANS:
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

    Args:
        problem: What was planned.
        failed: Key postures that were not found.
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
