"""What is drawn from a finished run: figures and the BVH file in its directory."""

from collections.abc import Callable
from pathlib import Path

from manikin.export import export_motion
from manikin.figures import write_figures
from manikin.motion.file import read_motions
from manikin.output import FIGURES, MOTION


def write_products(directory: str | Path, progress: Callable[[str, float], None] | None = None) -> list[Path]:
    """Draw the figures and write the BVH file of a run directory.

    Args:
        directory: A run directory with a motion file.
        progress: Told the stage ``"figures"`` and the share that is done.

    Returns:
        The files written.

    Raises:
        MotionFileError: If the motion cannot be read or a file cannot be written.
    """
    folder = Path(directory)
    content = read_motions(folder / MOTION)
    (folder / FIGURES).mkdir(exist_ok=True)
    report = progress or _silent
    written = write_figures(content, folder / FIGURES, lambda share: report("figures", 0.9 * share))
    if content.body is not None:
        written.append(export_motion(content, folder, "bvh"))
    report("figures", 1.0)
    return written


def _silent(_stage: str, _share: float) -> None:
    """Take a progress report and do nothing."""
