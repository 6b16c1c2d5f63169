"""What the keyframe-based method is asked: a recording and what the motion has to keep ([Qiu2012]_ 5.3.1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.centroidal.constraints import GeometricConstraint
from manikin.centroidal.problem import CentroidalProblem, MarginSpace, Weights
from manikin.centroidal.recording import Recording
from manikin.errors import InputError
from manikin.spatial import finite_number

EXTRA_CONTROL_POINTS = 7
"""Control points by default beyond the number of key frames: 16 for the 9 of [Qiu2012]_ 5.3.3."""

FRAME_SPACING = 0.05
"""Least distance of an added key frame from the others [s]; closer ones would follow the noise."""


@dataclass(frozen=True, eq=False)
class KeyframeProblem:
    """A CoM to find through the key frames of a recording ([Qiu2012]_ 5.3.1).

    Attributes:
        recording: Samples, key frames and stances.
        requirements: What the motion has to keep, with the timing and the ends of the recording.
        control_points: Of the spline, before key frames are added; each added one brings one more.
        frame_spacing: Least distance of an added key frame from the others [s].
    """

    recording: Recording
    requirements: CentroidalProblem
    control_points: int
    frame_spacing: float

    def __init__(
        self,
        mass: float,
        recording: Recording,
        *,
        degree: int = 5,
        control_points: int | None = None,
        start_velocity: ArrayLike | None = (0.0, 0.0, 0.0),
        goal_velocity: ArrayLike | None = (0.0, 0.0, 0.0),
        start_acceleration: ArrayLike | None = None,
        goal_acceleration: ArrayLike | None = None,
        required_margin: float = 0.0,
        margin_space: MarginSpace = "wrench",
        support_distance: float | None = None,
        geometric: Sequence[GeometricConstraint] = (),
        weights: Weights | None = None,
        frame_spacing: float = FRAME_SPACING,
    ) -> None:
        """Put the problem together.

        Args:
            mass: [kg].
            recording: Samples, key frames and stances.
            degree: Of the spline, >= 3.
            control_points: At least one more than there are key frames and end conditions; the
                number of key frames plus 7 when omitted.
            start_velocity: (3,) [m/s] (5.15), or None when free.
            goal_velocity: (3,) [m/s] (5.16), or None when free.
            start_acceleration: (3,) [m/s^2], or None when free; needs a velocity too.
            goal_acceleration: (3,) [m/s^2], or None when free; needs a velocity too.
            required_margin: The whole motion has to keep it [N.m] or [N].
            margin_space: What the margin measures.
            support_distance: Largest distance of the CoM from every active contact [m].
            geometric: Further constraints on the CoM position.
            weights: Qv and Qj of the objective, and a Qa that the thesis does not have; those of
                margin and duration play no part.
            frame_spacing: Least distance of an added key frame from the others [s].

        Raises:
            InputError: If a value is not usable or there are too few control points.
        """
        requirements = CentroidalProblem(
            mass, recording.sequence, recording.com[0], recording.com[-1],
            start_velocity=start_velocity, goal_velocity=goal_velocity,
            start_acceleration=start_acceleration, goal_acceleration=goal_acceleration,
            degree=degree, margin_space=margin_space, required_margin=required_margin,
            support_distance=support_distance, geometric=geometric,
            weights=Weights() if weights is None else weights,
        )  # fmt: skip
        frames = len(recording.key_frames)
        if control_points is None:
            control_points = max(frames + EXTRA_CONTROL_POINTS, degree + 1)
        _check_control_points(control_points, frames, requirements)
        _check_weights(requirements.weights)
        spacing = finite_number(frame_spacing, "keyframes frame_spacing [s]", above=0.0)
        values = {
            "recording": recording, "requirements": requirements,
            "control_points": int(control_points), "frame_spacing": spacing,
        }  # fmt: skip
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(
        cls, problem: CentroidalProblem, recording: Recording, control_points: int | None = None
    ) -> "KeyframeProblem":
        """Ask for the same as ``problem``, but with ends and timing of a recording.

        Args:
            problem: Whose body, margin, constraints, weights and conditions at the ends are taken over.
            recording: Samples, key frames and stances.
            control_points: The number of key frames plus 7 when omitted.

        Raises:
            InputError: If there are too few control points.
        """
        names = (
            "degree", "start_velocity", "goal_velocity", "start_acceleration", "goal_acceleration",
            "required_margin", "margin_space", "support_distance", "geometric", "weights",
        )  # fmt: skip
        given = {name: getattr(problem, name) for name in names}
        return cls(problem.mass, recording, control_points=control_points, **given)


def _check_control_points(count: object, frames: int, problem: CentroidalProblem) -> None:
    conditions = sum(
        value is not None
        for value in (
            problem.start_velocity, problem.start_acceleration, problem.goal_velocity,
            problem.goal_acceleration,
        )
    )  # fmt: skip
    least = max(frames + conditions + 1, problem.degree + 1)
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < least:
        raise InputError(
            f"keyframes control_points is {count!r}; valid: an integer >= {least} for {frames} key frames, "
            f"{conditions} end conditions and degree {problem.degree}"
        )


def _check_weights(weights: Weights) -> None:
    total = np.array([weights.velocity, weights.acceleration, weights.jerk]).sum(axis=0)
    if weights.smoothness == 0 or np.any(total == 0):
        raise InputError(
            "keyframes weights of velocity, acceleration and jerk are all zero along an axis; "
            "valid: one of them, and smoothness, > 0"
        )
