"""What is drawn: figures and BVH file of a run, the comparison of two, a contact that was found."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from manikin.body import BodyModel
from manikin.ergonomics import Ergonomics
from manikin.pipeline.run_directory import read_run
from manikin.planning.contacts.single_contact import ContactAnswer
from manikin.reports.comparison import RunComparison
from manikin.reports.export import export_motion
from manikin.reports.figures import (
    ChoicePanel,
    contact_choice_figure,
    equal_paths_figure,
    ergonomics_figure,
    push_map_figure,
    words_figure,
    write_comparison,
    write_figures,
)
from manikin.reports.figures.write_figures import save_figure
from manikin.runtime.files import FIGURES, make_directory, write_result
from manikin.runtime.palette import readable
from manikin.scene import Scene
from manikin.simulation import PushMap, PushTrials
from manikin.walking.words import WordSlice, equal_paths

COMPARISON = "comparison.json"
PUSH_MAP = "push_map"
WORDS = "words"
EQUAL_PATHS = "equal_paths"
SHOWN_SLICES = (340, 150)
"""Headings of the slices that are drawn if they are there, those of [Truong2010]_ Fig. 3.6 [deg]."""


def write_outputs(directory: str | Path, progress: Callable[[str, float], None] | None = None) -> list[Path]:
    """Draw the figures and write the BVH file of a run directory; a point mass has no skeleton for BVH.

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
    if not record.tracks and record.schedule is None:
        return []
    (folder / FIGURES).mkdir(exist_ok=True)
    report = progress or _silent
    written = write_figures(record, folder / FIGURES, lambda share: report("figures", 0.9 * share))
    if record.motions and record.body is not None and not record.body.is_point_mass:
        written.append(export_motion(record.content, folder, "bvh"))
    report("figures", 1.0)
    return written


def write_comparison_outputs(
    comparison: RunComparison, directory: str | Path, progress: Callable[[str, float], None] | None = None
) -> list[Path]:
    """Draw the figures of two runs and write ``comparison.json``.

    Args:
        comparison: Two runs.
        directory: Created when it is missing; other files in it are left alone.
        progress: Told the stage ``"figures"`` and the share that is done.

    Returns:
        The files written.

    Raises:
        MotionFileError: If the directory cannot be written to.
    """
    folder = Path(directory)
    file = folder / COMPARISON
    make_directory(folder)
    write_result(file, comparison.as_dict())
    report = progress or _silent
    return [file, *write_comparison(comparison, folder, lambda share: report("figures", share))]


def write_contact_figure(body: BodyModel, scene: Scene, answer: ContactAnswer, path: str | Path) -> Path:
    """Draw the body before and after it made the contact that was asked for.

    Args:
        body: The body.
        scene: Its surroundings.
        answer: What was found, or not.
        path: PNG file.

    Raises:
        MotionFileError: If the file cannot be written.
    """
    result, file = answer.result, Path(path)
    task = np.array(answer.question.task) / np.linalg.norm(answer.question.task)
    panels = [ChoicePanel("before", answer.q, task=task)]
    if result.q is not None and result.contact is not None:
        title = f"{answer.question.heuristic}: {result.obstacle}, EFORT {answer.efort:.2f}"
        panels.append(ChoicePanel(title, result.q, (result.contact,), (result.limb,), task))
    figure = contact_choice_figure(body, scene, panels, f"Contact of {readable(result.limb)}")
    save_figure(figure, file)
    return file


def write_ergonomics_figure(found: Ergonomics, path: str | Path, title: str = "Ergonomics") -> Path:
    """Draw the scores and torque shares of a motion.

    Args:
        found: Of the motion.
        path: PNG file.
        title: Of the figure.

    Raises:
        FigureError: If there is nothing to draw.
        MotionFileError: If the file cannot be written.
    """
    save_figure(ergonomics_figure(found, title), Path(path))
    return Path(path)


def write_ergonomics_csv(found: Ergonomics, path: str | Path) -> Path:
    """Write the time series of a motion's ergonomics as comma-separated text.

    Args:
        found: Of the motion.
        path: Of the file.

    Raises:
        MotionFileError: If the file cannot be written.
    """
    return write_result(path, found.csv())


def write_push_map_figure(maps: Sequence[PushMap], trials: PushTrials, folder: Path) -> Path:
    """Draw push maps around the soles of the body.

    Args:
        maps: With what is known of them.
        trials: The body and stance of the first one.
        folder: Existing folder.

    Returns:
        The file written.

    Raises:
        FigureError: If no impulse was held.
        MotionFileError: If the file cannot be written.
    """
    file = folder / f"{PUSH_MAP}.png"
    save_figure(push_map_figure(maps, trials.soles()), file)
    return file


def write_words_figures(slices: Sequence[WordSlice], folder: Path) -> list[Path]:
    """Draw slices of a partition into words, and two paths of equal cost on a border of theirs.

    Args:
        slices: Of the partition; drawn are those of :data:`SHOWN_SLICES`, else the first two.
        folder: Existing folder.

    Returns:
        The files written; without the equal paths if the slices have no such border.

    Raises:
        FigureError: If there is no slice.
        MotionFileError: If a file cannot be written.
    """
    chosen = [one for heading in SHOWN_SLICES for one in slices if round(one.heading_deg) == heading]
    chosen = chosen or list(slices[:2])
    files = [folder / f"{WORDS}.png"]
    save_figure(words_figure(chosen), files[0])
    pairs = [
        equal_paths(*(one.path(*place) for place in jumps[0])) for one in chosen if (jumps := one.jumps())
    ]
    if pairs:
        files.append(folder / f"{EQUAL_PATHS}.png")
        save_figure(equal_paths_figure(pairs), files[1])
    return files


def _silent(_stage: str, _share: float) -> None:
    """Take a progress report and do nothing."""
