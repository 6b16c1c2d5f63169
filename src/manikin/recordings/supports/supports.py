"""Supports of a recorded person: which effector, when, and at which height.

A foot supports while its heel or toes do, or, with the heel raised, the ball about which it turns. Each of
these points has a switch with hysteresis: it closes where the point is slow and near a surface, and opens
where it is fast or away from it. Speeds are compared with the highest one of the swing, because the low-pass
filter turns the stop of a fast foot into a slope in proportion to its speed. Surfaces are found from the
recording (:mod:`manikin.recordings.supports.support_levels`), so stairs need no description. Other effectors
are in :mod:`manikin.recordings.supports.body_supports`; the force that the motion needs corrects all of them
(:mod:`manikin.recordings.supports.running_supports`).

Supports that force plates measured are compared with them by the errors in time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.numerics.signals import lasting, mask_runs, switch
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.recordings.readers.markers import ForcePlate
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import (
    RecordedSupports,
    Support,
    ground_supports,
    hand_supports,
    lying,
    median_place,
    seat_supports,
)
from manikin.recordings.supports.running_supports import by_the_force, while_carried
from manikin.recordings.supports.support_levels import (
    BALL,
    CUTOFF,
    LEVELS_APART,
    RAISED,
    SHIFT_SPEED,
    STEEP,
    RestSurface,
    Track,
    ball_of,
    heel_rise,
    slowest_speed,
    sole_height,
    sole_rise,
    surfaces_under,
    track,
)

FEET = ("left_foot", "right_foot")

NEAR = 0.05
"""Height above a surface within which a point touches down [m]."""

AWAY = 0.10
"""Distance from a surface beyond which a point has left it [m]. Below it, the sole of a model is stiff."""

NEAR_LYING, AWAY_LYING = 0.13, 0.18
"""NEAR and AWAY of a person who crawls or lies, whose feet lean on the ground with any side [m]."""

MOVES = 0.25
"""Speed of the slowest point of a sole above which the foot is on its way [m/s]."""

SHORTEST = 0.08
"""Shorter supports, and shorter interruptions of one, are noise [s]."""

SHORTEST_CUT = 0.04
"""Shortest support that the recording cuts, of which a part is missing [s]."""


def supports_of(
    found: Reconstruction, *, start: float = 0.0, cutoff: float = CUTOFF, with_force: bool = True
) -> RecordedSupports:
    """Supports of feet, seat, hands, knees, elbows and trunk of a reconstructed recording.

    Args:
        found: At least four instants at an even rate, not yet smoothed.
        start: What the first frame of the recording is on its clock [s].
        cutoff: Of the low-pass filter [Hz].
        with_force: Whether the force that the motion needs corrects the supports of the feet, see
            :mod:`manikin.recordings.supports.running_supports`.

    Raises:
        InputError: If the body has no feet with soles, there are too few instants, or the cutoff is too high.
    """
    soles = sole_points(found)
    rate = (len(found.time) - 1) / float(found.time[-1] - found.time[0]) if len(found.time) > 1 else 1.0
    begin = start + found.first_frame / rate
    feet = supports_of_points(soles, rate, start=begin, cutoff=cutoff, lying=lying(found))
    seats = seat_supports(found, soles, rate, start=begin, cutoff=cutoff)
    floor = floor_under(soles, feet.surfaces)
    others = (
        *seats,
        *ground_supports(found, floor, rate, start=begin, cutoff=cutoff),
        *hand_supports(found, floor, seats, rate, start=begin, cutoff=cutoff),
    )
    every = while_carried((*feet.supports, *others), found, rate, start=begin, cutoff=cutoff)
    if with_force:
        every = by_the_force(every, found, soles, feet.surfaces, rate, start=begin)
    return replace(feet, supports=tuple(sorted(every, key=lambda one: (one.start, one.effector))))


def supports_of_points(
    soles: Mapping[str, tuple[FloatArray, FloatArray]], rate: float, *, start: float = 0.0,
    cutoff: float = CUTOFF, lying: NDArray[np.bool_] | None = None,
) -> RecordedSupports:  # fmt: skip
    """Foot supports from heels and toes.

    Args:
        soles: (n, 3) heel and (n, 3) toes of each foot, by its name [m].
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].
        lying: (n,) whether the person lies or crawls; None for never.

    Raises:
        InputError: If there are too few positions, or the cutoff is too high.
    """
    tracks = {
        name: (track(heel, rate, cutoff), track(toes, rate, cutoff)) for name, (heel, toes) in soles.items()
    }
    frames = min(len(one.speed) for both in tracks.values() for one in both)
    flat = {name: heel.resting & toes.resting for name, (heel, toes) in tracks.items()}
    surfaces = surfaces_under(list(tracks.values()), lying)
    levels = np.array([level for surface in surfaces for level in surface.levels])
    down = np.zeros(frames, dtype=bool) if lying is None else lying
    near, away = np.where(down, NEAR_LYING, NEAR), np.where(down, AWAY_LYING, AWAY)
    supports: list[Support] = []
    for name, both in tracks.items():
        others_rest = np.any([rests for other, rests in flat.items() if other != name], axis=0)
        offsets = _offsets(both, flat[name] & ~others_rest, levels, down)
        if offsets is None:
            offsets = _offsets(both, flat[name], levels, down) or (0.0, 0.0)
        heel, toes = (one.positions[:, 2] - offset for one, offset in zip(both, offsets, strict=True))
        points = (*both, ball_of(*both))
        # Heel and toes of a foot that turns on the spot with its heel raised move about a resting ball.
        ball = _height_above((1.0 - BALL) * heel + BALL * toes, levels)
        above = (
            _height_above(heel, levels),
            _toes_above(both, toes, levels, down),
            np.where(heel_rise(*both) > RAISED, ball, np.inf),
        )
        touching = [_touching(one, height, near, away) for one, height in zip(points, above, strict=True)]
        supports += _supports(name, points, np.array(touching) & ~_steps(both, touching), surfaces, start)
    supports.sort(key=lambda support: (support.start, support.effector))
    heights = tuple(surface.height for surface in surfaces)
    return RecordedSupports(tuple(supports), start, start + (frames - 1) / rate, heights)


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


def floor_under(soles: Mapping[str, tuple[FloatArray, FloatArray]], surfaces: Sequence[float]) -> FloatArray:
    """(n,) height of the surface under the lower foot [m]; under its sole where no surface is known.

    Args:
        soles: (n, 3) heel and (n, 3) toes of each foot, by its name [m].
        surfaces: Heights [m].
    """
    lowest = np.min([end[:, 2] for both in soles.values() for end in both], axis=0)
    if not surfaces:
        return lowest
    levels = np.array(surfaces)
    return levels[np.argmin(np.abs(lowest[:, None] - levels), axis=1)]


def _offsets(
    points: tuple[Track, Track], stands: NDArray[np.bool_], levels: FloatArray, lying: NDArray[np.bool_]
) -> tuple[float, float] | None:
    """Heights of heel and toes above the surface where the foot stands: the errors of a model's sole [m].

    They are most reliable while the other foot moves; None where the foot never stands so.
    """
    height = sole_height(*points, lying)
    above = _height_above(height, levels)
    stands = stands & (np.abs(above) < LEVELS_APART) & (sole_rise(*points) < STEEP)
    if not stands.any():
        return None
    under = height - above
    heel, toes = (float(np.median((point.positions[:, 2] - under)[stands])) for point in points)
    return heel, toes


def _height_above(heights: FloatArray, levels: FloatArray) -> FloatArray:
    """(n,) from the nearest of the levels; infinite where there is none [m]."""
    if not len(levels):
        return np.full(len(heights), np.inf)
    above = heights[:, None] - levels
    return np.take_along_axis(above, np.argmin(np.abs(above), axis=1)[:, None], axis=1)[:, 0]


def _toes_above(
    points: tuple[Track, Track], toes: FloatArray, levels: FloatArray, lying: NDArray[np.bool_]
) -> FloatArray:
    """(n,) height of the toes, or of the lowest part of a steep sole, whichever is nearer to a level [m]."""
    above = _height_above(toes, levels)
    stands = _height_above(sole_height(*points, lying), levels)
    ball = np.where(sole_rise(*points) > STEEP, stands, np.inf)
    return np.where(np.abs(ball) < np.abs(above), ball, above)


def _touching(one: Track, height: FloatArray, near: FloatArray, away: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a point touches a surface that it is at a height (n,) above [m]."""
    slow, fast = one.slow_and_fast()
    return switch(slow & (height > -away) & (height < near), fast | (np.abs(height) > away))


def _steps(points: tuple[Track, Track], touching: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """(n,) whether a foot that seems to touch makes a step: the slowest point of its sole is too fast.

    A small step after a fast swing looks slow if the foot was down for too short to come to rest.
    """
    down, speed = np.logical_or.reduce(touching), slowest_speed(*points)
    steps = np.zeros(len(speed), dtype=bool)
    for first, stop in mask_runs(speed > MOVES):
        inside = first > 0 and stop < len(speed) and down[first - 1 : stop + 1].all()
        if inside and speed[first:stop].max() > SHIFT_SPEED:
            steps[first:stop] = True
    return steps


def _supports(
    name: str, points: tuple[Track, ...], touching: NDArray[np.bool_],
    surfaces: Sequence[RestSurface], start: float,
) -> list[Support]:  # fmt: skip
    """Runs in which heel, toes or ball touch, (3, n), without those that are too short."""
    rate, last, found = points[0].rate, touching.shape[1] - 1, []
    for first, stop in lasting(np.logical_or.reduce(touching), SHORTEST * rate, SHORTEST_CUT * rate):
        place = median_place(np.mean([point.positions[first:stop] for point in points[:2]], axis=0))
        away = [min(abs(level - float(place[2])) for level in surface.levels) for surface in surfaces]
        place[2] = surfaces[int(np.argmin(away))].height
        begins, ends = (points[int(np.argmax(touching[:, frame]))] for frame in (first, stop - 1))
        found.append(
            Support(
                name, start + first / rate, start + min(stop, last) / rate, place,
                begins.positions[first], ends.positions[stop - 1], first > 0, stop <= last,
            )
        )  # fmt: skip
    return found


SHORTEST_LOAD = 0.2
"""Shorter loads of a plate are not taken for supports [s]."""

LONGEST_BREAK = 0.02
"""Shorter breaks of a load are noise about its least force [s]."""

SEEN_FOR = 0.1
"""Time after a plate's start, and before its end, whose centre of pressure identifies the foot [s]."""

REACH = 0.3
"""Distance of a foot's place from the centre of pressure within which it may be its foot [m]."""

OVERHANG = 0.05
"""How far a heel or toes may be beyond the edge of a plate that is to see them [m]."""


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """A time for which a plate is loaded.

    Attributes:
        start: [s].
        end: [s].
        first_cop: (3,) mean centre of pressure of the first tenth of a second [m].
        last_cop: (3,) that of the last one [m].
        start_seen: Whether the load begins during the recording.
        end_seen: Whether it ends during the recording.
    """

    plate: str
    start: float
    end: float
    first_cop: FloatArray
    last_cop: FloatArray
    start_seen: bool
    end_seen: bool

    def __post_init__(self) -> None:
        for name in ("first_cop", "last_cop"):
            object.__setattr__(
                self, name, frozen_array(getattr(self, name), f"load of {self.plate} {name}", (3,))
            )


@dataclass(frozen=True)
class TimingError:
    """An extracted touch-down or lift-off beside that of a plate.

    Attributes:
        plate: Name of the plate.
        event: ``"touch-down"`` or ``"lift-off"``.
        time: That of the plate [s].
        error: Extracted minus plate [s].
    """

    plate: str
    effector: str
    event: str
    time: float
    error: float


def plate_loads(plate: ForcePlate) -> tuple[PlateLoad, ...]:
    """Times for which a plate is pressed, without breaks and loads that are too short."""
    pressed, found = plate.pressed.copy(), []
    for first, stop in mask_runs(~pressed):
        if stop - first < LONGEST_BREAK * plate.rate and first > 0 and stop < len(plate):
            pressed[first:stop] = True
    for first, stop in mask_runs(pressed):
        if stop - first < SHORTEST_LOAD * plate.rate:
            continue
        tenth = max(int(SEEN_FOR * plate.rate), 1)
        cop = plate.cop
        found.append(
            PlateLoad(
                plate.name, float(plate.time[first]), float(plate.time[min(stop, len(plate) - 1)]),
                np.nanmean(cop[first : first + tenth], axis=0), np.nanmean(cop[stop - tenth : stop], axis=0),
                first > 0, stop < len(plate),
            )
        )  # fmt: skip
    return tuple(found)


def timing_errors(found: RecordedSupports, plates: Sequence[ForcePlate]) -> tuple[TimingError, ...]:
    """Touch-downs and lift-offs compared with those of plates, in order of time.

    The foot is the one nearest to the centre of pressure then. Left out are events outside the recording, and
    those of a foot whose heel at touch-down, or toes at lift-off, are beyond the plate's edge.

    Args:
        found: On the clock of the plates.
        plates: Their loads are the reference.
    """
    errors = []
    for plate in plates:
        for load in plate_loads(plate):
            inside = [one for one in found.supports if one.start < load.end and load.start < one.end]
            first, last = _nearest(inside, load.first_cop), _nearest(inside, load.last_cop)
            lands = first and load.start_seen and first.start_seen and found.start < load.start
            if first and lands and plate.below(first.first_contact, OVERHANG):
                error = first.start - load.start
                errors.append(TimingError(plate.name, first.effector, "touch-down", load.start, error))
            lifts = last and load.end_seen and last.end_seen and load.end < found.end
            if last and lifts and plate.below(last.last_contact, OVERHANG):
                error = last.end - load.end
                errors.append(TimingError(plate.name, last.effector, "lift-off", load.end, error))
    return tuple(sorted(errors, key=lambda error: error.time))


def _nearest(supports: Sequence[Support], cop: FloatArray) -> Support | None:
    far = [float(np.linalg.norm(support.place[:2] - cop[:2])) for support in supports]
    return supports[int(np.argmin(far))] if far and min(far) < REACH else None
