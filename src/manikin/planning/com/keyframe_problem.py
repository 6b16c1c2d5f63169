"""The keyframe-based problem: a CoM recorded on stances, and what a motion has to keep ([Qiu2012]_ 5.3.1)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.contact import ContactSchedule, Phase, StanceSequence
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.planning.com.com_problem import END_CONDITIONS, CentroidalProblem


@dataclass(frozen=True, eq=False)
class RecordedCom:
    """Samples of a CoM from the first key frame to the last, on a known sequence of stances.

    A key frame is a sample at which the support changes; the first and the last sample are
    key frames as well ([Qiu2012]_ Definition 3).

    Attributes:
        time: (n,) increasing [s]; 0 at the first key frame.
        com: (n, 3) [m].
        key_frames: (phases + 1,) indices of the key frames among the samples.
        sequence: Stances, one per phase, whose duration bounds are both the recorded duration.
        angular_momentum_rate: (n, 3) about the CoM [N.m] ([Qiu2012]_ 4.51); None where it is not known.
    """

    time: FloatArray
    com: FloatArray
    key_frames: NDArray[np.int64]
    sequence: StanceSequence
    angular_momentum_rate: FloatArray | None

    def __init__(
        self, time: ArrayLike, com: ArrayLike, sequence: StanceSequence, key_times: ArrayLike,
        angular_momentum_rate: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """Take over the samples from the first to the last key frame; the origin of the times may be any.

        ``key_times`` (phases + 1,) are the changes of the support, with both ends, moved to the nearest
        sample [s]; the other arguments are as the attributes.

        Raises:
            InputError: If a number is not finite, times do not increase, or a phase has no
                contact or fewer than one sample interval.
        """
        times = frozen_array(time, "recording time [s]", (None,))
        positions = frozen_array(com, "recording com [m]", (len(times), 3))
        wanted = frozen_array(key_times, "recording key times [s]", (len(sequence) + 1,))
        _check_increasing(times, "recording time")
        _check_increasing(wanted, "recording key times")
        empty = [number for number, phase in enumerate(sequence) if not len(phase.stance)]
        if empty:
            raise InputError(
                f"recording has no support in phase {empty[0]}; valid: at least one contact in every phase"
            )
        slack = float(np.median(np.diff(times)))
        if wanted[0] < times[0] - slack or wanted[-1] > times[-1] + slack:
            raise InputError(
                f"recording lasts from {times[0]:g} to {times[-1]:g} s but its key times from "
                f"{wanted[0]:g} to {wanted[-1]:g} s; valid: key times inside the recording"
            )
        frames = np.array([int(np.argmin(np.abs(times - instant))) for instant in wanted])
        for index in np.flatnonzero(np.diff(frames) < 1):
            raise InputError(
                f"recording has no sample between its key times {wanted[index]:g} and "
                f"{wanted[index + 1]:g} s; valid: samples that are closer than the shortest phase"
            )
        kept = slice(frames[0], frames[-1] + 1)
        durations = np.diff(times[frames] - times[frames[0]]).tolist()
        turning, name = angular_momentum_rate, "recording angular momentum rate [N.m]"
        if turning is not None:
            turning = frozen_array(frozen_array(turning, name, (len(times), 3))[kept], name)
        key_frames = frames - frames[0]
        key_frames.setflags(write=False)
        values = {
            "time": frozen_array(times[kept] - times[frames[0]], "recording time [s]"),
            "com": frozen_array(positions[kept], "recording com [m]"),
            "key_frames": key_frames,
            "sequence": StanceSequence([
                Phase(part.stance, t, t) for part, t in zip(sequence, durations, strict=True)
            ]),
            "angular_momentum_rate": turning,
        }  # fmt: skip
        vars(self).update(values)

    def with_angular_momentum_rate(self, rate: ArrayLike) -> "RecordedCom":
        """Recording with a rate of the angular momentum (n, 3) about the CoM at its samples [N.m]."""
        return RecordedCom(self.time, self.com, self.sequence, self.key_times, rate)

    @property
    def key_times(self) -> FloatArray:
        """(phases + 1,) time of each key frame [s]; the first is 0."""
        return self.time[self.key_frames]

    @property
    def schedule(self) -> ContactSchedule:
        """The stances with the key times."""
        return ContactSchedule(self.sequence, self.key_times)


def _check_increasing(times: FloatArray, name: str) -> None:
    steps = np.flatnonzero(np.diff(times) <= 0)
    if len(times) < 2 or len(steps):
        found = f"have {len(times)} entries" if len(times) < 2 else f"fall or stay at entry {steps[0] + 1}"
        raise InputError(f"{name} values {found}; valid: at least two, strictly increasing seconds")


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
        control_points: Their number before key frames are added; each added one brings one more.
        frame_spacing: Least distance of an added key frame from the others [s].
    """

    recording: RecordedCom
    requirements: CentroidalProblem
    control_points: int
    frame_spacing: float

    def __init__(
        self, mass: float, recording: RecordedCom, *, control_points: int | None = None,
        frame_spacing: float = FRAME_SPACING, **requirements: Any,
    ) -> None:  # fmt: skip
        """Put the problem together, of a body's mass [kg].

        Args:
            control_points: At least one more than there are key frames and end conditions; the
                number of key frames plus 7 when omitted.
            requirements: Further arguments of :class:`CentroidalProblem`. An acceleration at an end needs a
                velocity there; the weights of margin and duration play no part.

        Raises:
            InputError: If a value is not usable or there are too few control points.
        """
        com, frames = recording.com, len(recording.key_frames)
        asked = CentroidalProblem(mass, recording.sequence, com[0], com[-1], **requirements)
        if control_points is None:
            control_points = max(frames + EXTRA_CONTROL_POINTS, asked.degree + 1)
        conditions = sum(getattr(asked, name) is not None for name in END_CONDITIONS)
        least, count = max(frames + conditions + 1, asked.degree + 1), control_points
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < least:
            raise InputError(
                f"keyframes control_points is {count!r}; valid: an integer >= {least} for {frames} key "
                f"frames, {conditions} end conditions and degree {asked.degree}"
            )
        weights = asked.weights
        total = np.array([weights.velocity, weights.acceleration, weights.jerk]).sum(axis=0)
        if weights.smoothness == 0 or np.any(total == 0):
            raise InputError(
                "keyframes weights of velocity, acceleration and jerk are all zero along an axis; "
                "valid: one of them, and smoothness, > 0"
            )
        spacing = finite_number(frame_spacing, "keyframes frame_spacing [s]", above=0.0)
        vars(self).update(recording=recording, requirements=asked, control_points=int(count))
        vars(self).update(frame_spacing=spacing)

    @classmethod
    def of(
        cls, problem: CentroidalProblem, recording: RecordedCom, control_points: int | None = None
    ) -> "KeyframeProblem":
        """Problem with body and requirements of another one, and the ends and timing of a recording.

        Raises:
            InputError: If there are too few control points.
        """
        names = "degree", "required_margin", "margin_space", "support_distance", "geometric", "weights"
        given = {name: getattr(problem, name) for name in (*names, *END_CONDITIONS)}
        return cls(problem.mass, recording, control_points=control_points, **given)
