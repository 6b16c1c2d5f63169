"""Figures of runs and of recordings, one function each; no window and no global state is used."""

from manikin.reports.figures.com import (
    LowestPoints,
    com_distances_figure,
    com_figure,
    com_heights_figure,
    com_paths_figure,
    planes_figure,
    published_lowest,
)
from manikin.reports.figures.compare_runs import (
    compare_margin_figure,
    compare_planes_figure,
    compare_postures_figure,
    compare_scene_figure,
    compare_timing_figure,
)
from manikin.reports.figures.contacts import ChoicePanel, contact_choice_figure, contacts_figure
from manikin.reports.figures.effectors import effectors_figure, flights_figure, tracking_figure
from manikin.reports.figures.ground import footprint_figure, push_map_figure, zmp_figure
from manikin.reports.figures.phase_statistics import phase_durations_figure, placements_figure
from manikin.reports.figures.scene import postures_figure, scene_figure
from manikin.reports.figures.timeline import ergonomics_figure, margin_figure, timing_figure
from manikin.reports.figures.walks import (
    equal_paths_figure,
    holonomic_ends_figure,
    holonomic_zone_figure,
    walking_paths_figure,
    words_figure,
)
from manikin.reports.figures.write_figures import COMPARISONS, FIGURES, write_comparison, write_figures

__all__ = [
    "COMPARISONS", "FIGURES", "ChoicePanel", "LowestPoints", "com_distances_figure", "com_figure",
    "com_heights_figure", "com_paths_figure", "compare_margin_figure", "compare_planes_figure",
    "compare_postures_figure", "compare_scene_figure", "compare_timing_figure", "contact_choice_figure",
    "contacts_figure", "effectors_figure", "equal_paths_figure", "ergonomics_figure", "flights_figure",
    "footprint_figure", "holonomic_ends_figure", "holonomic_zone_figure", "margin_figure",
    "phase_durations_figure", "placements_figure", "planes_figure", "postures_figure", "published_lowest",
    "push_map_figure", "scene_figure", "timing_figure", "tracking_figure", "walking_paths_figure",
    "words_figure", "write_comparison", "write_figures", "zmp_figure",
]  # fmt: skip
