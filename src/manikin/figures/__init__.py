"""Figures of a finished run, one function each; no window and no global state is used."""

from manikin.figures.com import com_figure
from manikin.figures.contacts import contacts_figure
from manikin.figures.effectors import effectors_figure
from manikin.figures.flights import flights_figure
from manikin.figures.footprints import footprint_figure
from manikin.figures.margin import margin_figure
from manikin.figures.planes import planes_figure
from manikin.figures.postures import postures_figure
from manikin.figures.scene import scene_figure
from manikin.figures.timing import timing_figure
from manikin.figures.tracking import tracking_figure
from manikin.figures.write import FIGURES, write_figures
from manikin.figures.zmp import zmp_figure

__all__ = [
    "FIGURES",
    "com_figure",
    "contacts_figure",
    "effectors_figure",
    "flights_figure",
    "footprint_figure",
    "margin_figure",
    "planes_figure",
    "postures_figure",
    "scene_figure",
    "timing_figure",
    "tracking_figure",
    "write_figures",
    "zmp_figure",
]
