"""Write ``docs/words.md`` and its figures.

``python docs/words.py DIR`` reads the partition that ``manikin words --out DIR`` left, and computes what else
the page tells: checks on random goals, categories and the holonomic zone; some two minutes.
"""

import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from clothoid_words import clothoid_words

from manikin.numerics.spatial import FloatArray
from manikin.reports.directories import WordsDirectory, partition_as_dict
from manikin.reports.figures import equal_paths_figure, holonomic_zone_figure, save_figure, words_figure
from manikin.walking import (
    LITERAL_ORDER,
    PROSE_ORDER,
    START,
    CategoryStatistics,
    HolonomicZone,
    ShoulderPaths,
    category_statistics,
    experiment_targets,
    holonomic_zone,
    segment_path,
    walking_path,
)
from manikin.walking.words import HEADINGS, THESIS_GRID, THESIS_WORDS, EqualPaths, WordSlice, equal_paths
from manikin.walking.words.word_solver import cheapest, guesses

DOCS = Path(__file__).parent
PAGE = DOCS / "words.md"
IMAGES = DOCS / "images"
SHOWN = (340, 150)
ORDERS = {"prose order of the weights": PROSE_ORDER, "literal order": LITERAL_ORDER}
CHECKED, RANDOM, CLOTHOIDS = 400, 60, 150

TEXT = """# Words of walking

Which paths a walker takes who goes where he looks and changes the curvature of his way as little as he can
(Truong 2010, 3.3), and how many arcs of increasing (I) or decreasing (D) curvature they have. By
`docs/words.py` from

```bash
manikin words --out DIR
```

which goes on where it was interrupted. `--slices 340,150` takes some final headings only, `--json` prints
[counts and shares](json.md#words), `--jobs N` sets the number of processes.

## What is minimised

The integral of 1 + u² along the path, with u = dκ/ds in 1/m², free length, and no curvature at both ends:
the squared norm of both controls of the system (3.2) with the speed 1. [Why not the derivative of the
curvature alone](api/walking.md), or its largest value (`docs/clothoid_words.py`): neither has an optimum,
because loops may be as large as one likes. Of {clothoids} random goals of the grid, {extremal} have a word
of three exact clothoid arcs, IDI or DID, that satisfies the maximum principle; large loops improve all. The
price of the length makes the problem one with an optimum, and brings the longer words. Its arcs are monotone
in the curvature, but no exact clothoids.

Headings may end up to one whole turn to either side. Each goal is solved by Newton's method from {guesses}
guesses for each turn, then from the paths of its neighbours, until none gets cheaper.

## Words on the grid

{places} places, 0.2 m apart, and {slices} final headings: {problems} goals.

"""
AFTER_WORDS = """
Together the six words of the thesis have {six}. None has more than five arcs. ID and DI, which the thesis
does not list, lie in thin cells where the turn is nearly symmetric and the first or the last arc of a
longer word vanishes; *straight* are the goals straight ahead. The problem is symmetric: mirrored goals have
mirrored words. Goals on the axis of symmetry have two mirrored best paths and are counted once.

Farther away more arcs appear (six from 12 m on): the ends of long paths swing about the straight way between
them, less and less.

Independent check: the system integrated in 3000 steps under u ends within {position:.0e} m of each goal; u
differs from the adjoint of the maximum principle by at most {adjoint:.0e} of its largest value, and the
Hamiltonian from zero by {hamiltonian:.0e}. On {checked} random goals, {random} further random guesses for
each turn found {better} cheaper path.

![Cells of one word for final headings of 340° and 150°, and a path to each](images/words.png)

## Two best paths

Cells either grow into each other, where an arc vanishes, or meet at a border (black above) at which two
ways to go cost the same. Such a goal is found by bisection between two neighbours, bending the paths of
both to it:

{pairs}
![Two best paths to one goal, and their curvatures](images/equal_paths.png)

## Holonomic ends by category

The paths of [chapter 5](api/walking.md) to 106 goals like those of the experiment, by the nine
categories of 4.4, cut by Function 1 from both shoulders. PLO and PLG are the ways before the first and
after the last nonholonomic part [m], H-N-H the share of walks with just these three parts; ATD and MTD tell
how far the paths by both orders of the weights lie apart [m]. Goals with other headings have no category.

"""
AFTER_ENDS = """
In the thesis' recordings PLO is about 0.3 m and PLG 0.2 to 0.35 m in every category, ATD below 0.14 m and
MTD below 0.23 m (between people). The computed paths go aside for longer to goals whose heading is that of
the start, and by the shoulders they have next to no holonomic end: while the body turns into the final
heading, its outer shoulder goes ahead.

## The holonomic zone

Goals around the start with the start's heading, from 0.2 to 1.6 m, every 15° from ahead to the side.

{zones}
![Goals that are reached holonomically from start to goal](images/holonomic_zone.png)

The thesis proposes a zone of 0.5 m, spares the goals straight ahead, as we do up to 22.5°, and does not
consider those behind. With turns of 45° to either side, paths to goals 0.2 m away already have a
nonholonomic part.
"""


def read(folder: Path) -> dict[int, WordSlice]:
    """All slices of a directory."""
    slices = WordsDirectory(folder, THESIS_GRID).slices
    if missing := [heading for heading in HEADINGS if heading not in slices]:
        raise SystemExit(
            f"{folder} lacks the slice of {missing[0]} deg; valid: as left by manikin words --out"
        )
    return slices


def random_goals(count: int, seed: int) -> FloatArray:
    """Goals of the grid."""
    rng = np.random.default_rng(seed)
    x, y = rng.choice(THESIS_GRID.columns, count), rng.choice(THESIS_GRID.rows, count)
    return np.column_stack([x, y, np.radians(rng.choice(HEADINGS, count))])


def cheaper(count: int, guessed: int) -> int:
    """Goals for which random guesses find a cheaper path."""
    rng, goals = np.random.default_rng(1), random_goals(count, 2)
    random = [tuple(rng.normal(size=5) * [2.0, 1.5, 1.0, 0.5, 0.3]) for _ in range(guessed)]
    start = np.array(START)
    used, other = (cheapest(start, goals, these)[1].cost for these in (guesses(), random))
    return int(np.sum(other < used * (1.0 - 1e-8)))


def extremal(count: int) -> int:
    """Goals with a word of three clothoid arcs that satisfies the maximum principle."""
    return sum(any(one.extremal for one in clothoid_words(goal)) for goal in random_goals(count, 3))


def borders(slices: Mapping[int, WordSlice]) -> list[EqualPaths]:
    """One pair of each slice that is shown."""
    return [
        equal_paths(*(slices[heading].path(*place) for place in slices[heading].jumps()[0]))
        for heading in SHOWN
    ]


def word_table(counts: Mapping[str, int], slices: Mapping[int, WordSlice]) -> Iterator[str]:
    """Counts and shares, and in how many slices a word occurs."""
    total = sum(counts.values())
    found = Counter(word for one in slices.values() for word in set(one.words.ravel().tolist()))
    yield from row("word", "goals", "share", "slices")
    for word, count in counts.items():
        yield from row(word, count, f"{100 * count / total:.2f} %", found[word], head=False)


def pair_table(pairs: list[EqualPaths]) -> Iterator[str]:
    """Goals with two best paths."""
    yield from row(
        "goal", "words", "lengths [m]", "cost [m]", "difference of the costs", "largest distance [m]"
    )
    for pair in pairs:
        x, y, heading = pair.first.goal
        goal = f"({x:.4f}, {y:.4f}) m, {np.degrees(heading) % 360:.0f}°"
        both = (pair.first, pair.second)
        yield from row(
            goal, ", ".join(one.word for one in both), ", ".join(f"{one.length:.2f}" for one in both),
            f"{pair.first.cost:.4f}", f"{pair.gap:.0e}", f"{pair.apart:.2f}", head=False,
        )  # fmt: skip


def statistics() -> tuple[dict[str, CategoryStatistics], dict[str, CategoryStatistics]]:
    """Of paths to the goals of the experiment: those of the prose order, and of both orders together."""
    goals = experiment_targets()
    walks = {
        name: [ShoulderPaths.of_walk(walking_path(START, goal, order)) for goal in goals]
        for name, order in ORDERS.items()
    }
    first, second = walks.values()
    alone = category_statistics([(goal, [walk]) for goal, walk in zip(goals, first, strict=True)])
    return alone, category_statistics(list(zip(goals, zip(first, second, strict=True), strict=True)))


def category_table(
    alone: Mapping[str, CategoryStatistics], both: Mapping[str, CategoryStatistics]
) -> Iterator[str]:
    """PLO, PLG with AD and MD, pattern, ATD and MTD."""
    yield from row("category", "goals", "PLO (AD, MD)", "PLG (AD, MD)", "H-N-H", "holonomic", "ATD", "MTD")
    for name, one in alone.items():
        ends = [
            f"{end.mean:.2f} ({end.average_deviation:.2f}, {end.largest_deviation:.2f})"
            for end in (one.from_origin, one.to_goal)
        ]
        shares = [f"{100 * share:.0f} %" for share in (one.patterned, one.holonomic)]
        spread = [f"{value:.2f}" for value in (both[name].average_deviation, both[name].largest_deviation)]
        yield from row(name, one.goals, *ends, *shares, *spread, head=False)


def zones() -> dict[str, HolonomicZone]:
    """By the orders of the weights."""
    goals = [
        (side * r * np.sin(a), r * np.cos(a), START[2])
        for r in np.arange(0.2, 1.61, 0.1) for a in np.radians(np.arange(0, 91, 15)) for side in (1, -1)
    ]  # fmt: skip
    return {
        name: holonomic_zone(
            goals, [segment_path(ShoulderPaths.of_walk(walking_path(START, goal, order))) for goal in goals]
        )
        for name, order in ORDERS.items()
    }


def zone_table(found: Mapping[str, HolonomicZone]) -> Iterator[str]:
    """Radii by direction."""
    degrees = (30, 45, 60, 75, 90)
    yield from row("", "radius [m]", *(f"{angle}° aside" for angle in degrees))
    for name, zone in found.items():
        towards = [zone.radius_towards(*np.radians([angle - 1, angle + 1])) for angle in degrees]
        yield from row(name, *(f"{radius:.1f}" for radius in (zone.radius, *towards)), head=False)


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def lines(rows: Iterator[str]) -> str:
    """Of a table."""
    return "\n".join(rows) + "\n"


def main() -> None:
    """Write the page from the directory on the command line."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "words.json").is_file():
        raise SystemExit("usage: python docs/words.py DIR; valid: as left by manikin words --out DIR")
    slices = read(Path(sys.argv[1]))
    summary = partition_as_dict(THESIS_GRID, HEADINGS, slices)
    counts, worst = summary["counts"], summary["max_residuals"]
    pairs, found = borders(slices), zones()
    save_figure(words_figure([slices[heading] for heading in SHOWN]), IMAGES / "words.png")
    save_figure(equal_paths_figure(pairs), IMAGES / "equal_paths.png")
    save_figure(holonomic_zone_figure(found), IMAGES / "holonomic_zone.png")
    before = TEXT.format(
        clothoids=CLOTHOIDS, extremal=extremal(CLOTHOIDS), guesses=len(guesses()), slices=len(HEADINGS),
        places=summary["problems"] // len(HEADINGS), problems=summary["problems"],
    )  # fmt: skip
    after = AFTER_WORDS.format(
        six=f"{100 * sum(summary['shares'][word] for word in THESIS_WORDS):.2f} %",
        position=worst["position_m"], adjoint=worst["adjoint"], hamiltonian=worst["hamiltonian"],
        checked=CHECKED, random=RANDOM, better=cheaper(CHECKED, RANDOM) or "no",
        pairs=lines(pair_table(pairs)),
    )  # fmt: skip
    ends = AFTER_ENDS.format(zones=lines(zone_table(found)))
    PAGE.write_text(
        before + lines(word_table(counts, slices)) + after + lines(category_table(*statistics())) + ends
    )


if __name__ == "__main__":
    main()
