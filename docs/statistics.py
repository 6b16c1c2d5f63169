"""Measure sets of recorded motions as Qiu (2012) did: writes ``statistics.md`` and its figures.

Run ``python docs/statistics.py FOLDER``, where FOLDER has, in ``mocap/cmu_asf_amc``, recordings of the CMU
Graphics Lab.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from manikin.numerics.signals import Spread
from manikin.recordings import (
    GroupStatistics,
    Overhead,
    RecordedClip,
    StatisticsSettings,
    phase_durations,
    published_consistency,
    published_distances,
    published_heights,
    published_phases,
    sequence_consistency,
    statistics_of,
)
from manikin.recordings.statistics.clips import GroupedFile, read_clips
from manikin.recordings.statistics.phases import SHORTEST, by_group, initials
from manikin.reports.figures import (
    LowestPoints,
    com_distances_figure,
    com_heights_figure,
    com_paths_figure,
    phase_durations_figure,
    placements_figure,
    published_lowest,
    save_figure,
)

PAGE = Path(__file__).with_suffix(".md")
IMAGES = PAGE.parent / "images"
CLIPS = {
    "duck": ("127_29", "127_31", "127_32", "127_37", "127_38"),
    "bars": ("01_05_f2000-3120", "01_09_f3900-4242", "01_13_f140-760"),
    "jump": ("127_25", "127_26", "127_28"),
    "walk 02": ("02_01", "02_02"),
    "walk 07": ("07_01", "07_03", "07_11"),
    "walk 08": ("08_04", "08_06", "08_08"),
    "walk 16": ("16_15", "16_21"),
}
BAR = 1.3
"""Height of beam H2 of the thesis, below which all who duck come [m]."""

COMPARED = 4
"""Phases of a sequence: two steps."""

GRAVITY = 9.81
FELT = 0.15
"""Flights that are long enough to measure an acceleration in them after the low-pass [s]."""

TEXT = """# Statistics of recorded motions

Chapter 3 of Qiu (2012) for any set of recordings: how long phases last, in which order supports follow, where
they are, how far the centre of mass is from them, and how low it goes below an obstacle. By
`docs/statistics.py`; the functions are those of `manikin.recordings`, and of the command line:

```bash
manikin statistics "duck=clips/127_3*.amc" walk=clips/08_04.amc --bar 1.3 --origin lowest --out found
manikin statistics --published
```

Each word is a file, a folder or a pattern, with its group before `=`. A file that cannot be used is refused
in one line, and the others are measured (exit status 2). `--out` writes `statistics.json`, `phases.csv` and
the figures; [all keys](json.md#statistics).

## The published motions

The numbers of Tables 3.2, 3.4 and 3.5 come with the package (`published_phases` and its like). Table 3.4
leaves out the last double support. `01_TR_H1C1L_1` begins with the right foot and is not in the means of the
thesis: with the other {quoted} motions in C1 and C2, all figures of its text come out.

"""
AFTER_CLAIMS = """
![Phases of the published motions](images/statistics_published.png)

Durations of whole phases; SD with n - 1, CV = SD / mean:

"""
OURS = """
Table 3.2: {free} motions of three people, {modal} of them `{sequence}`. Of the person in Table 3.4 alone
7 of 8 free motions in C1 and C2.

## Recorded motions

Of the CMU Graphics Lab: *duck*, runs of one person who ducks underneath something; *bars*, one who goes
crouched under bars; *jump*, runs over an obstacle; and level walks of four people. Nothing is known of the
obstacles: the bar of {bar:g} m below is the thesis' H2, not theirs. The recordings begin and end anywhere, so
phases that are cut off do not count, and sequences are compared over {compared} phases from the first whole
double support on.

### Phases

"""
PHASES_SEEN = """
The CV of single supports in walks is {steady} (02, 07, 08, 16), beside {first:.2f} of the thesis' first step;
08 walks at 1.05 m/s in one clip and at 1.7 m/s in two. Double supports vary more, as in the thesis: the 10 to
30 ms by which touch-downs and lift-offs are uncertain are a large part of 100 ms. In ducking, jumping and
under bars the means say little, for landing, squatting and turning have one name.

![Phases of the recorded motions](images/statistics_phases.png)

### Sequences

"""
PLACES = """
From the first whole double support on, {alike} of {walks} walks are one sequence or its mirror image; in
the other one, at 1.7 m/s, a double support is shorter than {shortest:g} s. The first step is not that of a
start, for the recordings begin in motion: the thesis' share of first feet has no counterpart here.

### Places of the supports

From where the centre of mass was lowest, x along its way; motions whose first step behind it is made by the
right foot are seen in a mirror. Half axes of the ellipse of half of the places. 0 is the last support before
the lowest point, 1 the first behind it.

"""
PLACES_SEEN = """
A runner who ducks has supports spread several times as far along the way as across, and far more than the
thesis' "small dispersion": its person began at given places and always passed the same beam.

![Places of the supports](images/statistics_placements.png)

### Distance from the centre of mass to the supports

Table 3.5: the largest one of each motion. The place of a support is the middle of the sole.

"""
DISTANCES_SEEN = """
Passages under the bars keep to the 1.08 m of Table 7.5; walks go beyond by up to {walk_beyond:.0f} mm for a
hundredth of the time, runs and jumps by up to {beyond:.0f} mm: they leave the ground with the toes, the
centre of mass far ahead of a foot whose middle is counted. The people differ in stature, the limit does
not.

![Distances](images/statistics_distances.png)

### Lowest centre of mass

Heights are above the lowest surface found, *head* and *trunk* those of their lowest tops; *standing* is the
centre of mass of the person's body model.

"""
UNDER = """
Under a bar of {bar:g} m: *below* is from the lowest centre of mass to the bar (Fig. 3.14), *room* from the
higher of the lowest tops of head and trunk, an upper bound, as nobody knows where the bar would have been.

"""
HEIGHTS_SEEN = """
The thesis' person left 0.50 m from the centre of mass to this beam. Here more is left, for what they passed
was lower. `01_05` is described as going under bars twice: both are found, and the crouch in between, which
does not move on, is not counted.

![Lowest centre of mass](images/statistics_heights.png)

![Ways of the centre of mass](images/statistics_paths.png)

## What is weak

"""
WEAK = """
* Short flights may be none. In a true flight the centre of mass accelerates at -{gravity:g} m/s²; parabolas
  through the inner halves of flights of {felt:g} s and more have

"""
WEAK_END = """
  The jumps fall as they should.
* A person who moves on while low for another reason, such as landing from a jump, is taken to pass a bar: its
  place is not known. A box has one.
* Two touch-downs within {shortest:g} s make a phase that no one saw; it counts in durations and not in
  sequences.
* The lengths of the trunk come from the most upright frames of all clips of a skeleton; the top of the head
  is a capsule's.

## Acknowledgements

The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding from
NSF EIA-0196217.
"""
CLAIMS = (
    ("SS-1, all", "SS-1", ("H1C1", "H2C1", "H3C1", "H2C2"), 0.5),
    ("DS-2, all", "DS-2", ("H1C1", "H2C1", "H3C1", "H2C2"), 0.1),
    ("DS-3, C1 with H1 and H2", "DS-3", ("H1C1", "H2C1"), 0.23),
    ("DS-3, C1 with H3", "DS-3", ("H3C1",), 0.58),
    ("DS-3, C2", "DS-3", ("H2C2",), 0.55),
    ("SS-3, C1", "SS-3", ("H1C1", "H2C1", "H3C1"), 0.52),
    ("SS-3, C2", "SS-3", ("H2C2",), 0.98),
)
"""Means that the text of the thesis quotes, "about" [s]."""


def claims() -> Iterator[str]:
    """Table of what the thesis quotes and what its table gives."""
    groups = by_group(published_phases("left_foot"))
    yield from row("phase", "quoted [s]", "from Table 3.4 [s]", "SD [s]", "CV", "least to largest [s]", "n")
    for name, phase, configurations, quoted in CLAIMS:
        motions = [one for group in configurations for one in groups[group]]
        spread = phase_durations(motions)[phase]
        yield from row(name, quoted, *of_spread(spread), head=False)


def published_table() -> Iterator[str]:
    """Means of every phase and configuration."""
    yield from row("configuration", "phase", "mean [s]", "SD [s]", "CV", "least to largest [s]", "n")
    for group, motions in by_group(published_phases("left_foot")).items():
        for name, spread in phase_durations(motions).items():
            yield from row(group, name, *of_spread(spread), head=False)


def durations(found: Mapping[str, GroupStatistics]) -> Iterator[str]:
    """Table of the kinds of phases."""
    yield from row("group", "phase", "mean [s]", "SD [s]", "CV", "least to largest [s]", "n")
    for group, one in found.items():
        for name, spread in one.durations["kind"].items():
            yield from row(group, name, *of_spread(spread), head=False)


def sequences(found: Mapping[str, GroupStatistics]) -> Iterator[str]:
    """Table of the sequences."""
    yield from row("group", "motions", "most frequent", "its share", "with mirror images", "first steps")
    for group, one in found.items():
        known = one.consistency
        steps = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in known.first_steps.items())
        shares = percent(known.modal_share), percent(known.mirrored_share)
        yield from row(group, known.motions, f"`{initials(known.modal)}`", *shares, steps, head=False)


def placements(found: Mapping[str, GroupStatistics], groups: Sequence[str]) -> Iterator[str]:
    """Table of the supports that are known of three motions or more."""
    yield from row("group", "support", "n", "mean x, y [m]", "half axes [m]")
    for group in groups:
        for one in found[group].placements:
            if len(one.places) >= 3:
                halves, _ = one.ellipse()
                name = f"{one.effector.replace('_', ' ')} {one.number}"
                mean = f"{one.mean[0]:.2f}, {one.mean[1]:.2f}"
                axes = f"{halves[0]:.2f}, {halves[1]:.2f}"
                yield from row(group, name, len(one.places), mean, axes, head=False)


def distances(found: Mapping[str, GroupStatistics], limit: float) -> Iterator[str]:
    """Table 3.5 of each group."""
    yield from row(
        "group", "foot", "mean [m]", "SD [m]", "least to largest [m]", "n", f"instants within {limit:g} m"
    )
    for foot, spread in published_distances().items():
        yield from row("published", foot.replace("_", " "), *without_variation(spread), "-", head=False)
    for group, one in found.items():
        for foot, spread in one.distances.items():
            cells = (*without_variation(spread), percent(one.within[foot]))
            yield from row(group, foot.replace("_", " "), *cells, head=False)


def heights(clips: Sequence[RecordedClip], found: Mapping[str, GroupStatistics]) -> Iterator[str]:
    """Table of the lowest points."""
    yield from row(
        "group", "clip", "standing [m]", "lowest [m]", "at [s]", "highest [m]", "head [m]", "trunk [m]"
    )
    for clip in clips:
        low = found[clip.group].whole[clip.name]
        values = (f"{value:.2f}" for value in (
            clip.standing_com or np.nan, low.com_lowest, low.com_lowest_at, low.com_highest,
            *low.tops.values(),
        ))  # fmt: skip
        yield from row(clip.group, clip.name, *values, head=False)


def passages_table(found: Mapping[str, GroupStatistics]) -> Iterator[str]:
    """Table of the passages under the bar."""
    yield from row("group", "clip", "from to [s]", "centre of mass [m]", "below [m]", "room [m]")
    for group, one in found.items():
        for name, under in one.under:
            values = (f"{value or np.nan:.2f}" for value in (under.com_lowest, under.below, under.room))
            yield from row(group, name, f"{under.start:.2f} to {under.end:.2f}", *values, head=False)


def flights(clips: Sequence[RecordedClip]) -> Iterator[str]:
    """Table of the accelerations in flights, indented as part of a list."""
    lines = [*row("group", "clip", "flight [s]", "lasts [s]", "acceleration upward [m/s²]")]
    for clip in clips:
        for phase, whole in zip(clip.phases.phases, clip.phases.whole, strict=True):
            if not phase.effectors and whole and phase.duration >= FELT:
                middle = 0.5 * (phase.start + phase.end)
                within = np.abs(clip.time - middle) <= 0.25 * phase.duration
                upward = 2.0 * np.polyfit(clip.time[within] - middle, clip.com[within, 2], 2)[0]
                values = f"{phase.start:.2f}", f"{phase.duration:.2f}", f"{upward:.1f}"
                lines += row(clip.group, clip.name, *values, head=False)
    return (f"  {line}" for line in lines)


def of_spread(spread: Spread) -> tuple[str, ...]:
    """Mean, deviation, variation, range and count."""
    mean, deviation, ends, count = without_variation(spread)
    return mean, deviation, "-" if np.isnan(spread.variation) else f"{spread.variation:.2f}", ends, count


def without_variation(spread: Spread) -> tuple[str, str, str, str]:
    """Mean, deviation, range and count."""
    deviation = "-" if np.isnan(spread.deviation) else f"{spread.deviation:.3f}"
    ends = f"{spread.smallest:.3f} to {spread.largest:.3f}"
    return f"{spread.mean:.3f}", deviation, ends, str(spread.count)


def percent(share: float) -> str:
    """In tables."""
    return f"{100 * share:.0f} %"


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def read(folder: Path) -> tuple[RecordedClip, ...]:
    """All clips of the groups."""
    files = [
        GroupedFile(folder / "mocap" / "cmu_asf_amc" / f"{name}.amc", group)
        for group, names in CLIPS.items()
        for name in names
    ]
    found = read_clips(files)
    for reason in found.refused.values():
        raise SystemExit(reason)
    return found.clips


def draw(
    clips: Sequence[RecordedClip], found: Mapping[str, GroupStatistics], settings: StatisticsSettings
) -> Iterator[tuple[str, Figure]]:
    """Figures of the page, by the end of their names."""
    low = [clip for clip in clips if clip.group in ("duck", "bars")]
    names = {clip.group for clip in low}
    yield "published", phase_durations_figure([
        one for one in published_phases("left_foot") if not one.group.endswith("C3")
    ])  # fmt: skip
    yield "phases", phase_durations_figure([clip.phases for clip in clips], "kind")
    yield "placements", placements_figure({name: found[name].placements for name in ("duck", "bars")})
    yield "paths", com_paths_figure(low, [settings.origin_of(clip) for clip in low], overhead=BAR)
    lowest = [LowestPoints.of(found[name], BAR) for name in CLIPS if name in names]
    yield "heights", com_heights_figure([*published_lowest(), *lowest], published_heights().standing)
    shown = [clip for clip in clips if clip.group in ("duck", "bars", "walk 08")]
    yield "distances", com_distances_figure(shown, limit=settings.limit, published=published_distances())


def main() -> None:
    """Measure the recordings of the folder on the command line, write the page and its figures."""
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "mocap" / "cmu_asf_amc").is_dir():
        raise SystemExit("usage: python docs/statistics.py FOLDER; valid: a folder with mocap/cmu_asf_amc")
    clips = read(Path(sys.argv[1]))
    settings = StatisticsSettings(Overhead(BAR), phases=COMPARED, start="DS", origin="lowest")
    found = statistics_of(clips, settings)
    for name, figure in draw(clips, found, settings):
        save_figure(figure, IMAGES / f"statistics_{name}.png")
    known = published_consistency()
    low = {name: found[name] for name in ("duck", "bars")}
    walks = [clip for clip in clips if clip.group.startswith("walk")]
    order = sequence_consistency([clip.phases for clip in walks], phases=COMPARED, start="DS")
    steps = [one.durations["kind"]["SS"].variation for name, one in found.items() if name.startswith("walk")]
    quoted = [one for one in published_phases("left_foot") if not one.group.endswith("C3")]
    farthest = {
        walking: max(
            spread.largest
            for group, one in found.items()
            if group.startswith("walk") == walking
            for spread in one.distances.values()
        )
        for walking in (True, False)
    }
    numbers = {
        "quoted": len(quoted), "first": phase_durations(quoted)["SS-1"].variation,
        "steady": ", ".join(f"{one:.2f}" for one in steps), "walks": order.motions,
        "alike": round(order.mirrored_share * order.motions),
        "walk_beyond": 1e3 * (farthest[True] - settings.limit),
        "beyond": 1e3 * (farthest[False] - settings.limit),
        "free": known.motions, "modal": known.counts[known.modal], "sequence": initials(known.modal),
        "bar": BAR, "compared": COMPARED, "gravity": GRAVITY, "felt": FELT, "shortest": SHORTEST,
    }  # fmt: skip
    parts = [
        TEXT, claims(), AFTER_CLAIMS, published_table(), OURS, durations(found), PHASES_SEEN,
        sequences(found), PLACES, placements(found, list(low)), PLACES_SEEN,
        distances(found, settings.limit), DISTANCES_SEEN, heights(clips, found), UNDER,
        passages_table(low), HEIGHTS_SEEN, WEAK, flights(clips), WEAK_END,
    ]  # fmt: skip
    PAGE.write_text(
        "".join(part.format(**numbers) if isinstance(part, str) else "\n".join(part) + "\n" for part in parts)
    )


if __name__ == "__main__":
    main()
