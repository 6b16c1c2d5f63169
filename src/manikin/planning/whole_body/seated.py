"""Continue a motion on the seat: from the touch of the buttocks to sitting at rest.

Once a body sits it hardly loses its balance, so [Qiu2012]_ 7.2.2 ends the centre-of-mass plan at the touch
and moves hands and feet to their places without it.  Here the centre of mass of that part is planned as well,
to rest in a final sitting posture, but a whole body need only follow it loosely.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from manikin.body import BodyModel
from manikin.body.configuration import Configuration
from manikin.contact import StanceSequence
from manikin.kinematics import PostureProblem, PostureResult, generate_posture
from manikin.planning.com import CentroidalProblem, CentroidalResult, CentroidalTrajectory, Weights, plan_com
from manikin.planning.whole_body.posture_style import READY
from manikin.planning.whole_body.swing_planner import touch_pairs
from manikin.scene import Proximity, Scene

WEIGHTS = Weights(
    margin=0.0, smoothness=1.0, duration=1.0, velocity=(20.0, 20.0, 20.0), acceleration=(0.1, 0.1, 0.1),
    jerk=(1e-2, 1e-2, 1e-2),
)  # fmt: skip
"""Weights of the seated part: smooth, and not longer than it has to be."""

CLEARANCES = (0.02, 0.0105)
"""Distances that the final posture keeps to the scene [m], tried in order; within the body the last one."""

SITTING = replace(READY, angles=MappingProxyType({**READY.angles, "hip_flexion": 1.4, "knee_flexion": 1.3}))
"""Bent hips and knees, from which the final posture is sought."""


@dataclass(frozen=True, eq=False)
class SeatedContinuation:
    """The part of a motion after the body has sat down.

    Attributes:
        trajectory: The whole motion: the given part, then the seated one, which does not bind.
        centroidal: The plan of the seated part; None where the final posture failed.
    """

    trajectory: CentroidalTrajectory | None
    posture: PostureResult
    centroidal: CentroidalResult | None
    failure: str | None


def continue_seated(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, phases: StanceSequence
) -> SeatedContinuation:
    """Plan the phases in which the body sits and join them to the trajectory up to the touch of the seat."""
    contacts, reference = tuple(phases[len(phases) - 1].stance), SITTING.posture(body)
    end = trajectory.duration
    reference[:3] = trajectory.position(end)
    final = PostureProblem(  # its centre of mass is left free
        body, contacts, proximity=Proximity(body, scene), self_clearance=CLEARANCES[-1],
        ignore=frozenset().union(*(touch_pairs(body, scene, contact) for contact in contacts)),
        reference=reference,
    )  # fmt: skip
    roomy, narrow = (replace(final, clearance=clearance) for clearance in CLEARANCES)
    posture = generate_posture(roomy)
    if not posture.succeeded:
        posture = generate_posture(narrow)
    if not posture.succeeded:
        return SeatedContinuation(None, posture, None, f"no final sitting posture: {posture.failure}")
    problem = CentroidalProblem(
        trajectory.mass, phases, trajectory.position(end), Configuration(body, posture.q).com,
        start_velocity=trajectory.velocity(end), start_acceleration=trajectory.acceleration(end),
        goal_acceleration=np.zeros(3), degree=trajectory.spline.degree, weights=WEIGHTS,
        # Longest duration of the seated part, in sums of its shortest phases.
        max_duration=2.0 * sum(phase.min_duration for phase in phases),
    )  # fmt: skip
    result = plan_com(problem)
    if result.trajectory is None:
        reason = "not found" if result.failure is None else result.failure.reason
        return SeatedContinuation(None, posture, result, f"no centre of mass on the seat: {reason}")
    joined = replace(trajectory.followed_by(result.trajectory), binding_until=end)
    return SeatedContinuation(joined, posture, result, None)
