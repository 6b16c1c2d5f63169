"""Building the motion library from windows of recordings ([Truong2010]_ 6.4)."""

import csv
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, reduce
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.numerics.signals import fourier_coefficients, shifted
from manikin.numerics.spatial import FloatArray
from manikin.recordings import Recording, read_recording, reconstruct
from manikin.walking.gait.blend import TURN_RADIUS, Blend, Gait, steady_motion, travelled
from manikin.walking.gait.cycles import (
    CycleCut,
    as_one_person,
    cycle_cuts,
    foot_events,
    levelled,
    on_the_floor,
    spread,
    tilted,
)
from manikin.walking.gait.follow_path import stance_slides
from manikin.walking.gait.motion_library import ROOT, STAND, MotionLibrary, leg_length, reference_body

TABLE = "clips_locomotion.csv"
"""Table of the windows in the folder of recordings: columns class, file, first_frame0, end_frame0."""


@dataclass(frozen=True)
class Window:
    """A part of a recording, of a file below the folder, from a first frame up to, not with, a last one.

    Attributes:
        kind: Class of the motion.
    """

    kind: str
    file: str
    first: int
    last: int


def read_windows(folder: Path) -> list[Window]:
    """Windows named by a folder's table; InputError if it has none, or a row cannot be read."""
    table = folder / TABLE
    if not table.is_file():
        raise InputError(f"{folder} has no {TABLE}; valid: a folder with this table and the recordings")
    try:
        rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{table} cannot be read: {error}; valid: a table in UTF-8") from None
    windows = []
    try:
        for row in rows:
            windows.append(_window(row))
    except (KeyError, TypeError, ValueError, AttributeError):
        wrong = f"line {len(windows) + 2} is not usable"
        raise InputError(f"{table} {wrong}; valid: class, file, first_frame0, end_frame0") from None
    return windows


def _window(row: dict[str, str]) -> Window:
    kind = row["class"].split("(")[0].strip().removesuffix(" core")
    first, last = int(row["first_frame0"]), int(row["end_frame0"])
    if not 0 <= first < last:
        raise ValueError
    return Window(STAND if kind == "idle" else kind, row["file"], first, last)


SAMPLES = 64
"""Samples of a cycle, before its Fourier coefficients are taken."""

ACKNOWLEDGEMENTS = {
    "cmu": "The data used in this project was obtained from mocap.cs.cmu.edu. "
    "The database was created with funding from NSF EIA-0196217.",
    "accad": "Motion capture data: ACCAD / The Ohio State University, Open Motion Project, "
    "CC BY 3.0 Unported.",
}
"""Sources by the beginning of a recording's folder."""

NOT_CLOSED, MOST_SLIDE = np.deg2rad(15.0), 0.3
"""Root mean square difference of the hinges between both ends of a cycle; more is no cycle [rad]. Slide of a
standing foot; more is a landing or toe-off detected wrongly [m]."""

NEAR = 0.05
"""Cycles nearer to another one than this are left out [m/s]; people differ, and blends would flicker."""

SYMMETRIC = ("walk straight", "run straight", "backward", STAND)
"""Classes of cycles that are averaged with their mirror images, to go exactly straight."""


@dataclass(frozen=True, eq=False)
class LibraryBuild:
    """A library, with the mirror images, and the windows that were not used for it.

    Attributes:
        without_cycle: Windows in which no cycle was found, or none that closes and whose feet stand.
        near_others: Windows whose cycle is as fast as one that was taken.
    """

    library: MotionLibrary
    without_cycle: tuple[Window, ...]
    near_others: tuple[Window, ...]


def build_library(
    folder: Path, report: Callable[[float, str], None] = lambda _share, _name: None
) -> LibraryBuild:
    """Read, reconstruct and cut the recordings of a folder, and add the mirror images.

    Args:
        folder: Folder with :data:`TABLE` and, in ``mocap``, the recordings.
        report: Called with the share that is done and the file of the window.

    Raises:
        InputError: If a file is not usable, or no window holds a cycle.
    """
    body, windows = reference_body(), read_windows(folder)
    person = cache(lambda file: _person(body, folder / "mocap" / file))
    cycles, without = list[tuple[Window, MotionLibrary]](), list[Window]()
    for number, window in enumerate(windows):
        report(number / len(windows), window.file)
        cycle = _cycle(body, window, *person(window.file))
        if cycle is None or _slide(body, cycle) > MOST_SLIDE:
            without.append(window)
        else:
            cycles.append((window, cycle))
    report(1.0, f"{len(cycles)} cycles")
    if not cycles:
        raise InputError(f"{folder / TABLE} names no window with a whole cycle")
    counts = Counter(_person_of(window) for window, _ in cycles)
    ordered = sorted(cycles, key=lambda pair: -counts[_person_of(pair[0])])
    persons = [_person_of(window) for window, _ in ordered]
    alike = as_one_person(body, [cycle for _, cycle in ordered], persons)
    level = [_levelled(body, _symmetric(body, cycle)) for cycle in alike]
    kept = _apart(level)
    near = tuple(window for i, (window, _) in enumerate(ordered) if i not in kept)
    return LibraryBuild(_joined(body, [level[i] for i in kept]), tuple(without), near)


def _person(body: BodyModel, file: Path) -> tuple[FloatArray, float]:
    """A recording as (n, nq) postures of the reference body, and its rate [Hz]."""
    recording = read_recording(file)
    if not isinstance(recording, Recording):
        raise InputError(f"{file} holds no skeleton; valid: BVH or AMC")
    reconstruction = reconstruct(recording)
    q = np.array(reconstruction.q)
    q[:, :3] *= leg_length(body) / leg_length(reconstruction.body)
    return q, recording.rate


def _cycle(body: BodyModel, window: Window, q: FloatArray, rate: float) -> MotionLibrary | None:
    """The cycle of a window that closes best, or None; InputError if the recording ends before the window."""
    if window.last > len(q):
        raise InputError(f"{window.file} has {len(q)} frames; valid: at least {window.last}, by {TABLE}")
    if window.kind == STAND:
        return _standing(body, window, q)
    cuts = cycle_cuts(foot_events(body, q, rate), window.first / rate, window.last / rate)
    time = np.arange(len(q)) / rate
    signals = CubicSpline(time, _signals(q))
    inside = [cut for cut in cuts if cut.end <= time[-1]]
    best = min(inside, key=lambda cut: _gap(signals, cut), default=None)
    if best is None or _gap(signals, best) > NOT_CLOSED:
        return None
    within = (time >= best.start) & (time <= best.end)
    signals = CubicSpline(time, _signals(tilted(body, q, within)))
    return _coded(body, window, signals, best, rate)


def _signals(q: FloatArray) -> FloatArray:
    """(n, 6 + h) x, y, z, roll, pitch, continuous yaw of the root, then the hinges."""
    turns = Rotation.from_quat(q[:, 3:7]).as_euler("ZYX")
    turns[:, 0] = np.unwrap(turns[:, 0])
    return np.hstack([q[:, :3], turns[:, ::-1], q[:, 7:]])


def _gap(signals: CubicSpline, cut: CycleCut) -> float:
    """Root mean square difference of the hinges between both ends of a cycle [rad]."""
    difference = signals(cut.end)[len(ROOT) :] - signals(cut.start)[len(ROOT) :]
    return float(np.sqrt(np.mean(difference**2)))


def _coded(
    body: BodyModel, window: Window, signals: CubicSpline, cut: CycleCut, rate: float
) -> MotionLibrary:
    """A cycle as coefficients; what does not close is a drift that is taken out evenly."""
    share = np.linspace(0.0, 1.0, SAMPLES + 1)
    values = signals(cut.start + cut.period * share)
    steady = steady_motion(values[:, [0, 1, 5]], cut.period)
    values[:, [0, 1, 5]] = steady.error
    values -= (share - 0.5)[:, None] * (values[-1] - values[0])
    coefficients = fourier_coefficients(values[:-1])
    events = (np.array([cut.landing, cut.other_off, cut.other_landing]) - cut.start) / cut.period
    if cut.foot == "right":
        # Begun at the right toe-off: that of the other foot is the left one, which becomes the begin.
        strike, off, other = events
        coefficients = shifted(coefficients, off)
        events = np.array([other + 1.0 - off, 1.0 - off, strike - off])
    first, last = (round(instant * rate) for instant in (cut.start, cut.end))
    name = f"{Path(window.file).stem} {first}-{last}"
    return _one_cycle(body, window, name, steady.velocity, cut.period, events, coefficients)


def _slide(body: BodyModel, cycle: MotionLibrary) -> float:
    """Largest slide of a standing foot in some steps of a single cycle [m]."""
    phase, period = np.arange(3 * SAMPLES + 1) / SAMPLES, cycle.periods[0]
    n, velocity = len(phase), np.tile(cycle.velocities, (len(phase), 1))
    blend = Blend(np.zeros((n, 1), np.int64), np.ones((n, 1)), velocity, np.zeros(n, dtype=np.bool_))
    frames = Gait(cycle, body).frames(blend, phase, travelled(velocity, phase * period))
    return float(stance_slides(body, frames.q, frames.swing() < 0.0).max())


def _standing(body: BodyModel, window: Window, q: FloatArray) -> MotionLibrary:
    """The mean posture of a window, with the period and events of a slow walk to put feet in place."""
    values = _signals(tilted(body, q[window.first : window.last])).mean(axis=0)
    values[[0, 1, 5]] = 0.0
    coefficients = fourier_coefficients(np.tile(values, (SAMPLES, 1)))
    name = f"{Path(window.file).stem} {window.first}-{window.last}"
    return _one_cycle(body, window, name, np.zeros(3), 1.1, np.array([0.4, 0.5, -0.1]), coefficients)


def _one_cycle(
    body: BodyModel, window: Window, name: str, velocity: FloatArray, period: float, events: FloatArray,
    coefficients: FloatArray,
) -> MotionLibrary:  # fmt: skip
    sources = [text for key, text in ACKNOWLEDGEMENTS.items() if window.file.startswith(key)]
    return MotionLibrary(
        (name,), (window.kind,), velocity[None], np.array([period]), events[None], coefficients[None],
        body.joint_names, leg_length(body), tuple(sources[:1]),
    )  # fmt: skip


def _person_of(window: Window) -> str:
    """Name of the person by the begin of the file's name, as both collections have it."""
    return Path(window.file).stem.split("_")[0]


def _levelled(body: BodyModel, cycle: MotionLibrary) -> MotionLibrary:
    """A cycle with its limbs apart, its soles level and on the floor."""
    level = levelled(body, spread(body, cycle.coefficients[0]), cycle.events[0])
    coefficients, events = on_the_floor(body, level, cycle.events[0])
    return replace(cycle, coefficients=levelled(body, coefficients, events)[None], events=events[None])


def _symmetric(body: BodyModel, cycle: MotionLibrary) -> MotionLibrary:
    """Cycles of straight classes, averaged with their mirror images half a cycle later."""
    if cycle.kinds[0] not in SYMMETRIC:
        return cycle
    landing, off, other = cycle.events[0]
    reflected = shifted(cycle.mirrored(body).coefficients, 0.5 - off)
    # The mean of both leaves the floor between their toe-offs, at 0 and at off - 1/2.
    coefficients = shifted(0.5 * (cycle.coefficients + reflected), 0.5 * (off - 0.5))
    swing = 0.5 * (landing + other + 1.0 - off)
    return replace(
        cycle, velocities=cycle.velocities * [1.0, 0.0, 0.0], coefficients=coefficients,
        events=np.array([[swing, 0.5, swing - 0.5]]),
    )  # fmt: skip


def _apart(cycles: list[MotionLibrary]) -> list[int]:
    """Indices of the cycles that are not near to one before."""
    scale, kept = np.array([1.0, 1.0, TURN_RADIUS]), list[int]()
    for i, cycle in enumerate(cycles):
        away = [np.linalg.norm((cycle.velocities - cycles[j].velocities) * scale) for j in kept]
        if min(away, default=NEAR) >= NEAR:
            kept.append(i)
    return kept


def _joined(body: BodyModel, cycles: list[MotionLibrary]) -> MotionLibrary:
    """One library of cycles and, of those that are not symmetric, the mirror images."""
    thanks = dict.fromkeys(text for cycle in cycles for text in cycle.acknowledgements)
    library = replace(reduce(MotionLibrary.with_cycles, cycles), acknowledgements=tuple(thanks))
    sided = [i for i, kind in enumerate(library.kinds) if kind not in SYMMETRIC]
    return library.with_cycles(library.chosen(sided).mirrored(body)) if sided else library
