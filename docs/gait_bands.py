"""Bands of gait curves from the level walks at hand, for the report of `manikin analyze`.

`python docs/gait_bands.py FOLDER` measures the walks of :data:`WALKS` below FOLDER and writes
`src/manikin/analysis/data/level_walks.json`: at every second per cent of the cycle the mean over people
and the standard deviation between people, of each curve. A person counts once: the mean of all cycles of both
legs in all of the person's walks. Nothing else of the recordings is kept.
It then draws `docs/images/gait-cycles.svg`, the cycles of one walk beside the band.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from manikin.analysis import Analysis, AnalysisOptions, analyze_file
from manikin.analysis.gait_cycles import ANGLES, CURVES, PERCENT
from manikin.errors import ManikinError
from manikin.reports.gait_sheet import gait_sheet

WALKS = {
    "grf/btkdata/FunctionalWalk.c3d": "btk 1", "grf/btkdata/Gait.c3d": "btk 2",
    "grf/btkdata/PiG_Motion-FlatFoot-One.c3d": "btk 3", "grf/btkdata/PiG_Motion3_FF.c3d": "btk 4",
    "grf/btkdata/PlugInC3D.c3d": "btk 5",
    "grf/opensim_core/walking2.c3d": "opensim 1", "grf/opensim_core/walking5.c3d": "opensim 1",
    "laboratories/opensim/test_walking.c3d": "opensim 2",
    "laboratories/aus_AUC/CB_Dynamic0003.c3d": "auc", "laboratories/aus_QCMAS/QCMAS.dynamic.c3d": "qcmas",
    "laboratories/aus_Sydney/S4-AMGait03.c3d": "sydney", "laboratories/aus_Sydney/S4-AMGait04.c3d": "sydney",
    "laboratories/aus_first/Walk01-01.c3d": "first",
    "laboratories/mcgill/HC002D06.c3d": "mcgill 2", "laboratories/mcgill/HC030A05.c3d": "mcgill 30",
    "laboratories/mcgill/HC031A06.c3d": "mcgill 31", "laboratories/mcgill/HC036A10.c3d": "mcgill 36",
    "laboratories/mcgill/HC055A09.c3d": "mcgill 55",
    "laboratories/ezc3d/Qualisys.c3d": "qualisys",
    "laboratories/wisconsin/overground_17_osim.trc": "wisconsin",
    "laboratories/c3dorg/sample_00_Motion_Analysis_Corporation_Walk1.c3d": "c3d.org 0a",
    "laboratories/c3dorg/sample_00_Vicon_Motion_Systems_pyCGM2_lower_limb_CGM24_Walking01.c3d": "c3d.org 0b",
    "laboratories/c3dorg/sample_03_gait-pig.c3d": "c3d.org 3",
    "laboratories/c3dorg/sample_06_newwalk.c3d": "c3d.org 6",
    "laboratories/c3dorg/sample_10_TYPE-3.c3d": "c3d.org 10",
    "laboratories/c3dorg/sample_11_2198928.c3d": "c3d.org 11",
    "laboratories/c3dorg/sample_14_sample14.c3d": "c3d.org 14",
}  # fmt: skip
"""Level walks whose terms allow statistics of them to be given away, and who walks (by source and number)."""

FOLDER = Path(__file__).resolve().parents[1] / "src" / "manikin" / "analysis" / "data"

ADULT, EVERY = 1.5, 2
"""Stature from which a person counts among the adults [m]; instants kept [%]."""

LARGEST_RESIDUAL, SPEEDS = 0.006, (0.8, 1.8)
"""Median residual of a reconstruction [m], and speeds of a walk [m/s], beyond which a file is left out."""

SOURCE = (
    "computed by docs/gait_bands.py from recordings of: BTKData (BSD-3), OpenSim (Apache-2.0), clinical gait "
    "laboratories of Australia and New Zealand by C3D-parser (Apache-2.0), McGill Motion Lab by biomechZoo "
    "(MIT), ezc3d (MIT), University of Wisconsin-Madison (Apache-2.0), sample data of c3d.org"
)


def main() -> None:
    """Command line."""
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        raise SystemExit("usage: python docs/gait_bands.py FOLDER")
    people: dict[str, list[Analysis]] = defaultdict(list)
    for name, person in WALKS.items():
        try:
            found = analyze_file(Path(sys.argv[1]) / name, AnalysisOptions(as_recorded=True))
        except ManikinError as error:
            print(f"{name}: {error}", flush=True)
            continue
        speed = None if found.gait is None else found.gait.speed
        fits = found.found.median < LARGEST_RESIDUAL and found.activity.kind == "walking"
        kept = fits and speed is not None and SPEEDS[0] < speed < SPEEDS[1] and len(found.gait.cycles) > 0
        print(
            f"{name}: {found.activity.kind}, {found.body.stature:.2f} m, speed {speed}, "
            f"{0 if found.gait is None else len(found.gait.cycles)} cycles, {'kept' if kept else 'left out'}",
            flush=True,
        )
        if kept:
            people[person].append(found)
    groups = {
        name: band([walks for walks in people.values() if ((walks[0].body.stature or 0.0) >= ADULT) is adult])
        for name, adult in (("adults", True), ("children", False))
    }
    FOLDER.mkdir(exist_ok=True)
    content = {"source": SOURCE, "adult_stature_m": ADULT, "percent_every": EVERY, "groups": groups}
    (FOLDER / "level_walks.json").write_text(json.dumps(content) + "\n")
    draw(Path(sys.argv[1]) / SHOWN)


SHOWN = "grf/btkdata/FunctionalWalk.c3d"
"""The walk of the figure."""


def draw(path: Path) -> None:
    """The figure of the docs."""
    found = analyze_file(path, AnalysisOptions(as_recorded=True))
    assert found.gait is not None
    svg = gait_sheet(found.gait, found.gait_band, "Angles, moments and powers over the gait cycle")
    file = Path(__file__).parent / "images" / "gait-cycles.svg"
    file.write_text(svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1) + "\n")


def band(people: list[list[Analysis]]) -> dict:
    """Mean over people and deviation between them; moments of those whose cycles have them by plates too."""
    cycles = [[one for walk in walks if walk.gait for one in walk.gait.cycles] for walks in people]
    curves = {}
    for name in CURVES:
        # Moments and powers by plates where a person has such a cycle: they do not share the motion's errors.
        chosen = [
            ones
            if name in ANGLES or not any(one.by_plate for one in ones)
            else [one for one in ones if one.by_plate]
            for ones in cycles
        ]
        means = np.array([np.mean([one.curves[name] for one in ones], axis=0) for ones in chosen])
        means = means[:, PERCENT % EVERY == 0]
        curves[name] = {
            "mean": np.round(means.mean(axis=0), 3).tolist(),
            "sd": np.round(means.std(axis=0, ddof=1), 3).tolist(),
        }
    walks = [walk for walks in people for walk in walks]
    speeds = [walk.gait.speed for walk in walks if walk.gait and walk.gait.speed is not None]
    statures = [float(walks[0].body.stature or 0.0) for walks in people]
    return {
        "people": len(people), "walks": len(walks), "cycles": sum(map(len, cycles)),
        "cycles_by_plate": sum(one.by_plate for ones in cycles for one in ones),
        "people_by_plate": sum(any(one.by_plate for one in ones) for ones in cycles),
        "speed_mps": [round(min(speeds), 2), round(float(np.mean(speeds)), 2), round(max(speeds), 2)],
        "stature_m": [round(min(statures), 2), round(max(statures), 2)], "curves": curves,
    }  # fmt: skip


if __name__ == "__main__":
    main()
