"""Recorded walks as the criterion sees them: places and headings of a body, without the sway of its steps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.locomotion.model import to_body
from manikin.locomotion.shoulders import ShoulderPaths
from manikin.spatial import FloatArray, finite_number, frozen_array

SWAY = 0.5
"""Frequency above which a trunk sways with its steps and strides, which the model does not [Hz]."""

WALKING = 0.1
"""Speed of the shoulders' middle from which somebody walks [m/s]."""


@dataclass(frozen=True, eq=False)
class RecordedWalk:
    """A walk, recorded, or a part of one: from rest to rest unless velocities at its ends are given.

    Attributes:
        time: (n,) increasing, the walk starts at 0 [s].
        place: (n, 3) x, y [m] and continuous heading [rad].
        start: (3,) the place started from; if not given, the first recorded one.
        goal: (3,) the place asked for, its heading within half a turn of the last one; if not given, that.
        start_velocity: (3,) forward, left [m/s], angular [rad/s] at the start; if not given, at rest.
        goal_velocity: (3,) the same at the goal.
    """

    time: FloatArray
    place: FloatArray
    start: FloatArray
    goal: FloatArray
    start_velocity: FloatArray
    goal_velocity: FloatArray

    def __init__(
        self,
        time: ArrayLike,
        place: ArrayLike,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        start_velocity: ArrayLike = (0.0, 0.0, 0.0),
        goal_velocity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        instants = frozen_array(time, "recorded walk time [s]", (None,))
        places = frozen_array(place, "recorded walk place [m, m, rad]", (len(instants), 3))
        if len(instants) < 10 or np.any(np.diff(instants) <= 0) or instants[0] < 0.0:
            raise InputError(
                f"recorded walk has {len(instants)} instants from {instants.min(initial=np.inf):g} s; "
                "valid: at least 10, increasing, none before 0 s"
            )
        ends = []
        for name, value, default in (("start", start, places[0]), ("goal", goal, places[-1])):
            end = np.array(frozen_array(default if value is None else value, f"recorded walk {name}", (3,)))
            end[2] += 2.0 * np.pi * np.round((default[2] - end[2]) / (2.0 * np.pi))
            ends.append(frozen_array(end, f"recorded walk {name}"))
        if np.hypot(*(ends[1] - ends[0])[:2]) < 0.1:
            raise InputError("recorded walk ends where it starts; valid: at least 0.1 m away")
        for key, value in zip(("time", "place", "start", "goal"), (instants, places, *ends), strict=True):
            object.__setattr__(self, key, value)
        for name, value in (("start_velocity", start_velocity), ("goal_velocity", goal_velocity)):
            object.__setattr__(self, name, frozen_array(value, f"recorded walk {name}", (3,)))


def recorded_walk(
    paths: ShoulderPaths, window: tuple[int, int] | None = None, sway: float | None = SWAY
) -> RecordedWalk:
    """The middle of the shoulders and the heading of a walk, with the velocities at its ends.

    Low-passed twice: as the thesis does (:meth:`ShoulderPaths.low_passed`), and below ``sway``, which takes
    the steps out. Standing before and after is cut off. Velocities at the ends are those without sway.

    Args:
        paths: Shoulders of a whole recording.
        window: First frame and the one after the last; None for all.
        sway: Frequency above which changes are taken for steps [Hz]; None to keep the steps, at the ends too
            where place and velocities are still those without.

    Raises:
        InputError: If nobody walks in the window, or the frequency is not below half the rate.
    """
    cutoff = finite_number(SWAY if sway is None else sway, "sway [Hz]", above=0.0)
    if cutoff >= 0.5 * paths.rate:
        raise InputError(f"sway is {cutoff:g} Hz; valid: below half the rate, {0.5 * paths.rate:g} Hz")
    kept = paths.low_passed(0.5)
    calm = kept.low_passed(2.0 * cutoff / paths.rate)
    place = _place(calm)
    rate = np.asarray(np.gradient(place, 1.0 / paths.rate, axis=0))
    first, stop = (0, len(paths)) if window is None else window
    moving = first + np.flatnonzero(np.hypot(*rate[first:stop, :2].T) > WALKING)
    if moving.size < 10:
        raise InputError(
            f"nobody walks in frames {first} to {stop}; valid: ten frames faster than {WALKING} m/s"
        )
    walked = slice(int(moving[0]), int(moving[-1]) + 1)
    velocity = to_body(place[:, 2], rate)[walked]
    shown = place if sway is not None else _place(kept)
    shown = shown[walked] + 0.0
    shown[:, 2] += 2.0 * np.pi * np.round((place[walked.start, 2] - shown[0, 2]) / (2.0 * np.pi))
    time = np.arange(walked.stop - walked.start) / paths.rate
    ends = place[walked][[0, -1]]
    return RecordedWalk(time, shown, ends[0], ends[1], velocity[0], velocity[-1])


def _place(paths: ShoulderPaths) -> FloatArray:
    return np.column_stack([paths.middle, paths.heading])
