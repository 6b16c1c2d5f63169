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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body.segments import FEET
from manikin.errors import InputError
from manikin.numerics.signals import lasting, mask_runs, switch
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.markers import ForcePlate
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import (
    RecordedSupports,
    Support,
    ground_supports,
    hand_supports,
    lowest_points,
    lying,
    median_place,
    seat_supports,
    support_in,
)
from manikin.recordings.supports.running_supports import by_the_force, while_carried
from manikin.recordings.supports.support_levels import (
    BALL,
    LEVELS_APART,
    RAISED,
    SHIFT_SPEED,
    RecordedSole,
    RestSurface,
    Track,
    surfaces_under,
)

NEAR, AWAY, NEAR_LYING, AWAY_LYING = 0.05, 0.10, 0.13, 0.18
"""Height above a surface within which a point touches down, and distance from it beyond which it has left
it [m]: the sole of a model is stiff. The same of who crawls or lies, whose feet lean on the ground anyhow."""

MOVES = 0.25
"""Speed of the slowest point of a sole above which the foot is on its way [m/s]."""

SHORTEST, SHORTEST_CUT = 0.08, 0.04
"""Shorter supports, and shorter interruptions of one, are noise; of those that the recording cuts a part is
missing [s]."""


def supports_of(found: Reconstruction, *, start: float = 0.0, with_force: bool = True) -> RecordedSupports:
    """Supports of feet, seat, hands, knees, elbows and trunk of a reconstructed recording.

    Args:
        found: At least four instants at an even rate above 10 Hz, not yet smoothed, of a body with soles.
        start: What the first frame of the recording is on its clock [s].
        with_force: Whether the force that the motion needs corrects the supports of the feet, see
            :mod:`manikin.recordings.supports.running_supports`.
    """
    soles, begin = sole_points(found), start + found.first_frame / found.rate
    feet = supports_of_points(soles, found.rate, start=begin, lying=lying(found))
    seats, floor = seat_supports(found, soles, begin), floor_under(soles, feet.surfaces)
    others = *ground_supports(found, floor, begin), *hand_supports(found, floor, seats, begin)
    every, surfaces = tuple(while_carried((*feet.supports, *seats, *others), found, begin)), feet.surfaces
    if with_force:
        every, surfaces = by_the_force(every, found, soles, surfaces, begin)
    ordered = tuple(sorted(every, key=lambda one: (one.start, one.effector)))
    return replace(feet, supports=ordered, surfaces=surfaces)


def supports_of_points(
    soles: Mapping[str, tuple[FloatArray, FloatArray]], rate: float, *, start: float = 0.0,
    lying: NDArray[np.bool_] | None = None,
) -> RecordedSupports:  # fmt: skip
    """Foot supports from heels and toes (n, 3) of each foot, by its name [m], with errors of :func:`track`.

    Args:
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        lying: (n,) whether the person lies or crawls; None for never.
    """
    tracks = {name: RecordedSole.of(ends, rate) for name, ends in soles.items()}
    frames = min(len(end.speed) for sole in tracks.values() for end in (sole.heel, sole.toes))
    flat = {name: sole.heel.resting & sole.toes.resting for name, sole in tracks.items()}
    down = np.zeros(frames, dtype=bool) if lying is None else lying
    surfaces = surfaces_under(list(tracks.values()), down)
    levels = np.array([level for surface in surfaces for level in surface.levels])
    near, away = np.where(down, NEAR_LYING, NEAR), np.where(down, AWAY_LYING, AWAY)
    supports: list[Support] = []
    for name, sole in tracks.items():
        others_rest = np.any([rests for other, rests in flat.items() if other != name], axis=0)
        offsets = _offsets(sole, flat[name] & ~others_rest, levels, down)
        if offsets is None:
            offsets = _offsets(sole, flat[name], levels, down) or (0.0, 0.0)
        heel, toes = sole.heel.positions[:, 2] - offsets[0], sole.toes.positions[:, 2] - offsets[1]
        # Heel and toes of a foot that turns on the spot with its heel raised move about a resting ball.
        ball = _height_above((1.0 - BALL) * heel + BALL * toes, levels)
        heights = (
            (sole.heel, _height_above(heel, levels)), (sole.toes, _toes_above(sole, toes, levels, down)),
            (sole.ball, np.where(sole.heel_rise > RAISED, ball, np.inf)),
        )  # fmt: skip
        touching = np.array([_touching(point, height, near, away) for point, height in heights])
        supports += _supports(name, sole, touching & ~_steps(sole, touching), surfaces, start)
    supports.sort(key=lambda support: (support.start, support.effector))
    heights = tuple(surface.height for surface in surfaces)
    return RecordedSupports(tuple(supports), start, start + (frames - 1) / rate, heights)


def sole_points(found: Reconstruction) -> dict[str, tuple[FloatArray, FloatArray]]:
    """(n, 3) heel and (n, 3) toes of each foot, middles of the sole's ends [m]; InputError without soles."""
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
    """(n,) height of the surface under the lower foot [m]; under its sole where no surface is known."""
    lowest, levels = lowest_points(soles), np.array(surfaces)
    return levels[np.argmin(np.abs(lowest[:, None] - levels), axis=1)] if len(levels) else lowest


def _offsets(
    sole: RecordedSole, stands: NDArray[np.bool_], levels: FloatArray, lying: NDArray[np.bool_]
) -> tuple[float, float] | None:
    """Heights of heel and toes above the surface where the foot stands: the errors of a model's sole [m].

    They are most reliable while the other foot moves; None where the foot never stands so.
    """
    height = sole.height(lying)
    above = _height_above(height, levels)
    stands = stands & (np.abs(above) < LEVELS_APART) & ~sole.steep
    if not stands.any():
        return None
    ends = (end.positions[:, 2] - (height - above) for end in (sole.heel, sole.toes))
    heel, toes = (float(np.median(end[stands])) for end in ends)
    return heel, toes


def _height_above(heights: FloatArray, levels: FloatArray) -> FloatArray:
    """(n,) from the nearest of the levels; infinite where there is none [m]."""
    if not len(levels):
        return np.full(len(heights), np.inf)
    above = heights[:, None] - levels
    return np.take_along_axis(above, np.argmin(np.abs(above), axis=1)[:, None], axis=1)[:, 0]


def _toes_above(
    sole: RecordedSole, toes: FloatArray, levels: FloatArray, lying: NDArray[np.bool_]
) -> FloatArray:
    """(n,) height of the toes, or of the lowest part of a steep sole, whichever is nearer to a level [m]."""
    above = _height_above(toes, levels)
    ball = np.where(sole.steep, _height_above(sole.height(lying), levels), np.inf)
    return np.where(np.abs(ball) < np.abs(above), ball, above)


def _touching(one: Track, height: FloatArray, near: FloatArray, away: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether a point touches a surface that it is at a height (n,) above [m]."""
    slow, fast = one.slow_and_fast()
    return switch(slow & (height > -away) & (height < near), fast | (np.abs(height) > away))


def _steps(sole: RecordedSole, touching: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) whether a foot that seems to touch makes a step: the slowest point of its sole is too fast.

    A small step after a fast swing looks slow if the foot was down for too short to come to rest.
    """
    down, speed = np.logical_or.reduce(touching), sole.speed
    steps = np.zeros(len(speed), dtype=bool)
    for first, stop in mask_runs(speed > MOVES):
        inside = first > 0 and stop < len(speed) and down[first - 1 : stop + 1].all()
        if inside and speed[first:stop].max() > SHIFT_SPEED:
            steps[first:stop] = True
    return steps


def _supports(
    name: str, sole: RecordedSole, touching: NDArray[np.bool_], surfaces: Sequence[RestSurface], start: float
) -> Iterator[Support]:
    """Runs in which heel, toes or ball touch, (3, n), without those that are too short."""
    rate, points = sole.heel.rate, (sole.heel, sole.toes, sole.ball)
    for first, stop in lasting(np.logical_or.reduce(touching), SHORTEST * rate, SHORTEST_CUT * rate):
        ends = np.array([sole.heel.positions[first:stop], sole.toes.positions[first:stop]])
        place = median_place(ends.mean(axis=0))
        away = [min(abs(level - float(place[2])) for level in surface.levels) for surface in surfaces]
        place[2] = surfaces[int(np.argmin(away))].height
        begins, ends = (points[touching[:, k].argmax()].positions[k] for k in (first, stop - 1))
        yield support_in(name, (first, stop), touching.shape[1], rate, start, (place, begins, ends))


SHORTEST_LOAD, LONGEST_BREAK = 0.2, 0.02
"""Shorter loads of a plate are no supports, and shorter breaks are noise about the least force [s]."""

SHORTEST_RUN, RUN_FORCE = 0.08, 500.0
"""Time from which a load is a support if it exceeds a force, as under a runner [s, N]."""

SEEN_FOR, REACH = 0.1, 0.3
"""Time after a plate's start, and before its end, whose centre of pressure identifies the foot [s], and
distance from it within which the foot's place is [m]."""

OVERHANG = 0.05
"""How far a heel or toes may be beyond the edge of a plate that is to see them [m]."""


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """A time [s] for which a plate is loaded, and whether its start and end are in the recording.

    Attributes:
        first_cop: (3,) mean centre of pressure of the first tenth of a second [m]; ``last_cop`` of the last.
    """

    start: float
    end: float
    first_cop: FloatArray
    last_cop: FloatArray
    start_seen: bool
    end_seen: bool


@dataclass(frozen=True)
class TimingError:
    """An extracted touch-down or lift-off beside that of a plate.

    Attributes:
        plate: Name of the plate.
        event: ``"touch-down"`` or ``"lift-off"``.
        time: That of the plate [s]; ``error`` is extracted minus plate [s].
    """

    plate: str
    effector: str
    event: str
    time: float
    error: float


def plate_loads(plate: ForcePlate) -> Iterator[PlateLoad]:
    """Times for which a plate is pressed, without breaks and loads that are too short."""
    pressed, count = plate.pressed.copy(), len(plate)
    for first, stop in mask_runs(~pressed):
        if stop - first < LONGEST_BREAK * plate.rate and first > 0 and stop < count:
            pressed[first:stop] = True
    tenth = max(int(SEEN_FOR * plate.rate), 1)
    for first, stop in mask_runs(pressed):
        highest = float((plate.force[first:stop] @ plate.normal).max())
        shortest = SHORTEST_RUN if highest > RUN_FORCE else SHORTEST_LOAD
        if stop - first >= shortest * plate.rate:
            cop, end = plate.cop[first:stop], float(plate.time[min(stop, count - 1)])
            begins, ends = np.nanmean(cop[:tenth], axis=0), np.nanmean(cop[-tenth:], axis=0)
            yield PlateLoad(float(plate.time[first]), end, begins, ends, first > 0, stop < count)


def timing_errors(found: RecordedSupports, plates: Sequence[ForcePlate]) -> tuple[TimingError, ...]:
    """Touch-downs and lift-offs compared with those of plates, in order of time.

    The foot is the one nearest to the centre of pressure then. Left out are events outside the recording, and
    those of a foot whose heel at touch-down, or toes at lift-off, are beyond the plate's edge. All are on
    one clock.
    """
    errors = []
    for plate in plates:
        for load in plate_loads(plate):
            inside = [one for one in found.supports if one.start < load.end and load.start < one.end]
            first, last = _nearest(inside, load.first_cop), _nearest(inside, load.last_cop)
            lands = load.start_seen and found.start < load.start
            lifts = load.end_seen and load.end < found.end
            if first and lands and first.start_seen and plate.below(first.first_contact, OVERHANG):
                late = first.start - load.start
                errors.append(TimingError(plate.name, first.effector, "touch-down", load.start, late))
            if last and lifts and last.end_seen and plate.below(last.last_contact, OVERHANG):
                late = last.end - load.end
                errors.append(TimingError(plate.name, last.effector, "lift-off", load.end, late))
    return tuple(sorted(errors, key=lambda error: error.time))


def _nearest(supports: Sequence[Support], cop: FloatArray) -> Support | None:
    far = [float(np.linalg.norm(support.place[:2] - cop[:2])) for support in supports]
    return supports[int(np.argmin(far))] if far and min(far) < REACH else None
