"""Find the weights of the walking criterion from recorded walks: writes ``inverse.md`` and its figure.

Run ``python docs/inverse.py FOLDER``, where FOLDER has ``clips_locomotion.csv`` (windows of recordings with a
class each) and, in ``mocap``, recordings of the CMU Graphics Lab and of the ACCAD Open Motion Project.
"""

import csv
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from acknowledgements import THANKS
from identify_objective import (
    FIRST_GUESS,
    HEADING_LENGTH,
    IDENTIFIED,
    SWAY,
    IdentifiedObjective,
    RecordedWalk,
    identify_objective,
    predicted,
    recorded_walk,
    share_errors,
)
from scipy.optimize import minimize_scalar
from scipy.stats import binomtest

from manikin.numerics.spatial import FloatArray
from manikin.recordings import Recording, read_recording
from manikin.walking import LITERAL_ORDER, PROSE_ORDER, ShoulderPaths, WalkObjective
from manikin.walking.path.walking_path import WalkingPath

mpl.use("Agg")

from matplotlib import pyplot as plt

PAGE = Path(__file__).with_suffix(".md")
FIGURE = PAGE.parent / "images" / "inverse.png"
CLASSES = ("walk straight", "walk veer", "walk 90 turn", "walk turn", "sidestep core")
LEFT_OUT = ("Quick", "09_12")
"""Side steps at a run; one long recording of many walks."""
AROUND = 0.5
"""Before and after the window of a turn [s]."""
FURTHER = ("Male1_B1_StandToWalk", "Male1_B2_WalkToStand")
THESIS_ATD = 0.14
RATE = 30.0
"""Of all walks in the fit, that of the slowest recordings [Hz]."""
FOLDS = 5
SCALES = np.array([1.0, 1.0, HEADING_LENGTH])
STARTS = (
    PROSE_ORDER,
    LITERAL_ORDER,
    FIRST_GUESS,
    WalkObjective(forward=10.0, lateral=1.0, angular=10.0, goal=0.1),
    WalkObjective(forward=4.0, lateral=100.0, angular=7.0, goal=0.1),
)
"""Where the fit starts; the best end counts."""
SHOWN = (
    "16_33", "07_01", "49_01", "16_11", "16_12", "16_25", "16_17", "16_20", "16_30",
    "Male1_B9_WalkToTurnLeft90", "Male1_B14_WalkTurnRight135", "Male1_B22_SideStepLeft",
)  # fmt: skip

TEXT = """# Weights from recorded walks

Which weights of Truong's criterion (5.6) explain recorded walks? {count} walks of the CMU Graphics Lab and
of the ACCAD Open Motion Project are reduced to the middle of the shoulders and the heading; one set of
weights is fitted to all of them at once (`docs/identify_objective.py`). By `docs/inverse.py`.

* *Walks*: the classes {classes} of `clips_locomotion.csv` without runs, and two clips from standing to
  walking and back. Of turns, the window and {around:g} s on both sides, as these people were instructed where
  to turn; of others, the whole clip without standing. {resting} of them begin or end at rest; the others
  pass through the ends, and the velocities there are required of the prediction too.
* *Filter*: low-pass at half the Nyquist frequency as in the thesis (4.3.4), then at {sway:g} Hz, which
  takes the sway of the strides out.
* *Fit*: squared distances at the same instants, at {rate:g} Hz of all, an error of heading of one radian as
  {length:g} m; the weight of time is 1.
* *Intervals*: 95 %, errors within a walk dependent, walks independent.
* *Error*: mean distance between recorded and predicted path at equal shares of both durations, over walks.
  The thesis' people differ among themselves by an ATD of {atd:.0f} cm (4.4).

"""
TEMPO = """
*At their tempo*: forward, lateral and angular weights of (5.8) times one factor, the best: {factors[0]:.1f}
in the order of the prose, {factors[1]:.1f} in the literal one. Recorded people walk more slowly than the
weights of (5.8) ask.

"""
ORDER = """## Which order of weights

The text of 5.5.1 says that lateral accelerations cost 1.5 times what forward ones do and turning less;
(5.5) with (5.8), read literally, swaps lateral and angular.

* Lateral weight over forward weight: {forward_ratio}; the prose has 1.42, the literal order 0.58: the
  interval holds {forward_held}.
* Lateral weight over angular weight [rad²/m²]: {angular_ratio}; the prose has 2.43, the literal order
  0.41: the interval holds {angular_held}.

Walks to which the order of the prose comes nearer, and how many times as large as its sum of squares that of
the literal order is. As printed, it is nearer at equal shares in {wins} of {count}, sign test p = {p:.2g}.

"""
LIMITS = """
## What this does not say

* The fit has more than one optimum, as paths leap from one way to another when weights change; intervals
  hold about each. How far the lateral weight is above the forward one differs between them.
* Turns alone and the other walks need different weights: one criterion for both is a compromise. What
  either predicts of goals at rest: [holonomic, nonholonomic, holonomic](patterns.md), where the identified
  weights are options, `recorded` and `recorded-turns`.
* The recorded people had no target; the end of a window is taken as the goal. The weight of looking at the
  goal is observed most weakly.
* Long walks at an even speed are not optimal under (5.6) for any weights: it pays to speed up and to slow
  down again.

"""


@dataclass(frozen=True, eq=False)
class Clip:
    """A walk of a recording, with and without the sway of its steps."""

    kind: str
    name: str
    walk: RecordedWalk
    swaying: RecordedWalk

    @property
    def turns(self) -> bool:
        """Whether somebody was told to turn a corner."""
        return "turn" in self.kind


@dataclass(frozen=True, eq=False)
class Explanation:
    """What an objective predicts of walks: paths, errors at equal shares [m] and (n,) losses [m^2]."""

    objective: WalkObjective
    paths: tuple[WalkingPath, ...]
    errors: FloatArray
    losses: FloatArray
    instant_errors: FloatArray
    heading_errors: FloatArray
    tempo: FloatArray


def clips(folder: Path) -> Iterator[Clip]:
    """The chosen walks."""
    with (folder / "clips_locomotion.csv").open(newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["class"].startswith(CLASSES)]
    chosen = {row["file"]: row for row in rows if not any(name in row["file"] for name in LEFT_OUT)}
    for file, row in chosen.items():
        paths = shoulders(folder / "mocap" / file)
        window = None
        if "turn" in row["class"]:
            around = int(AROUND * paths.rate)
            window = (
                max(0, int(row["first_frame0"]) - around),
                min(len(paths), int(row["end_frame0"]) + around),
            )
        yield clip(row["class"].split(" (")[0], Path(file).stem, paths, window)
    for name in FURTHER:
        yield clip(
            "start or stop", name, shoulders(folder / "mocap" / "accad_male1_bvh" / f"{name}.bvh"), None
        )


def shoulders(file: Path) -> ShoulderPaths:
    """Of a recording."""
    found = read_recording(file)
    assert isinstance(found, Recording)
    return ShoulderPaths.of_recording(found)


def clip(kind: str, name: str, paths: ShoulderPaths, window: tuple[int, int] | None) -> Clip:
    """A walk in a window."""
    every = round(paths.rate / RATE)
    return Clip(
        kind,
        name,
        thinned(recorded_walk(paths, window), every),
        thinned(recorded_walk(paths, window, None), every),
    )


def thinned(walk: RecordedWalk, every: int) -> RecordedWalk:
    """The same at fewer instants."""
    return RecordedWalk(
        walk.time[::every], walk.place[::every], walk.start, walk.goal, walk.start_velocity,
        walk.goal_velocity,
    )  # fmt: skip


def explained(walks: Sequence[RecordedWalk], objective: WalkObjective) -> Explanation:
    """Predictions of an objective."""
    paths = predicted(walks, objective)
    errors = [
        path.place_at(np.minimum(walk.time, path.duration)) - walk.place
        for path, walk in zip(paths, walks, strict=True)
    ]
    return Explanation(
        objective=objective,
        paths=paths,
        errors=share_errors(walks, paths),
        losses=np.array([np.sum((one * SCALES) ** 2) for one in errors]),
        instant_errors=np.array([np.hypot(*one[:, :2].T).mean() for one in errors]),
        heading_errors=np.array([np.sqrt(np.mean(one[:, 2] ** 2)) for one in errors]),
        tempo=np.array([path.duration / walk.time[-1] for path, walk in zip(paths, walks, strict=True)]),
    )


def at_their_tempo(walks: Sequence[RecordedWalk], objective: WalkObjective) -> tuple[WalkObjective, float]:
    """The objective with its accelerations' weights times the factor that fits best, and the factor."""

    def scaled(log: float) -> WalkObjective:
        factor = float(np.exp(log))
        return replace(
            objective,
            forward=factor * objective.forward,
            lateral=factor * objective.lateral,
            angular=factor * objective.angular,
        )

    best = minimize_scalar(
        lambda log: explained(walks, scaled(log)).losses.sum(), bounds=(-1.0, 4.0), options={"xatol": 0.01}
    )
    return scaled(float(best.x)), float(np.exp(best.x))


def ratio(found: IdentifiedObjective, first: str, second: str) -> tuple[float, float, float]:
    """Of two weights, with the ends of its interval."""
    i, j = IDENTIFIED.index(first), IDENTIFIED.index(second)
    width = 0.5 * np.log(found.high / found.low)
    both = np.sqrt(width[i] ** 2 + width[j] ** 2 - 2.0 * found.correlation[i, j] * width[i] * width[j])
    value = getattr(found.objective, first) / getattr(found.objective, second)
    return value, float(value * np.exp(-both)), float(value * np.exp(both))


def results(
    found: Sequence[Clip], optima: Sequence[IdentifiedObjective], tempi: dict[str, WalkObjective]
) -> Iterator[str]:
    """Table of objectives."""
    yield from row(
        "weights", "walks", *IDENTIFIED, "error, mean", "median", "same instants", "heading",
        "duration, predicted/recorded", "sum of squares [m²]",
    )  # fmt: skip
    walks = [one.walk for one in found]
    given = {"(5.8), order of the prose": PROSE_ORDER, "(5.8), literal order": LITERAL_ORDER, **tempi}
    for name, objective in given.items():
        weights = [f"{value:.2f}" for value in objective.weights[1:]]
        yield from row(name, len(walks), *weights, *errors(explained(walks, objective)), head=False)
    for name, fit in zip(("**identified**", *["another optimum"] * len(optima)), optima, strict=False):
        yield from row(name, len(walks), *told(fit), *errors(explained(walks, fit.objective)), head=False)
    yield from row(
        "identified without a fifth, which is predicted", len(walks), *[""] * 4, *errors(left_out(walks)),
        head=False,
    )  # fmt: skip
    parts = {
        "identified without turns": [c.walk for c in found if not c.turns],
        "identified from turns": [c.walk for c in found if c.turns],
        "identified with the sway": [c.swaying for c in found],
    }
    for name, part in parts.items():
        fit = identify(part)[0]
        yield from row(name, len(part), *told(fit), *errors(explained(part, fit.objective)), head=False)


def told(found: IdentifiedObjective) -> list[str]:
    """Weights with their intervals."""
    return [
        f"{value:.2g} ({low:.2g} to {high:.2g})" if high < 1e4 * low else f"{value:.2g} (not told)"
        for value, low, high in zip(found.objective.weights[1:], found.low, found.high, strict=True)
    ]


def errors(found: Explanation) -> list[str]:
    """Cells of a table."""
    return [
        centimetres(found.errors.mean()),
        centimetres(np.median(found.errors)),
        centimetres(found.instant_errors.mean()),
        f"{np.degrees(found.heading_errors.mean()):.0f}°",
        f"{np.median(found.tempo):.2f}",
        f"{found.losses.sum():.0f}",
    ]


def by_clip(found: Sequence[Clip], fits: dict[str, Explanation]) -> Iterator[str]:
    """Table of errors at equal shares."""
    yield from row("class", "clip", "time [s]", "distance [m]", "turn", *fits)
    for number, one in enumerate(found):
        away = one.walk.goal - one.walk.start
        cells = [centimetres(fit.errors[number]) for fit in fits.values()]
        yield from row(
            one.kind, one.name, f"{one.walk.time[-1]:.1f}", f"{np.hypot(*away[:2]):.2f}",
            f"{np.degrees(away[2]):.0f}°", *cells, head=False,
        )  # fmt: skip


def identify(walks: Sequence[RecordedWalk]) -> tuple[IdentifiedObjective, ...]:
    """Different optima of the fit from all starts, the best first; intervals are between walks."""
    found = [identify_objective(walks, start, independent_samples=False) for start in STARTS]
    found.sort(key=lambda one: loss(walks, one))
    different = found[:1]
    for one in found[1:]:
        if loss(walks, one) > 1.001 * loss(walks, different[-1]):
            different.append(one)
    return tuple(different)


def loss(walks: Sequence[RecordedWalk], found: IdentifiedObjective) -> float:
    """Sum of squares of the fit [m^2]."""
    return sum(
        float(np.sum(((path.place_at(np.minimum(w.time, path.duration)) - w.place) * SCALES) ** 2))
        for path, w in zip(found.paths, walks, strict=True)
    )


def left_out(walks: Sequence[RecordedWalk]) -> Explanation:
    """Predictions of every fifth of the walks by weights of the others."""
    objectives: list[WalkObjective] = [PROSE_ORDER] * len(walks)
    for fold in range(FOLDS):
        kept = [walk for number, walk in enumerate(walks) if number % FOLDS != fold]
        objectives[fold::FOLDS] = [identify(kept)[0].objective] * len(walks[fold::FOLDS])
    return joined([explained([walk], one) for walk, one in zip(walks, objectives, strict=True)])


def joined(parts: Sequence[Explanation]) -> Explanation:
    """One of several."""
    return Explanation(
        parts[0].objective,
        tuple(path for part in parts for path in part.paths),
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("errors", "losses", "instant_errors", "heading_errors", "tempo")
        ),
    )


def draw(found: Sequence[Clip], fits: dict[str, Explanation]) -> None:
    """Recorded against predicted paths, each turned so that it begins along x; ticks show the heading."""
    shown = [number for name in SHOWN for number, one in enumerate(found) if one.name == name]
    figure, axes = plt.subplots(3, 4, figsize=(15, 10.5), layout="constrained")
    colours = dict(zip(fits, ("tab:blue", "tab:red", "tab:green"), strict=True))
    for ax, number in zip(axes.flat, shown, strict=True):
        one = found[number]
        lines: list[tuple[str, FloatArray, str, float]] = [
            ("recorded without sway", one.walk.place, "black", 2.5)
        ]
        lines += [(name, fit.paths[number].place, colours[name], 1.5) for name, fit in fits.items()]
        ax.plot(*aligned(one, one.swaying.place)[:, :2].T, color="0.75", lw=1.0, label="recorded")
        for name, places, colour, width in lines:
            line = aligned(one, places)
            ax.plot(*line[:, :2].T, color=colour, lw=width, label=name)
            ticks = line[np.linspace(0, len(line) - 1, 7).astype(int)]
            ax.quiver(
                *ticks[:, :2].T, np.cos(ticks[:, 2]), np.sin(ticks[:, 2]), color=colour, scale=18, width=0.004
            )
        ax.set_title(f"{one.kind}: {one.name}\n{one.walk.time[-1]:.1f} s", fontsize=9)
        ax.set_aspect("equal", adjustable="datalim")
        ax.grid(alpha=0.3)
    axes[-1, 0].set_xlabel("ahead of the start [m]")
    axes[-1, 0].set_ylabel("left of the start [m]")
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=80)


def aligned(one: Clip, places: FloatArray) -> FloatArray:
    """(n, 3) places seen from the start of a walk."""
    x, y, heading = one.walk.start
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    return np.column_stack([(places[:, :2] - [x, y]) @ turn, places[:, 2] - heading])


def centimetres(value: float) -> str:
    """In tables."""
    return f"{100 * value:.1f} cm"


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def order(found: Sequence[Clip], all_walks: IdentifiedObjective, tempi: dict[str, WalkObjective]) -> str:
    """Which of the two orders is nearer."""
    walks = [one.walk for one in found]
    prose, literal, slow_prose, slow_literal = (
        explained(walks, objective) for objective in (PROSE_ORDER, LITERAL_ORDER, *tempi.values())
    )

    better = int(np.sum(prose.errors < literal.errors))
    ratios = [ratio(all_walks, "lateral", second) for second in ("forward", "angular")]
    orders = [
        [one.lateral / getattr(one, second) for one in (PROSE_ORDER, LITERAL_ORDER)]
        for second in ("forward", "angular")
    ]
    holding = [held(low, high, *both) for (_, low, high), both in zip(ratios, orders, strict=True)]
    texts = [f"{value:.2f} (95 %: {low:.2f} to {high:.2f})" for value, low, high in ratios]
    head = ORDER.format(
        forward_ratio=texts[0], forward_held=holding[0],
        angular_ratio=texts[1], angular_held=holding[1],
        wins=better, count=len(walks), p=binomtest(better, len(walks)).pvalue,
    )  # fmt: skip
    turns = np.array([one.turns for one in found])
    lines = [*row("walks", "nearer at equal shares", "at the same instants", "sum of squares")]
    for title, (first, second) in {
        "": (prose, literal), ", at their tempo": (slow_prose, slow_literal),
    }.items():  # fmt: skip
        for name, chosen in (("all", turns | ~turns), ("without turns", ~turns), ("turns", turns)):
            wins = [
                f"{np.sum((getattr(first, key) < getattr(second, key))[chosen])} of {chosen.sum()}"
                for key in ("errors", "instant_errors")
            ]
            share = second.losses[chosen].sum() / first.losses[chosen].sum()
            lines += row(name + title, *wins, f"{share:.2f} times", head=False)
    return head + "\n".join(lines) + "\n\n"


def held(low: float, high: float, prose: float, literal: float) -> str:
    """Which of two ratios an interval holds, in words."""
    names = [
        name for name, value in (("the prose's", prose), ("the literal one", literal)) if low <= value <= high
    ]
    return {0: "neither", 2: "both"}.get(len(names), "".join(names))


def main() -> None:
    """Identify the weights from the recordings of the folder on the command line and write the page."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "clips_locomotion.csv").is_file():
        raise SystemExit("usage: python docs/inverse.py FOLDER; valid: a folder with clips_locomotion.csv")
    found = list(clips(Path(sys.argv[1])))
    walks = [one.walk for one in found]
    optima = identify(walks)
    all_walks = optima[0]
    slow = {
        name: at_their_tempo(walks, objective)
        for name, objective in (("order of the prose", PROSE_ORDER), ("literal order", LITERAL_ORDER))
    }
    tempi = {f"{name}, at their tempo": one for name, (one, _) in slow.items()}
    fits = {
        "order of the prose": explained(walks, PROSE_ORDER),
        "literal order": explained(walks, LITERAL_ORDER),
        "identified": explained(walks, all_walks.objective),
    }
    draw(found, fits)
    resting = sum(
        min(np.hypot(*one.start_velocity[:2]), np.hypot(*one.goal_velocity[:2])) < 0.2 for one in walks
    )
    head = TEXT.format(
        count=len(walks), classes=", ".join(CLASSES), around=AROUND, resting=resting, sway=SWAY, rate=RATE,
        length=HEADING_LENGTH, atd=100 * THESIS_ATD,
    )  # fmt: skip
    tables = ["\n".join(lines) + "\n" for lines in (results(found, optima, tempi), by_clip(found, fits))]
    factors = [factor for _, factor in slow.values()]
    PAGE.write_text(
        head + tables[0] + TEMPO.format(factors=factors) + order(found, all_walks, tempi)
        + "![recorded and predicted paths](images/inverse.png)\n\nTicks show where the body looks.\n" + LIMITS
        + "## By clip\n\nMean distance at equal shares of both durations.\n\n" + tables[1] + THANKS
    )  # fmt: skip


if __name__ == "__main__":
    main()
