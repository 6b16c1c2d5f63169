"""Which feet support a recorded person, when and at which height.

A foot supports while its heel or its toes do. Each of the two points is followed by a switch with
hysteresis: it closes where the point is slow and near a surface, and opens where it is fast or away from
it. Speeds are compared with the highest one of the swing, for the low-pass filter turns the stop of a
fast foot into a slope that is as high as the foot was fast. Surfaces are found from the recording itself
(:mod:`manikin.mocap.support_levels`), so stairs need no description.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import RecordedSupports, Support
from manikin.mocap.runs import runs
from manikin.mocap.seat_supports import seat_supports
from manikin.mocap.support_levels import CUTOFF, LEVELS_APART, REST, Track, surface_heights, track
from manikin.spatial import FloatArray

FEET = ("left_foot", "right_foot")

TOUCH_SHARE = 0.08
"""Share of the highest speed of its swing below which a point has touched down."""

LIFT_SHARE = 0.24
"""Share of the highest speed of its swing above which a point has lifted off."""

NEAR = 0.05
"""Height above a surface within which a point touches down [m]."""

AWAY = 0.10
"""Distance from a surface beyond which a point has left it [m]. Below it, the sole of a model is stiff."""

SHORTEST = 0.08
"""Shorter supports, and shorter interruptions of one, are not told from noise [s]."""


def supports_of(found: Reconstruction, *, start: float = 0.0, cutoff: float = CUTOFF) -> RecordedSupports:
    """Supports of feet and seat of a reconstructed recording, markers or skeleton.

    Args:
        found: At least four instants at an even rate, not yet smoothed.
        start: What the first frame of the recording is on its clock [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the body has no feet with soles, there are too few instants, or the cutoff is too high.
    """
    soles = sole_points(found)
    rate = (len(found.time) - 1) / float(found.time[-1] - found.time[0]) if len(found.time) > 1 else 1.0
    begin = start + found.first_frame / rate
    feet = supports_of_points(soles, rate, start=begin, cutoff=cutoff)
    both = (*feet.supports, *seat_supports(found, soles, rate, start=begin, cutoff=cutoff))
    return replace(feet, supports=tuple(sorted(both, key=lambda one: (one.start, one.effector))))


def supports_of_points(
    soles: Mapping[str, tuple[FloatArray, FloatArray]], rate: float, *, start: float = 0.0,
    cutoff: float = CUTOFF,
) -> RecordedSupports:  # fmt: skip
    """Foot supports from heels and toes.

    Args:
        soles: (n, 3) heel and (n, 3) toes of each foot, by its name [m].
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If there are too few positions, or the cutoff is too high.
    """
    tracks = {
        name: (track(heel, rate, cutoff), track(toes, rate, cutoff)) for name, (heel, toes) in soles.items()
    }
    frames = min(len(one.speed) for both in tracks.values() for one in both)
    flat = {name: heel.resting & toes.resting for name, (heel, toes) in tracks.items()}
    surfaces = surface_heights(list(tracks.values()))
    levels = np.array(surfaces)
    supports: list[Support] = []
    for name, both in tracks.items():
        offsets = _offsets(both, flat[name] & ~_others(flat, name), levels)
        if offsets is None:
            offsets = _offsets(both, flat[name], levels) or (0.0, 0.0)
        touching = [_touching(one, levels + offset) for one, offset in zip(both, offsets, strict=True)]
        supports += _supports(name, both, np.array(touching), levels, start)
    supports.sort(key=lambda support: (support.start, support.effector))
    return RecordedSupports(tuple(supports), start, start + (frames - 1) / rate, surfaces)


def sole_points(found: Reconstruction) -> dict[str, tuple[FloatArray, FloatArray]]:
    """(n, 3) heel and (n, 3) toes of each foot, the middles of the sole's ends [m].

    Raises:
        InputError: If the body has no feet with soles.
    """
    body = found.body
    if body.sole_length is None or not set(FEET) <= set(body.effectors):
        raise InputError(f"body {body.name!r} has no feet with soles; valid: a human")
    model, data, half = body.pinocchio, body.pinocchio.createData(), 0.5 * body.sole_length
    frames = [body.effector_frame(name) for name in FEET]
    ends = np.empty((len(FEET), 2, len(found.q), 3))
    for number, q in enumerate(found.q):
        pin.framesForwardKinematics(model, data, q)
        for foot, frame in enumerate(frames):
            for end, along in enumerate((-half, half)):
                ends[foot, end, number] = data.oMf[frame].act(np.array([along, 0.0, 0.0]))
    return {name: (ends[foot, 0], ends[foot, 1]) for foot, name in enumerate(FEET)}


def _height(heel: Track, toes: Track) -> FloatArray:
    return 0.5 * (heel.positions[:, 2] + toes.positions[:, 2])


def _others(flat: Mapping[str, NDArray[np.bool_]], name: str) -> NDArray[np.bool_]:
    """(n,) whether another foot rests."""
    return np.any([rests for other, rests in flat.items() if other != name], axis=0)


def _offsets(
    points: tuple[Track, Track], stands: NDArray[np.bool_], levels: FloatArray
) -> tuple[float, float] | None:
    """Heights of heel and toes above the surface where the foot stands: the errors of a model's sole [m].

    They are learnt best while the other foot moves: with both on the ground a person may be on the toes.
    None where the foot never stands so.
    """
    above = _height_above(_height(*points), levels)
    stands = stands & (np.abs(above) < LEVELS_APART)
    if not stands.any():
        return None
    under = _height(*points) - above
    heel, toes = (float(np.median((point.positions[:, 2] - under)[stands])) for point in points)
    return heel, toes


def _height_above(heights: FloatArray, levels: FloatArray) -> FloatArray:
    """(n,) from the nearest of the levels; infinite where there is none [m]."""
    if not len(levels):
        return np.full(len(heights), np.inf)
    above = heights[:, None] - levels
    return np.take_along_axis(above, np.argmin(np.abs(above), axis=1)[:, None], axis=1)[:, 0]


def _touching(one: Track, levels: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a point touches one of the levels."""
    touching = np.zeros(len(one.speed), dtype=bool)
    height = _height_above(one.positions[:, 2], levels)
    peaks = one.peak_speed()
    closes = (one.speed < np.maximum(REST, TOUCH_SHARE * peaks)) & (height > -AWAY) & (height < NEAR)
    opens = (one.speed > np.maximum(REST, LIFT_SHARE * peaks)) | (np.abs(height) > AWAY)
    state = False
    for frame in range(len(touching)):
        state = bool(closes[frame]) or (state and not opens[frame])
        touching[frame] = state
    return touching


def _supports(
    name: str, points: tuple[Track, ...], touching: NDArray[np.bool_], levels: FloatArray, start: float
) -> list[Support]:
    """Runs in which any of the points touches, without those that are too short to tell.

    Args:
        name: The foot.
        points: Heel and toes.
        touching: (2, n) which of them touches.
        levels: (k,) heights of the surfaces [m].
        start: Instant of the first frame [s].
    """
    rate, any_touches = points[0].rate, np.logical_or(*touching)
    shortest, last = SHORTEST * rate, len(any_touches) - 1
    for first, stop in runs(~any_touches):
        if stop - first < shortest and first > 0 and stop <= last:
            any_touches[first:stop] = True
    found = []
    for first, stop in runs(any_touches):
        if stop - first < shortest:
            continue
        place = np.median(np.mean([point.positions[first:stop] for point in points], axis=0), axis=0)
        place[2] = levels[np.argmin(np.abs(levels - place[2]))]
        begins, ends = (points[int(np.argmax(touching[:, frame]))] for frame in (first, stop - 1))
        found.append(
            Support(
                name, start + first / rate, start + min(stop, last) / rate, place,
                begins.positions[first], ends.positions[stop - 1], first > 0, stop <= last,
            )
        )  # fmt: skip
    return found
