"""Recordings measured side by side in processes beside this one; a bad file stops none of the others."""

import gc
import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from os.path import commonpath
from pathlib import Path

from threadpoolctl import threadpool_limits

from manikin.analysis import AnalysisEntry, AnalysisJob, AnalysisOptions, analyze_file
from manikin.analysis_directory import write_analysis
from manikin.errors import InputError, ManikinError
from manikin.worker import prepare_worker

METHOD = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
"""Fresh processes: copies of this one would share the threads and locks of its libraries."""


def analyze_files(
    jobs: Sequence[AnalysisJob], options: AnalysisOptions, *, workers: int = 1
) -> Iterator[AnalysisEntry]:
    """Measure files, and write the directory of each as soon as it is known.

    Args:
        jobs: The files.
        options: The same for all.
        workers: Processes; with 1 all is done here. With more a script must keep its own work under
            ``if __name__ == "__main__":``.

    Yields:
        Entries in the order in which they are done.

    Raises:
        InputError: If ``workers`` is less than 1.
        ManikinError: If a process ends before its time.
    """
    if workers < 1:
        raise InputError(f"workers is {workers}; valid: at least 1")
    if workers == 1 or len(jobs) < 2:
        for job in jobs:
            with threadpool_limits(1):
                entry = analyze_one(job, options)
            yield entry
        return
    pool = ProcessPoolExecutor(min(workers, len(jobs)), multiprocessing.get_context(METHOD), _prepare)
    try:
        for future in as_completed([pool.submit(analyze_one, job, options) for job in jobs]):
            yield future.result()
    except BrokenProcessPool:
        raise ManikinError("a process of the analysis ended before its time, for want of memory?") from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _prepare() -> None:
    prepare_worker()
    gc.freeze()  # what the libraries brought along is not looked through again with every collection


def analyze_one(job: AnalysisJob, options: AnalysisOptions) -> AnalysisEntry:
    """Measure one file and write its directory."""
    try:
        found = analyze_file(job.path, options)
    except InputError as error:
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
