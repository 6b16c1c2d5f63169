"""Figures of runs and of recordings, one function each; no window and no global state is used.

A figure raises :class:`~manikin.errors.FigureError` if there is nothing for it to show.
"""

from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from manikin.errors import FigureError
from manikin.pipeline.run_directory import RunRecord
from manikin.reports.comparison import RunComparison
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
from manikin.reports.figures.scene import operations_figure, postures_figure, scene_figure
from manikin.reports.figures.timeline import ergonomics_figure, margin_figure, timing_figure
from manikin.reports.figures.walks import (
    equal_paths_figure,
    holonomic_ends_figure,
    holonomic_zone_figure,
    walk_paths_figure,
    walking_paths_figure,
    words_figure,
)
from manikin.runtime.files import atomic_path, writing

__all__ = [
    "COMPARISONS", "FIGURES", "ChoicePanel", "LowestPoints", "com_distances_figure", "com_figure",
    "com_heights_figure", "com_paths_figure", "compare_margin_figure", "compare_planes_figure",
    "compare_postures_figure", "compare_scene_figure", "compare_timing_figure", "contact_choice_figure",
    "contacts_figure", "effectors_figure", "equal_paths_figure", "ergonomics_figure", "flights_figure",
    "footprint_figure", "holonomic_ends_figure", "holonomic_zone_figure", "margin_figure",
    "operations_figure", "phase_durations_figure", "placements_figure", "planes_figure", "postures_figure",
    "published_lowest", "push_map_figure", "scene_figure", "timing_figure", "tracking_figure",
    "walking_paths_figure", "words_figure", "write_figures", "zmp_figure",
]  # fmt: skip


FIGURES: dict[str, Callable[[RunRecord], Figure]] = {
    "com": com_figure, "margin": margin_figure, "footprints": footprint_figure,
    "walk_paths": walk_paths_figure, "zmp": zmp_figure, "planes": planes_figure, "contacts": contacts_figure,
    "timing": timing_figure, "scene": scene_figure, "operations": operations_figure,
    "postures": postures_figure, "flights": flights_figure,
    "effectors": effectors_figure, "tracking": tracking_figure,
}  # fmt: skip
"""Every figure of a run by the name of its file."""


COMPARISONS: dict[str, Callable[[RunComparison], Figure]] = {
    "compare_timing": compare_timing_figure, "compare_planes": compare_planes_figure,
    "compare_scene": compare_scene_figure, "compare_margin": compare_margin_figure,
    "compare_postures": compare_postures_figure,
}  # fmt: skip
"""Every figure of two runs by the name of its file."""


def write_figures(
    data: RunRecord | RunComparison,
    folder: str | Path,
    on_done: Callable[[float], object] = lambda _share: None,
) -> list[Path]:
    """Write the figures of a run, or of two, that apply as PNG files, each atomically; return the files.

    Args:
        on_done: Told the share of figures done after each.

    Raises:
        MotionFileError: If the folder cannot be written to.
    """
    figures: dict[str, Callable[[Any], Figure]] = FIGURES if isinstance(data, RunRecord) else COMPARISONS
    written = []
    for number, (name, draw) in enumerate(figures.items(), 1):
        with suppress(FigureError):
            save_figure(draw(data), path := Path(folder) / f"{name}.png")
            written.append(path)
        on_done(number / len(figures))
    return written


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG file, atomically.

    Raises:
        MotionFileError: If it cannot be written.
    """
    with writing(path), atomic_path(path) as temporary:
        temporary.write_bytes(png_of(figure))


def png_of(figure: Figure) -> bytes:
    """Content of a PNG file."""
    # One drawing instead of the two of savefig; and the same data gives the same bytes.
    canvas, content = FigureCanvasAgg(figure), BytesIO()
    canvas.draw()
    image = Image.fromarray(np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]))
    image.save(content, format="png", compress_level=4, dpi=(figure.dpi, figure.dpi))
    return content.getvalue()
