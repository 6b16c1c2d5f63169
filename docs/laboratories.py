"""Every trial at hand read, reconstructed and compared with plates, or why not: writes ``laboratories.md``.

Run ``python docs/laboratories.py RESULTS TRIALS CODE``: RESULTS is the folder that
``python benchmarks/survey_laboratories.py FOLDER RESULTS`` filled, TRIALS the table of the trials (``file``,
``lab/source repo``, ``licence``), CODE which code it was and when.
"""

import csv
import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

PAGE = Path(__file__).with_suffix(".md")

Trial = Mapping[str, Any]

BARS = {"timing_median_s": 0.020, "vertical_rms_body_weight": 0.06, "cop_rms_m": 0.035}
"""Bars of trials with clean plates: median of the events [s], vertical force [body weight], CoP [m]."""

GAITS = ("walking", "carrying", "running", "jumping", "stairs up", "stairs down")
"""Activities that the bars are for."""

TOLD = (
    "plates carry", "no instant", "does not fit", "treadmill", "exchanged", "nothing supports",
    "frames per second", "is not read", "are not read", "tables", "those of adults", "missing",
)  # fmt: skip
"""Words of the remarks that are shown with a trial."""

TEXT = """# Recordings of other laboratories

Every C3D and TRC file at hand, as its laboratory delivered it, measured by `manikin analyze` without a map of
its markers or any other help. {code}

* *Read*: the file is read. *Reconstructed*, or followed: our human follows it. *Compared*: with force plates.
* *Residual*: median distance of a marker from its place on the body.
* *Events*: median of the absolute errors of touch-downs and lift-offs against the plates, and their number.
* *Vertical*: root mean square error of the vertical force of the motion, as recorded, in frames whose
  supports are all on plates. *CoP*: the same of the centre of pressure in single support; *shifted*: of the
  shifted motion.
* Three of the trials are copies in other formats: `TYPE-2a` and `TYPE-4a` of `newwalk`, and `type1` of
  `dynamic` in `sample_28`.
* *Activity*: [what the person does](analysis.md#what-a-recording-is).

"""

OFF = """## What is off

* **Runs**: vertical forces are 10 to 32 % of the weight off, and centres of pressure 4 to 15 cm as
  recorded. The low-pass of the postures (5 Hz) does not follow a force that rises and falls within 0.1 to
  0.3 s; with 8 Hz and more the wobble of the markers at the impact is larger than what is gained. Events are
  not concerned but on one treadmill: 9 to 22 ms.
* **Treadmills**: touch-downs in `subject01_walk1` are some 70 ms late and lift-offs 100 ms early, for its
  feet take 0.15 s to reach the speed of the belt; in `run200` lift-offs are 50 to 70 ms off either way, and
  the belt is found 5 % faster than the name of the file says.
* **Events late as a whole**: `Walk1` (25 to 44 ms at touch-downs and lift-offs alike) and `QCMAS` (39 to
  50 ms at touch-downs, 8 to 26 ms at lift-offs). Not explained.
* **Activities**: the ramp of `Dynamic33` is called stairs, the crouch of the sprint start of `SprintMotion`
  lying, the 1.2 s of `walk_free_01` with one step standing. Who carries a load in one hand is said to walk.
* **Without a pelvis**: the files that are read and not reconstructed have no marker that is known as ASIS.

"""
"""What is wrong in the trials, by hand: to be looked at again when they are measured anew."""

THANKS = """
## Sources

Numbers above are computed from the recordings of these sources; no file of theirs is part of manikin.

"""


def main() -> None:
    """Command line."""
    if len(sys.argv) != 4 or not Path(sys.argv[1]).is_dir():
        raise SystemExit("usage: python docs/laboratories.py RESULTS TRIALS CODE")
    trials = [json.loads(path.read_text()) for path in sorted(Path(sys.argv[1]).glob("*.json"))]
    PAGE.write_text(page(trials, sources(Path(sys.argv[2])), sys.argv[3]))


def sources(table: Path) -> dict[str, tuple[str, str]]:
    """Whose recordings they are, and their terms, by folder."""
    found: dict[str, tuple[str, str]] = {
        "grf/btkdata": ("BTKData, Biomechanical ToolKit", "BSD-3-Clause"),
        "grf/opensim_core": ("OpenSim", "Apache-2.0"),
        "grf/nimble_opencap_s4": ("test copies in nimblephysics of OpenCap's data", "for checks only"),
        "grf/nimble_camargo_circle": ("test copies in nimblephysics of Camargo et al.", "for checks only"),
    }
    with table.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            folder = "laboratories/" + row["file"].rpartition("/")[0]
            origin = row["lab/source repo"].partition(";")
            found.setdefault(folder, (origin[0].strip(), row["licence"].partition("[")[0].strip()))
    return found


def page(trials: list[Trial], known: Mapping[str, tuple[str, str]], code: str) -> str:
    """The whole page."""
    parts = [TEXT.format(code=code), summary(trials), beyond(trials), feet(trials), ALONE, by_source(trials)]
    parts += [OFF, every(trials), THANKS]
    used = sorted({folder_of(one) for one in trials})
    lines = ["| folder | source | terms |", "|---|---|---|"]
    lines += [row(folder, *known.get(folder, ("", ""))) for folder in used]
    return "".join(parts) + "\n".join(lines) + "\n"


def folder_of(trial: Trial) -> str:
    """Folder of a trial, which stands for its source."""
    return str(trial["trial"]).rpartition("/")[0]


def plates_of(trial: Trial) -> Mapping[str, Any]:
    """Errors against plates; none without."""
    return trial.get("force_plates") or {}


def summary(trials: list[Trial]) -> str:
    """Counts, and how many trials keep each bar."""
    count = defaultdict(int)
    for one in trials:
        count[one["stage"]] += 1
    faults = sum(one["reason"].startswith("FAULT") for one in trials)
    refused, read = count["refused"], count["read"]
    told = (
        f"Of {len(trials)} trials {len(trials) - refused} are read, "
        f"{count['reconstructed'] + count['compared']} reconstructed and {count['compared']} compared with "
        f"plates; {refused} cannot be read, {read} are read and not reconstructed, for the reasons below. "
        f"{faults} ended in a fault or took too long.\n\n"
    )
    gaits = [one for one in trials if one.get("activity") in GAITS]
    lines = [
        "| walks, runs, jumps, stairs with plates | median | 90 % | trials | within the bar |",
        "|---|---|---|---|---|",
    ]
    names = {
        "timing_median_s": ("events", 1e3, "ms"), "vertical_rms_body_weight": ("vertical", 1e2, "% BW"),
        "cop_rms_m": ("CoP", 1e3, "mm"), "cop_rms_shifted_m": ("CoP, shifted", 1e3, "mm"),
    }  # fmt: skip
    for key, (name, factor, unit) in names.items():
        values = np.array(values_of(gaits, key))
        if len(values):
            bar = BARS.get(key, BARS["cop_rms_m"])
            kept = f"{np.sum(values <= bar)} of {len(values)} ({factor * bar:g} {unit})"
            shown = (f"{factor * np.quantile(values, share):.1f} {unit}" for share in (0.5, 0.9))
            lines.append(row(name, *shown, str(len(values)), kept))
    return told + "\n".join(lines) + "\n\n"


PUBLISHED = {"up": (0.992, 5.3), "ahead": (0.965, 9.4), "aside": (0.862, 13.1), "free_moment": (0.826, None)}
"""Correlation and relative error in percent of forces from inertial sensors (Karatsidis 2017)."""

REASONS = (
    ("a run or jump", lambda one: one["activity"] in ("running", "jumping")),
    ("a treadmill", lambda one: has_remark(one, "treadmill")),
    ("plates that carry another mass than the file tells", lambda one: has_remark(one, "plates carry")),
    ("a child, with the shares of mass of adults", lambda one: has_remark(one, "those of adults")),
    ("no markers on the trunk", lambda one: has_remark(one, "not recorded", "thorax")),
    ("no markers on the arms", lambda one: has_remark(one, "not recorded", "upper arm")),
    ("60 frames per second or less", lambda one: one["rate_hz"] <= 60.0),
)
"""What is known of a trial that is beyond a bar, the first that holds."""


ALONE = """## Laboratories that were left out

Two numbers that find the events were chosen with plates of others: the shares of a swing's highest
speed below which a foot has touched down, and above which it has lifted off. Chosen on the walks of all other
laboratories each time (`benchmarks/leave_one_laboratory_out.py`), they are 10 and 20 % whichever is left out.
In 40 walks over the ground of 21 laboratories the errors of 185 events are 10 ms (median) and 30 ms (90 %);
in 35 walks the median is at most 20 ms. 4 events that are more than 0.25 s off, or that some shares do not
find, are not among them, and no copies of a walk in another format. What smooths the motion and shares the
force between two feet is the same for all files. It was chosen with these plates, on all of them.

"""
"""Measured by hand on 30 November 2026: to be run again when supports change."""


def has_remark(trial: Trial, *words: str) -> bool:
    """Whether a remark has all of some words."""
    return any(all(word in remark for word in words) for remark in trial["remarks"])


def beyond(trials: list[Trial]) -> str:
    """How many trials are beyond each bar, by what is known of them."""
    count: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for one in trials:
        for key, bar in BARS.items() if one.get("activity") in GAITS else ():
            value = plates_of(one).get(key)
            if value is not None and value > bar:
                count[next((name for name, holds in REASONS if holds(one)), "none of these")][key] += 1
    lines = [
        "Beyond a bar, by the first of these that is true of a trial:\n",
        "| | events | vertical | CoP |", "|---|---|---|---|",
    ]  # fmt: skip
    for name in (*(name for name, _ in REASONS), "none of these"):
        lines.append(row(name, *(str(count[name][key]) for key in BARS)))
    return "\n".join(lines) + "\n\n"


FEET = """## The force of a foot

Walks over the ground, in the frames in which a foot is found to stand and is alone on its plate; aside and
the free moment are positive outwards. Root mean square of the difference per body weight (of the free moment
about the centre of pressure: per body weight and metre), over the mean of both ranges, and correlation;
medians over the {count} trials whose shifted motion is believed, with the 10th or 90th percentile on the bad
side. In double support the shares of the feet are not measured but assumed. Published, from inertial sensors
at a comfortable speed: [Karatsidis 2017](references.md#methods); its relative error of the free moment is not
at hand.

| component | as recorded: RMS | relative | r | shifted: RMS | relative | r | published: relative | r |
|---|---|---|---|---|---|---|---|---|
"""


def feet(trials: list[Trial]) -> str:
    """Errors of the force of one foot, beside published ones."""
    walks = [
        one for one in trials
        if one.get("activity") == "walking" and plates_of(one).get("foot_forces_shifted")
        and not any("treadmill" in remark for remark in one["remarks"])
    ]  # fmt: skip
    lines = []
    for component, (r, relative) in PUBLISHED.items():
        cells = []
        for key in ("foot_forces", "foot_forces_shifted"):
            known = [found for one in walks if (found := plates_of(one)[key].get(component))]
            for name, share in (("rms", 0.9), ("rrmse", 0.9), ("r", 0.1)):
                values = [one[name] for one in known if one[name] is not None]
                factor, unit = (1.0, "") if name == "r" else (100.0, " %")
                digits = 2 if name == "r" else 1
                shown = (f"{factor * np.quantile(values, q):.{digits}f}{unit}" for q in (0.5, share))
                cells.append(", ".join(shown))
        theirs = "-" if relative is None else f"{relative:g} %"
        lines.append(row(component.replace("_", " "), *cells, theirs, f"{r:g}"))
    return FEET.format(count=len(walks)) + "\n".join(lines) + "\n\n"


def values_of(trials: Iterable[Trial], key: str) -> list[float]:
    """Values of the trials that have one."""
    found = [plates_of(one).get(key) for one in trials]
    return [value for value in found if value is not None and np.isfinite(value)]


def by_source(trials: list[Trial]) -> str:
    """A row for each source."""
    groups: dict[str, list[Trial]] = defaultdict(list)
    for one in trials:
        groups[folder_of(one)].append(one)
    lines = [
        "## By source\n",
        "Medians over the trials of a source that have the number.\n",
        "| source | trials | read | followed | compared | residual | events | vertical | CoP | shifted |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for folder, ones in sorted(groups.items()):
        stages = [one["stage"] for one in ones]
        done = sum(stage in ("reconstructed", "compared") for stage in stages)
        residual = [one["residual_median_m"] for one in ones if "residual_median_m" in one]
        keys = (
            ("timing_median_s", 1e3, " ms"), ("vertical_rms_body_weight", 1e2, " %"),
            ("cop_rms_m", 1e3, " mm"), ("cop_rms_shifted_m", 1e3, " mm"),
        )  # fmt: skip
        cells = [median(values_of(ones, key), factor, unit) for key, factor, unit in keys]
        lines.append(
            row(
                folder, str(len(ones)), str(len(ones) - stages.count("refused")), str(done),
                str(stages.count("compared")), median(residual, 1e3, " mm"), *cells,
            )
        )  # fmt: skip
    return "\n".join(lines) + "\n\n"


def median(values: list[float], factor: float, unit: str) -> str:
    """Median with its unit, or a dash."""
    return f"{factor * float(np.median(values)):.0f}{unit}" if values else "-"


def every(trials: list[Trial]) -> str:
    """A row for each trial."""
    lines = [
        "## Every trial\n",
        "| trial | activity | person | residual | events | vertical | CoP, shifted | remarks, or why not |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in trials:
        if one["stage"] in ("refused", "read"):
            lines.append(row(one["trial"], one["stage"], "", "", "", "", "", one["reason"]))
            continue
        plates = plates_of(one)
        timing, vertical = plates.get("timing_median_s"), plates.get("vertical_rms_body_weight")
        cop = [plates.get(key) for key in ("cop_rms_m", "cop_rms_shifted_m")]
        known = [f"{1e3 * value:.0f}" if value is not None and np.isfinite(value) else "-" for value in cop]
        lines.append(
            row(
                one["trial"], one.get("activity", ""), f"{one['stature_m']:.2f} m, {one['mass_kg']:.0f} kg",
                f"{1e3 * one['residual_median_m']:.0f} mm",
                "-" if timing is None else f"{1e3 * timing:.0f} ms ({plates['events']})",
                "-" if vertical is None else f"{1e2 * vertical:.1f} %",
                "-" if vertical is None else f"{', '.join(known)} mm", notes(one),
            )
        )  # fmt: skip
    return "\n".join(lines) + "\n"


def notes(trial: Trial) -> str:
    """What was found implausible, and the remarks that matter for the numbers."""
    told = [one for one in trial["remarks"] if any(word in one for word in TOLD)]
    return "; ".join([*(f"implausible: {one}" for one in trial.get("implausible", ())), *told])


def row(*cells: str) -> str:
    """A row of a table."""
    return f"| {' | '.join(cell.replace('|', '/').replace(chr(10), ' ') for cell in cells)} |"


if __name__ == "__main__":
    main()
