"""Figures of a finished run, one function each; no window and no global state is used."""

from manikin.figures.com import com_figure
from manikin.figures.footprints import footprint_figure
from manikin.figures.margin import margin_figure
from manikin.figures.scene import scene_figure
from manikin.figures.tracking import tracking_figure
from manikin.figures.write import write_figures

__all__ = [
    "com_figure",
    "footprint_figure",
    "margin_figure",
    "scene_figure",
    "tracking_figure",
    "write_figures",
]
