"""Figures of runs and of recordings, one function each; no window and no global state is used."""

from manikin.figures.com import com_figure
from manikin.figures.com_distances import com_distances_figure
from manikin.figures.com_heights import LowestPoints, com_heights_figure, published_lowest
from manikin.figures.com_paths import com_paths_figure
from manikin.figures.compare_com import compare_planes_figure, compare_scene_figure
from manikin.figures.compare_margin import compare_margin_figure
from manikin.figures.compare_postures import compare_postures_figure
from manikin.figures.compare_timing import compare_timing_figure
from manikin.figures.contact_choice import ChoicePanel, contact_choice_figure
from manikin.figures.contacts import contacts_figure
from manikin.figures.effectors import effectors_figure
from manikin.figures.ergonomics import ergonomics_figure
from manikin.figures.flights import flights_figure
from manikin.figures.footprints import footprint_figure
from manikin.figures.margin import margin_figure
from manikin.figures.phase_durations import phase_durations_figure
from manikin.figures.placements import placements_figure
from manikin.figures.planes import planes_figure
from manikin.figures.postures import postures_figure
from manikin.figures.push_map import push_map_figure
from manikin.figures.scene import scene_figure
from manikin.figures.support_strip import support_strip_figure
from manikin.figures.timing import timing_figure
from manikin.figures.tracking import tracking_figure
from manikin.figures.walking import walking_paths_figure
from manikin.figures.words import equal_paths_figure, words_figure
from manikin.figures.write import COMPARISONS, FIGURES, write_comparison, write_figures
from manikin.figures.zmp import zmp_figure
from manikin.figures.zone import holonomic_ends_figure, holonomic_zone_figure

__all__ = [
    "COMPARISONS",
    "FIGURES",
    "ChoicePanel",
    "LowestPoints",
    "com_distances_figure",
    "com_figure",
    "com_heights_figure",
    "com_paths_figure",
    "compare_margin_figure",
    "compare_planes_figure",
    "compare_postures_figure",
    "compare_scene_figure",
    "compare_timing_figure",
    "contact_choice_figure",
    "contacts_figure",
    "effectors_figure",
    "equal_paths_figure",
    "ergonomics_figure",
    "flights_figure",
    "footprint_figure",
    "holonomic_ends_figure",
    "holonomic_zone_figure",
    "margin_figure",
    "phase_durations_figure",
    "placements_figure",
    "planes_figure",
    "postures_figure",
    "published_lowest",
    "push_map_figure",
    "scene_figure",
    "support_strip_figure",
    "timing_figure",
    "tracking_figure",
    "walking_paths_figure",
    "words_figure",
    "write_comparison",
    "write_figures",
    "zmp_figure",
]
