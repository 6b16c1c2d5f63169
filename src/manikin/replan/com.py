"""The centre of mass of a recording, planned anew on its stances by either method of [Qiu2012]_ chapter 5."""

from typing import Literal, get_args

import numpy as np

from manikin.centroidal import (
    BentSurface,
    CentroidalProblem,
    CentroidalResult,
    GeometricConstraint,
    KeyframeProblem,
    NearKeyFramesResult,
    Recording,
    height_band,
    plan_com,
    plan_com_near_key_frames,
)
from manikin.contact import Phase, StanceSequence
from manikin.spatial import FloatArray

Method = Literal["keyframes", "timing-free"]
"""``keyframes``: near the recorded positions at the recorded instants (5.3), kept in balance all along;
``timing-free``: only the stances, both ends and the reach are kept (5.4)."""

METHODS: tuple[Method, ...] = get_args(Method)

SHORTEST, LONGEST = 0.5, 2.0
"""Bounds of a phase that is planned timing-free, as shares of its recorded duration: nobody swings a leg in
no time, and phases of a walk are no places to stay."""

HEIGHT_ROOM = 0.1
"""Beyond the recorded heights of the centre of mass, for a plan that is timing-free [m]."""


def plan_recorded_com(
    mass: float, recording: Recording, velocity: FloatArray, method: Method, required_margin: float = 0.0
) -> CentroidalResult:
    """Plan the centre of mass.

    Args:
        mass: [kg].
        recording: Samples, key frames and stances.
        velocity: (2, 3) of the recorded centre of mass at both ends, kept by the timing-free method [m/s].
        method: See :data:`Method`.
        required_margin: To keep all along [N.m].
    """
    if method == "keyframes":
        return plan_near_recorded_com(mass, recording, required_margin)
    return plan_com(
        CentroidalProblem(
            mass, _free_durations(recording), recording.com[0], recording.com[-1],
            start_velocity=velocity[0], goal_velocity=velocity[1], required_margin=required_margin,
            support_distance=farthest_support(recording), geometric=_recorded_heights(recording),
        )
    )  # fmt: skip


def plan_near_recorded_com(
    mass: float, recording: Recording, required_margin: float = 0.0
) -> NearKeyFramesResult:
    """Plan the centre of mass near the recorded one.

    Args:
        mass: [kg].
        recording: Samples, key frames and stances, and the rate of the angular momentum.
        required_margin: To keep all along [N.m].
    """
    asked = KeyframeProblem(
        mass, recording, start_velocity=None, goal_velocity=None, required_margin=required_margin
    )
    return plan_com_near_key_frames(asked)


def farthest_support(recording: Recording) -> float:
    """Largest distance of the recorded centre of mass from a contact ([Qiu2012]_ Table 3.5, 5.26) [m]."""
    phases, farthest = recording.schedule.phase_at(recording.time), 0.0
    for index, phase in enumerate(recording.sequence):
        # The last sample of a phase is the first of the next one.
        rows = np.flatnonzero(phases == index)
        com = recording.com[rows[0] : rows[-1] + 2]
        for contact in phase.stance:
            farthest = max(farthest, float(np.linalg.norm(com - contact.position, axis=1).max()))
    return farthest


def _recorded_heights(recording: Recording) -> tuple[GeometricConstraint, ...]:
    """No lower and no higher than it was recorded, but for some room: feet admit a way through the floor."""
    heights = recording.com[:, 2]
    lower, upper = (
        BentSurface(float(height), 0.0, 0.0, 0.0)
        for height in (heights.min() - HEIGHT_ROOM, heights.max() + HEIGHT_ROOM)
    )
    return height_band(lower, upper)


def _free_durations(recording: Recording) -> StanceSequence:
    return StanceSequence([
        Phase(phase.stance, SHORTEST * duration, LONGEST * duration)
        for phase, duration in zip(recording.sequence, recording.schedule.durations.tolist(), strict=True)
    ])  # fmt: skip
