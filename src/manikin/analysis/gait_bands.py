"""Bands of gait curves over people: what is seen beside a person's own cycles.

Mean over people and standard deviation between them, from the level walks at hand, by ``docs/gait_bands.py``.
The file names its sources. Whether the people were healthy is not known, so that a band says how the walks at
hand vary, not what is normal.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from manikin.analysis.gait_cycles import CURVES, PERCENT, GaitReport
from manikin.numerics.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class GaitBand:
    """Curves of a group of people.

    Attributes:
        group: ``"adults"`` or ``"children"``.
        people: Their number; ``walks`` and ``cycles`` those of theirs.
        people_by_plate: Of them with moments and powers by force plates; others have those by motion.
        speeds: Least, mean and largest speed of the walks [m/s].
        statures: Least and largest [m].
        curves: (101,) mean and deviation between people, by curve.
        source: Whose recordings they are.
    """

    group: str
    people: int
    walks: int
    cycles: int
    people_by_plate: int
    speeds: tuple[float, float, float]
    statures: tuple[float, float]
    curves: dict[str, tuple[FloatArray, FloatArray]]
    source: str

    def compared(self, report: GaitReport) -> dict[str, dict[str, float]]:
        """Share of the cycle within one standard deviation of the mean of the people, by side and curve."""
        return {
            side: {
                name: float(np.mean(np.abs(values - self.curves[name][0]) <= self.curves[name][1]))
                for name, (values, _) in curves.items()
            }
            for side, curves in report.curves.items()
        }

    def as_dict(self, report: GaitReport) -> dict[str, Any]:
        """JSON-ready: who the people are, and how a person's curves lie to theirs."""
        return {
            "group": self.group, "people": self.people, "walks": self.walks, "cycles": self.cycles,
            "people_by_plate": self.people_by_plate, "speed_mps": list(self.speeds),
            "stature_m": list(self.statures), "share_within_band": self.compared(report),
            "source": self.source,
        }  # fmt: skip


@cache
def _content() -> dict[str, Any]:
    file = resources.files("manikin.analysis") / "data" / "level_walks.json"
    return json.loads(file.read_text(encoding="utf-8"))


def gait_band(stature: float) -> GaitBand:
    """The band of the group that a person of a stature [m] belongs to."""
    content = _content()
    group = "adults" if stature >= content["adult_stature_m"] else "children"
    known = content["groups"][group]
    percent = np.arange(0.0, 100.5, content["percent_every"])
    curves = {
        name: tuple(np.interp(PERCENT, percent, known["curves"][name][key]) for key in ("mean", "sd"))
        for name in CURVES
    }
    return GaitBand(
        group, known["people"], known["walks"], known["cycles"], known["people_by_plate"],
        tuple(known["speed_mps"]), tuple(known["stature_m"]), curves, content["source"],
    )  # fmt: skip
