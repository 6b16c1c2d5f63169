"""What is drawn from a finished run: figures and the BVH file in its directory."""

from collections.abc import Callable
from pathlib import Path

from manikin.export import export_motion
from manikin.figures import write_figures
from manikin.output import FIGURES
from manikin.record import read_run


def write_products(directory: str | Path, progress: Callable[[str, float], None] | None = None) -> list[Path]:
    """Draw the figures and write the BVH file of a run directory.

    Args:
        directory: The directory of a finished run, successful or not.
        progress: Told the stage ``"figures"`` and the share that is done.

    Returns:
        The files written.

    Raises:
        InputError: If the run cannot be read or a file cannot be written.
    """
    folder = Path(directory)
    record = read_run(folder)
    (folder / FIGURES).mkdir(exist_ok=True)
    report = progress or _silent
    written = write_figures(record, folder / FIGURES, lambda share: report("figures", 0.9 * share))
    if record.motions and record.body is not None:
        written.append(export_motion(record.content, folder, "bvh"))
    report("figures", 1.0)
    return written


def _silent(_stage: str, _share: float) -> None:
    """Take a progress report and do nothing."""
