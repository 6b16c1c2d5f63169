"""Recordings measured side by side in processes beside this one; a bad file stops none of the others."""

import gc
from collections.abc import Iterator, Sequence
from functools import partial
from os.path import commonpath
from pathlib import Path

import numpy as np

from manikin.analysis import AnalysisEntry, AnalysisJob, AnalysisOptions, analyze_file
from manikin.analysis_directory import write_analysis
from manikin.errors import InputError, ManikinError
from manikin.worker import SERVED, prepare_worker, side_by_side


def analyze_files(
    jobs: Sequence[AnalysisJob], options: AnalysisOptions, *, workers: int = 1
) -> Iterator[AnalysisEntry]:
    """Measure files, and write the directory of each as soon as it is known.

    Args:
        jobs: The files.
        options: The same for all.
        workers: Processes, see :func:`manikin.worker.side_by_side`.

    Yields:
        Entries in the order in which they are done.

    Raises:
        InputError: If ``workers`` is less than 1.
        ManikinError: If a process ends before its time.
    """
    if workers < 1:
        raise InputError(f"workers is {workers}; valid: at least 1")
    # Longest first, so that all processes end together.
    ordered = sorted(jobs, key=lambda job: -job.path.stat().st_size)
    one = partial(analyze_one, options=options)
    for _, entry in side_by_side(one, ordered, workers, "analysis", prepare=_prepare, method=SERVED):
        yield entry


def _prepare() -> None:
    prepare_worker()
    gc.freeze()  # what the libraries brought along is not looked through again with every collection


def analyze_one(job: AnalysisJob, options: AnalysisOptions) -> AnalysisEntry:
    """Measure one file and write its directory."""
    try:
        found = analyze_file(job.path, options)
    except (ManikinError, np.linalg.LinAlgError) as error:
        return AnalysisEntry(job, None, " ".join(str(error).split()))
    if job.directory is not None:
        write_analysis(found, job.directory, draw=job.draw)
    return AnalysisEntry(job, found.as_dict())


def directories_for(paths: Sequence[Path], out: Path) -> list[Path]:
    """A directory in ``out`` for each file: its path below the folder that all share, without the ending.

    Files that differ in their ending only keep it.
    """
    whole = [path.resolve() for path in paths]
    shared = Path(commonpath([path.parent for path in whole]))
    stems = [path.with_suffix("") for path in whole]
    return [
        out / (path if stems.count(stem) > 1 else stem).relative_to(shared)
        for path, stem in zip(whole, stems, strict=True)
    ]
