"""Writing every figure that a motion file has the data for."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from manikin.atomic import atomic_path
from manikin.errors import MotionFileError
from manikin.figures.com import com_figure
from manikin.figures.footprints import footprint_figure
from manikin.figures.margin import margin_figure
from manikin.figures.scene import scene_figure
from manikin.figures.tracking import tracking_figure
from manikin.motion.file import MotionFile


def write_figures(
    content: MotionFile, folder: str | Path, on_done: Callable[[float], None] | None = None
) -> list[Path]:
    """Draw the figures and write them as PNG files, each atomically.

    Args:
        content: At least one motion.
        folder: Existing folder.
        on_done: Told the share of figures done after each.

    Returns:
        The files written.

    Raises:
        MotionFileError: If the folder cannot be written to.
    """
    figures: dict[str, Callable[[MotionFile], Figure]] = {
        "com": com_figure,
        "margin": margin_figure,
        "footprints": footprint_figure,
        "scene": scene_figure,
    }
    if content.planned is not None and content.executed is not None and content.body is not None:
        figures["tracking"] = tracking_figure
    written = []
    for number, (name, draw) in enumerate(figures.items()):
        path = Path(folder) / f"{name}.png"
        _save(draw(content), path)
        written.append(path)
        if on_done is not None:
            on_done((number + 1) / len(figures))
    return written


def _save(figure: Figure, path: Path) -> None:
    try:
        with atomic_path(path) as temporary:
            # Without the version text the same data always gives the same bytes.
            figure.savefig(temporary, format="png", metadata={"Software": None})
    except OSError as error:
        problem = f"{path}: cannot be written ({error.strerror})"
        raise MotionFileError(f"{problem}; valid: a writable folder") from None
