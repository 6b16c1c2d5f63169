"""Measure where computed walks are holonomic: writes ``patterns.md`` in a minute."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2_contingency, f_oneway

from manikin.numerics.spatial import FloatArray
from manikin.walking import (
    LITERAL_ORDER,
    PROSE_ORDER,
    RECORDED_TURNS,
    RECORDED_WALKS,
    START,
    PathSegments,
    ShoulderPaths,
    WalkObjective,
    category_goals,
    category_of,
    category_statistics,
    experiment_targets,
    holonomic_ends,
    holonomic_zone,
    segment_path,
    walking_path,
)
from manikin.walking.words import word_paths

PAGE = Path(__file__).with_suffix(".md")
OBJECTIVES = {
    "`prose`": PROSE_ORDER,
    "`literal`": LITERAL_ORDER,
    "`recorded`": RECORDED_WALKS,
    "`recorded-turns`": RECORDED_TURNS,
}
DISTANCES = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0)
RINGS = ((0.0, 0.75), (0.75, 1.25), (1.25, 1.75), (1.75, 2.25), (2.25, 3.25))
FADES = (0.05, 0.2, 0.5, 1.0, 2.0)
FADED_AT = 2.0
LINKED_OBJECTIVES = ("`prose`", "`recorded-turns`")
PATTERNS = ("H-N-H", "H-N", "N-H", "H")
WHOLE = 0.5

TEXT = """# Holonomic, nonholonomic, holonomic

The people of Truong (2010) mostly walk in three parts: a holonomic step towards the goal, a nonholonomic
middle, a holonomic step into the final heading (4.5); goals half a metre aside they reach holonomically
throughout (4.6). Do walks by the criterion (5.6)? Here they are cut by Function 1 from both shoulders, as
[recorded ones](segmentation.md) are, with the thresholds of the thesis. By `docs/patterns.py`.

The thesis predicts paths (Figs. 5.4, 5.5) and segments recorded ones (Fig. 4.19); it segments no predicted
one. Its goals are up to 3.2 m away, and farther ones are future work (5.6).

## By distance

Share of the walks that are H-N-H, to 21 goals at each distance: three directions in front, one aside, three
behind, with the final headings of the nine categories of 4.4 (`category_goals`). From rest to rest. The
weights are options of `manikin walk --weights` and of `walking.weights` in a scenario.

"""
ASIDE = """
Goals {whole} m aside with the heading of the start are reached holonomically throughout under {where}.

## The 106 targets

As in 4.3.3, with headings that are ours, also those of no category. First by distance, then by pattern.

"""
ENDS = """
## Holonomic ends

Goals of the nine categories at 1, 2 and 3 m: means over the walks [m]. The thesis' people have a PLO of about
0.3 m and a PLG from 0.2 m (LCF) to 0.35 m (HCF).

"""
FADE = """
## Why the printed weights have no holonomic end

At rest at the goal a walker comes in along its last acceleration, and from the last places the goal lies
where the walker goes. So near the goal the angle psi of (5.7) *is* the angle between heading and motion, and
the largest weight of (5.8) presses it to zero: the criterion as printed asks for a nonholonomic end, and the
walk arrives in an arc with the heading of the goal. It is only where psi fades (`goal_fade`, ours: the thesis
does not say what psi is at the goal) or weighs less that the last step may go aside. The middle is
nonholonomic where psi weighs enough, or accelerations little. Share of H-N-H at {at:g} m, by the distance at
which psi has faded to one half [m]; {default:g} m is the default everywhere else on this page:

"""
WORDS = """
## Words and parts

The [word](words.md) of the smoothest path to each of the 106 targets, whose walker goes where he looks
(chapter 3), beside the parts of the walk by the criterion (chapter 5). Number of targets:

"""
LINKED = """
Cramér's V tells how far one says the other, from 0, not at all, to 1, wholly; *p* is that of the chi-squared
test, which so few walks of some words make approximate. ANOVA: whether mean lengths of the holonomic ends
differ between words, and between the nine categories. (The thesis' ANOVA of recorded PLO, across subjects and
trials, finds no difference, 4.5.1; computed walks have neither.)

"""
ZONE = """
## The holonomic zone is put in, not predicted

Radius of the zone around the start in which goals 30° to 90° aside with the start's heading are reached
holonomically throughout (4.6, 0.5 m in the thesis), from 0.2 to 1.2 m in steps of 0.1 m, by the distance at
which psi has faded to one half [m]; 0.0 m: not even at 0.2 m.

"""
END = """
## What this says

* Under the weights of the thesis, in either order, H-N-H is rare at any distance: walks are H-N, for the end
  is an arc. Another fade alone does not make it the rule.
* `recorded-turns`, the weights of [recorded people](inverse.md) who turn a corner, make H-N-H the
  most frequent pattern up to 3 m, which is where the thesis' goals are, and that of more than half of the
  goals of the nine categories. They were identified without a look at these patterns, and picked as an
  option for them. Farther away the final turn becomes a part of the walk.
* The order of the parts is that of people, their lengths are not: the first part lasts 0.6 to 2 m where
  people need 0.3 m, and walks ahead into a heading turned away from the way (MCF, HCF) have no nonholonomic
  part or no holonomic end.
* That identification is from 15 walks which pass through their ends, with wide intervals. The weights from
  all 42 walks lie between.
* The word of the smoothest path does not tell the parts of the walk: V is about 0.2, no more than chance in
  so many targets. Lengths of the ends differ between words in one of four tests (5 %), between categories in
  three.
* The radius of the holonomic zone is that at which psi fades: 0 as printed, and about 0.5 m if psi fades at
  0.5 m. The criterion has no such length of its own, so the zone of the thesis' people is an input here.
* The default stays the order of the prose, for its numbers are the thesis'.
"""


def walk(goal: FloatArray, objective: WalkObjective) -> PathSegments:
    """To a goal, cut into segments."""
    path = walking_path(START, goal, objective)
    assert path.succeeded, path.failure
    return segment_path(ShoulderPaths.of_walk(path))


def share(distance: float, objective: WalkObjective) -> str:
    """Of H-N-H among the goals at a distance."""
    return percent([walk(goal, objective).pattern == "H-N-H" for _, goal in category_goals(distance)])


def by_distance() -> Iterator[str]:
    """Table of weights and distances."""
    yield from row("weights", *(f"{distance:g} m" for distance in DISTANCES))
    for name, objective in OBJECTIVES.items():
        yield from row(name, *(share(distance, objective) for distance in DISTANCES), head=False)


def targets() -> Iterator[str]:
    """Table of the 106 targets."""
    goals = experiment_targets()
    away = np.hypot(*goals[:, :2].T)
    rings = [(away >= low) & (away < high) for low, high in RINGS]
    heads = [
        f"{low:g} to {high:g} m ({np.sum(ring)})" for (low, high), ring in zip(RINGS, rings, strict=True)
    ]
    yield from row("weights", *heads, f"all ({len(goals)})", *PATTERNS[1:], "others")
    for name, objective in OBJECTIVES.items():
        found = np.array([walk(goal, objective).pattern for goal in goals])
        counts = [int(np.sum(found == pattern)) for pattern in PATTERNS]
        shares = [percent(found[ring] == "H-N-H") for ring in (*rings, np.ones(len(goals), dtype=bool))]
        yield from row(name, *shares, *counts[1:], len(goals) - sum(counts), head=False)


def ends() -> Iterator[str]:
    """Table of PLO and PLG by category."""
    goals = [one for distance in (1.0, 2.0, 3.0) for one in category_goals(distance)]
    found = {
        name: category_statistics([
            (goal, [ShoulderPaths.of_walk(walking_path(START, goal, objective))]) for _, goal in goals
        ])
        for name, objective in OBJECTIVES.items() if name in ("`prose`", "`recorded-turns`")
    }  # fmt: skip
    yield from row("category", *(f"{name} {of}" for name in found for of in ("PLO", "PLG", "H-N-H")))
    for category in next(iter(found.values())):
        cells = []
        for statistics in found.values():
            one = statistics[category]
            cells += [
                f"{one.from_origin.mean:.2f}",
                f"{one.to_goal.mean:.2f}",
                f"{100 * one.patterned:.0f} %",
            ]
        yield from row(category, *cells, head=False)


def words() -> tuple[Iterator[str], Iterator[str]]:
    """Table of words and patterns, and what links them."""
    goals = experiment_targets()
    spelled = np.array([path.word for path in word_paths(goals)])
    categories = np.array([category_of(goal) or "" for goal in goals])
    walks = {name: [walk(goal, OBJECTIVES[name]) for goal in goals] for name in LINKED_OBJECTIVES}
    patterns = {name: np.array([one.pattern for one in several]) for name, several in walks.items()}
    common = sorted(set(spelled), key=lambda word: (-np.sum(spelled == word), word))

    def counts() -> Iterator[str]:
        heads = [f"{name} {pattern}" for name in walks for pattern in (*PATTERNS, "others")]
        yield from row("word", "targets", *heads)
        for word in common:
            cells = [cell for name in walks for cell in counted(patterns[name][spelled == word])]
            yield from row(word, int(np.sum(spelled == word)), *cells, head=False)

    def links() -> Iterator[str]:
        yield from row(
            "weights", "Cramér's V of word and pattern", "p", "PLO by word: F, p", "PLG by word",
            "PLO by category", "PLG by category",
        )  # fmt: skip
        for name, several in walks.items():
            table = np.array([counted(patterns[name][spelled == word]) for word in common])
            table = table[:, table.sum(axis=0) > 0]
            test = chi2_contingency(table, correction=False)
            strength = np.sqrt(test.statistic / table.sum() / (min(table.shape) - 1))
            ends = [holonomic_ends(one) for one in several]
            lengths = [np.array([one.from_origin for one in ends]), np.array([one.to_goal for one in ends])]
            found = [
                differing(length, groups) for groups in (spelled, categories) for length in lengths
            ]  # fmt: skip
            yield from row(name, f"{strength:.2f}", f"{test.pvalue:.2g}", *found, head=False)

    return counts(), links()


def counted(found: NDArray[np.str_]) -> list[int]:
    """Number of each of the patterns, and of others."""
    counts = [int(np.sum(found == pattern)) for pattern in PATTERNS]
    return [*counts, len(found) - sum(counts)]


def differing(lengths: FloatArray, groups: NDArray[np.str_]) -> str:
    """One-way analysis of variance of lengths by groups of at least two."""
    parts = [lengths[groups == name] for name in sorted(set(groups)) if name]
    test = f_oneway(*(part for part in parts if len(part) > 1))
    return f"{test.statistic:.2f}, {test.pvalue:.2g}"


def fades() -> Iterator[str]:
    """Table of weights and fades."""
    yield from row("weights", *(f"{fade:g} m" for fade in FADES))
    for name, objective in OBJECTIVES.items():
        shares = [share(FADED_AT, replace(objective, goal_fade=fade)) for fade in FADES]
        yield from row(name, *shares, head=False)


def zone() -> Iterator[str]:
    """Table of weights and fades: radius of the zone that is holonomic throughout."""
    goals = [
        (r * np.sin(a), r * np.cos(a), START[2])
        for r in np.arange(0.2, 1.21, 0.1) for a in np.radians((30, 45, 60, 75, 90))
    ]  # fmt: skip
    yield from row("weights", *(f"{fade:g} m" for fade in FADES[:4]))
    for name in LINKED_OBJECTIVES:
        found = []
        for fade in FADES[:4]:
            objective = replace(OBJECTIVES[name], goal_fade=fade)
            found.append(holonomic_zone(goals, [walk(np.array(goal), objective) for goal in goals]).radius)
        yield from row(name, *(f"{radius:.1f} m" for radius in found), head=False)


def aside() -> str:
    """Weights under which goals at the side are reached holonomically throughout."""
    return ", ".join(
        name for name, objective in OBJECTIVES.items()
        if all(walk(np.array([x, 0.0, START[2]]), objective).pattern == "H" for x in (-WHOLE, WHOLE))
    )  # fmt: skip


def percent(which: Sequence[bool] | FloatArray) -> str:
    """Share of those that hold."""
    return f"{100 * float(np.mean(which)):.0f} %"


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def main() -> None:
    """Compute all tables and write the page."""
    tables = (by_distance(), targets(), ends(), fades(), *words(), zone())
    distance, all_targets, both_ends, faded, counts, links, zones = ("\n".join(one) + "\n" for one in tables)
    PAGE.write_text(
        TEXT + distance + ASIDE.format(whole=WHOLE, where=aside()) + all_targets + ENDS + both_ends
        + WORDS + counts + LINKED + links
        + FADE.format(at=FADED_AT, default=PROSE_ORDER.goal_fade) + faded + ZONE + zones + END
    )  # fmt: skip


if __name__ == "__main__":
    main()
