"""Measure supports and forces of recorded runs: writes ``runs.md`` and a figure in ``images``.

Run ``python docs/runs.py FOLDER``, where FOLDER has ``clips_locomotion.csv`` and ``clips_cluttered.csv``
(recordings with a class or a description each) and, in ``mocap``, those recordings and others.
"""

import csv
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from acknowledgements import THANKS
from matplotlib.figure import Figure
from PIL import Image

from manikin.numerics.spatial import GRAVITY, FloatArray
from manikin.recordings import (
    MarkerRecording,
    Reconstruction,
    RecordedDynamics,
    RecordedSupports,
    dynamics_of,
    least_shift,
    read_recording,
    reconstruct,
    recorded_margins,
    recorded_schedule,
    supports_of,
    timing_errors,
    touch_downs_of,
)
from manikin.recordings.supports.running_supports import AT_END, CUTOFF, FALLING, vertical_acceleration
from manikin.reports.figures import save_figure

PAGE = Path(__file__).with_suffix(".md")
IMAGE = PAGE.parent / "images" / "runs-force.png"
SHOWN = "09_01"
FASTEST_WALK = 2.0
"""Speed above which a recording without a description is taken for a run [m/s]."""

LOADED = 0.3
"""Vertical force per body weight that something has to supply."""

TEXT = f"""# Recorded runs

When a runner's feet carry is measured twice: by the feet, and by the force that the motion of the whole body
needs, for in flight the centre of mass falls with gravity. By `docs/runs.py`.

`supports_of` takes both. The feet, low-passed at 5 Hz, say which foot, and when in a walk. The vertical
force, from the centre of mass low-passed at {CUTOFF:g} Hz, says when a runner is carried: below {FALLING:g}
of the weight nothing does. A support of a foot that would end or begin within such a fall ends where it
begins or begins where it ends; where the body is carried and nothing was found, the feet beside carry on as
long as they are low, or else the lowest foot if it is; both feet of a landing land together. In a walk the
force never falls so low.

The threshold is not fitted: low-passed at {CUTOFF:g} Hz, a force that is half a sine and has the weight as
its mean has 0.09, 0.15, 0.21 and 0.31 of the weight left at touch-down and lift-off for stances and flights
of 0.30 and 0.05, 0.27 and 0.10, 0.22 and 0.13, 0.17 and 0.13 s.

"""
FIGURE = f"""
![vertical force of a run, with its supports](images/{IMAGE.name})

## All together

Means over recordings but for counts; *recorded* and *shifted* are shares of the frames with support that
have a positive margin, as recorded and once shifted by the least shift, whose root mean square is *shift*.
*Loaded* frames are those in flight in which the motion needs more than {LOADED:g} of the weight: supports
missed or too short. *Force in flight*: of the smooth motion, all three components, root mean square per
weight; none in truth. That no loaded frames are left is the doing of the rule; the force in flight,
horizontal too and with another low-pass, and the plates are witnesses of their own.

"""
TABLE = """
## By recording

{count} recordings: those called runs, with jumps and ducks in some, and others of more than {fastest:g}
m/s. Each cell: by the feet alone, then with the force; columns as above.

"""
MEANING = """
Late and missed supports are why nearly half of the frames in flight were loaded, not why half of the frames
with support have no positive margin as recorded: that share stays, and what repairs it is the least shift,
about twice as long as in walks. No frame in flight has a positive margin, so of all frames at most five in
six can.
"""
CUTOFFS = """
## Cutoffs

Would forces of runs be better with a higher cutoff, for a stance lasts but a quarter of a second? The same
supports, four low-passes of the postures; *recorded* and *shifted* are shares of the frames with support.

"""
LEFT = """
At 120 frames per second higher cutoffs take force out of flights, most of it at 8 Hz, at 30 they add some;
at both fewer frames are in balance as recorded, and none more once shifted. A cutoff that rises at landings
from flights, as it does at those of walks, takes a little force out of flights at 120 frames per second and
leaves fewer frames in balance at both rates. So runs have 5 Hz.

## What is not known

* *Forefeet*: a runner whose heel never lands has only the ball of the foot to push with. Skeletons give the
  tilt of a sole no better than to 0.2 of its length, with opposite signs for the two feet in some runs, and
  a run has no flat stance to learn it from. So every stance has the whole sole, and margins of runners on
  their toes come out too large.
* *Half of the weight*: the witness is one number for all feet. In a run with both feet down it says nothing
  of which one.
* *30 frames per second*: a flight of a run has two to four frames.
"""


@dataclass(frozen=True, eq=False)
class Measured:
    """A run with the supports that one way of finding them gives."""

    stances: int
    stance_times: list[float]
    flight_times: list[float]
    flights: int
    frames: int
    loaded: float
    falling: float
    force_in_flight: float
    recorded: float
    shifted: float
    shifted_of_all: float
    rms: float


@dataclass(frozen=True, eq=False)
class Run:
    """A recording and what is measured on it."""

    name: str
    rate: float
    speed: float
    strides: list[float]
    feet_alone: Measured
    with_force: Measured
    cutoffs: tuple[Measured, ...]


def files(folder: Path) -> Iterator[str]:
    """Recordings called runs, then all others of skeletons that have no description."""
    known: dict[str, bool] = {}
    for table, key in (("clips_locomotion.csv", "class"), ("clips_cluttered.csv", "description")):
        with (folder / table).open(newline="") as rows:
            for one in csv.DictReader(rows):
                known[one["file"]] = "Run" in one["file"] or one[key].startswith("run")
    yield from (file for file, runs in known.items() if runs)
    mocap = folder / "mocap"
    for path in sorted([*mocap.glob("cmu_asf_amc/*.amc"), *mocap.glob("accad_male1_bvh/*.bvh")]):
        if str(path.relative_to(mocap)) not in known:
            yield str(path.relative_to(mocap))


def described(file: str, folder: Path) -> bool:
    """Whether a recording is in one of the tables, or called a run."""
    tables = ("clips_locomotion.csv", "clips_cluttered.csv")
    return "Run" in file or any(file in (folder / table).read_text() for table in tables)


def force_of(found: Reconstruction) -> FloatArray:
    """(n,) vertical force per weight, by the centre of mass."""
    return 1.0 + vertical_acceleration(found, CUTOFF) / GRAVITY


def measured(found: Reconstruction, supports: RecordedSupports, dynamics: RecordedDynamics) -> Measured:
    """Of supports and of a smooth motion."""
    margins = recorded_margins(dynamics, recorded_schedule(found, supports), supports.start)
    shift = least_shift(found, dynamics, margins)
    flight = np.array([margins.polytopes[phase] is None for phase in margins.phase])
    inside = (found.time > AT_END) & (found.time < found.time[-1] - AT_END)
    force, weight = force_of(found), GRAVITY * dynamics.body.mass
    feet = [one for one in supports.supports if one.effector.endswith("foot")]
    free = [one for one in supports.phases if not one.effectors]
    free = [one for one in free if one.start > supports.start and one.end < supports.end]
    away = np.linalg.norm(dynamics.wrench[flight & inside, :3], axis=1) / weight
    positive = shift.margins.whole_body > 0.0
    return Measured(
        len(feet), [one.duration for one in feet if one.start_seen and one.end_seen],
        [one.duration for one in free], int(np.sum(flight & inside)), int(np.sum(inside)),
        float(np.sum(force[flight & inside] > LOADED)), float(np.sum(force[~flight & inside] < 0.0)),
        float(np.sqrt(np.mean(away**2))) if len(away) else float("nan"),
        float(np.mean(margins.whole_body[~flight] > 0.0)), float(np.mean(positive[~flight])),
        float(np.mean(positive)), 1e3 * shift.rms,
    )  # fmt: skip


def strides_of(found: Reconstruction, supports: RecordedSupports) -> list[float]:
    """Mean vertical force per weight between touch-downs of the same foot."""
    force, means = force_of(found), []
    for name in ("left_foot", "right_foot"):
        seen = [one for one in supports.of(name) if one.start_seen and one.start > supports.start + AT_END]
        frames = [one.frames(supports.start, found.rate, len(force))[0] for one in seen]
        means += [float(np.mean(force[a:b])) for a, b in pairwise(frames)]
    return means


def run_of(file: str, folder: Path) -> Run | None:
    """Measure a recording; None of one without a description that is no run."""
    found = reconstruct(read_recording(folder / "mocap" / file))
    rate = found.rate
    speed = float(np.linalg.norm((found.q[-1] - found.q[0])[:2]) / found.time[-1])
    if not described(file, folder) and speed < FASTEST_WALK:
        return None
    alone, supports = supports_of(found, with_force=False), supports_of(found)
    downs = touch_downs_of(supports)
    free = [one for one in supports.phases if not one.effectors]
    landings = tuple(one.end - supports.start for one in free if one.end < supports.end)
    motions = (
        dynamics_of(found, touch_downs=(*downs, *landings)),
        dynamics_of(found, 8.0),
        dynamics_of(found, 10.0),
    )
    return Run(
        Path(file).stem, rate, speed, strides_of(found, supports),
        measured(found, alone, dynamics_of(found, touch_downs=touch_downs_of(alone))),
        measured(found, supports, dynamics_of(found, touch_downs=downs)),
        tuple(measured(found, supports, motion) for motion in motions),
    )  # fmt: skip


def mean(ones: Sequence[Measured], of: Callable[[Measured], float]) -> float:
    """Over recordings."""
    return float(np.nanmean([of(one) for one in ones]))


def pair(one: Run, of: Callable[[Measured], str]) -> str:
    """Cell of a table."""
    return f"{of(one.feet_alone)}, {of(one.with_force)}"


def percent(share: float) -> str:
    """Without decimals; a dash of nothing."""
    return f"{100.0 * share:.0f}" if np.isfinite(share) else "-"


def loaded(one: Measured) -> float:
    """Share of the frames in flight."""
    return one.loaded / one.flights if one.flights else float("nan")


def middle(times: Sequence[float]) -> str:
    """Median [s]."""
    return f"{np.median(times):.2f}" if times else "-"


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """In Markdown."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(lines + ["| " + " | ".join(one) + " |" for one in rows]) + "\n"


def totals(runs: Sequence[Run]) -> str:
    """All recordings together."""
    ways = {"feet alone": [r.feet_alone for r in runs], "with the force": [r.with_force for r in runs]}
    rows = []
    for name, ones in ways.items():
        flights, frames = sum(one.flights for one in ones), sum(one.frames for one in ones)
        stance_times = [seconds for one in ones for seconds in one.stance_times]
        flight_times = [seconds for one in ones for seconds in one.flight_times]
        pushing_down = sum(one.falling for one in ones) / (frames - flights)
        rows.append([
            name, str(sum(one.stances for one in ones)), middle(stance_times),
            str(len(flight_times)), middle(flight_times), f"{100.0 * flights / frames:.0f}",
            f"{100.0 * sum(one.loaded for one in ones) / flights:.1f}", f"{100.0 * pushing_down:.1f}",
            f"{mean(ones, lambda o: o.force_in_flight):.2f}",
            f"{100.0 * mean(ones, lambda o: o.recorded):.1f}",
            f"{100.0 * mean(ones, lambda o: o.shifted):.1f}",
            f"{100.0 * mean(ones, lambda o: o.shifted_of_all):.1f}", f"{mean(ones, lambda o: o.rms):.1f}",
        ])  # fmt: skip
    heads = (
        "supports", "stances", "median [s]", "flights", "median [s]", "frames in flight [%]",
        "of these loaded [%]", "supported frames that push down [%]", "force in flight",
        "recorded [%]", "shifted [%]", "shifted, of all frames [%]", "shift [mm]",
    )  # fmt: skip
    return table(heads, rows)


def by_recording(runs: Sequence[Run]) -> str:
    """One row for each."""
    heads = (
        "clip", "speed [m/s]", "stances", "median [s]", "flights", "median [s]", "loaded [%]",
        "force in flight", "shifted [%]", "shift [mm]",
    )  # fmt: skip
    rows = [
        [
            one.name, f"{one.speed:.1f}", pair(one, lambda o: str(o.stances)),
            pair(one, lambda o: middle(o.stance_times)), pair(one, lambda o: str(len(o.flight_times))),
            pair(one, lambda o: middle(o.flight_times)), pair(one, lambda o: percent(loaded(o))),
            pair(one, lambda o: f"{o.force_in_flight:.2f}" if o.flights else "-"),
            pair(one, lambda o: percent(o.shifted)), pair(one, lambda o: f"{o.rms:.1f}"),
        ]
        for one in runs
    ]  # fmt: skip
    return table(heads, rows)


def by_cutoff(runs: Sequence[Run]) -> str:
    """One row for each low-pass and rate."""
    used = "5 Hz, more for the height of the CoM and at touch-downs of walks (used)"
    names = (used, "and at landings from flights", "8 Hz", "10 Hz")
    rows = []
    for name, number in zip(names, range(len(names)), strict=True):
        for rate in (120, 30):
            ones = [(one.with_force, *one.cutoffs)[number] for one in runs if round(one.rate) == rate]
            rows.append([
                name, f"{rate}", f"{mean(ones, lambda o: o.force_in_flight):.2f}",
                f"{100.0 * mean(ones, lambda o: o.recorded):.1f}",
                f"{100.0 * mean(ones, lambda o: o.shifted):.1f}", f"{mean(ones, lambda o: o.rms):.1f}",
            ])  # fmt: skip
    heads = ("low-pass", "frames per second", "force in flight", "recorded [%]", "shifted [%]", "shift [mm]")
    return table(heads, rows)


def speeds(runs: Sequence[Run]) -> Iterator[str]:
    """Stances by speed, and the force over whole strides."""
    for low, high in ((2.4, 3.2), (3.2, 4.0), (4.0, 5.5)):
        inside = [one for one in runs if low <= one.speed < high]
        alone = [t for one in inside for t in one.feet_alone.stance_times]
        ours = [t for one in inside for t in one.with_force.stance_times]
        yield (
            f"* At {low:.1f} to {high:.1f} m/s ({len(inside)} recordings) the median stance lasts\n"
            f"  {middle(alone)} s by the feet alone and {middle(ours)} s with the force."
        )
    strides = [stride for one in runs if one.speed > FASTEST_WALK for stride in one.strides]
    low, high = np.quantile(strides, [0.1, 0.9])
    yield (
        "* Between touch-downs of the same foot the mean vertical force, which a stride that repeats has\n"
        f"  equal to the weight, is {np.median(strides):.2f} of it (median of {len(strides)}; eight of ten "
        f"between {low:.2f} and {high:.2f})."
    )


def jump_text(folder: Path) -> str:
    """Errors of a drop jump beside force plates."""
    path = next((folder / "mocap").rglob("DJ1.trc"))
    recording = read_recording(path)
    assert isinstance(recording, MarkerRecording)
    found, cells = reconstruct(recording), []
    for with_force in (False, True):
        supports = supports_of(found, start=recording.start, with_force=with_force)
        errors = timing_errors(supports, recording.plates)
        for event in ("touch-down", "lift-off"):
            cells.append(" and ".join(f"{1e3 * one.error:+.0f}" for one in errors if one.event == event))
    return (
        "A drop jump on force plates has the only flights that are measured there. Both feet, found minus\n"
        f"measured: landing {cells[0]} ms, next jump {cells[1]} ms by the feet alone; {cells[2]} ms and\n"
        f"{cells[3]} ms with the force.\n"
    )


def draw(folder: Path) -> None:
    """Force of a run, with its supports by both ways."""
    found = reconstruct(read_recording(folder / "mocap" / "cmu_asf_amc" / f"{SHOWN}.amc"))
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(found.time, force_of(found), color="#444444")
    axes.axhline(FALLING, color="#444444", lw=0.8, ls=":")
    axes.axhline(0.0, color="#444444", lw=0.8)
    colours = {"left_foot": "#009E73", "right_foot": "#CC79A7"}
    for with_force, height in ((False, -0.55), (True, -0.95)):
        for one in supports_of(found, with_force=with_force).supports:
            axes.plot(
                [one.start, one.end], [height] * 2, lw=6, color=colours[one.effector], solid_capstyle="butt"
            )
        axes.text(
            found.time[-1] + 0.02, height, "with the force" if with_force else "feet alone", va="center"
        )
    axes.set(xlabel="time [s]", ylabel="vertical force [weight]", ylim=(-1.2, 3.0))
    axes.set_xlim(0.0, float(found.time[-1]) + 0.3)
    figure.set_dpi(100)
    save_figure(figure, IMAGE)
    Image.open(IMAGE).quantize(64).save(IMAGE, optimize=True)


def main() -> None:
    """Measure the runs in the folder on the command line and write the page."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "clips_locomotion.csv").is_file():
        raise SystemExit("usage: python docs/runs.py FOLDER; valid: a folder with clips_locomotion.csv")
    folder = Path(sys.argv[1])
    runs = [one for file in files(folder) if (one := run_of(file, folder)) is not None]
    draw(folder)
    PAGE.write_text(
        TEXT + jump_text(folder) + FIGURE + totals(runs) + "\n" + "\n".join(speeds(runs)) + "\n" + MEANING
        + CUTOFFS + by_cutoff(runs) + LEFT
        + TABLE.format(count=len(runs), fastest=FASTEST_WALK, loaded=LOADED) + by_recording(runs) + THANKS
    )  # fmt: skip


if __name__ == "__main__":
    main()
