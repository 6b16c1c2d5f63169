"""``python -m tests.robustness --cases 10000``: damaged files of every format, in processes that may end.

A process may use 2 GB more than it begins with. A case is done again alone by ``--format NAME --case N``.
``--kills 100`` ends that many commands at random times instead; with ``--case N`` that one alone.
``--leaks 200`` makes every call that often, ``--determinism`` plans in two orders in two new processes.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

from tests.robustness.determinism import LARGE, SMALL, in_new_process
from tests.robustness.kills import killed
from tests.robustness.leaks import MOST, growths
from tests.robustness.samples import FORMATS
from tests.robustness.trial import Finding, batch_of

BATCH = 50


def main() -> int:
    """Run the cases and print what was found; exit status 1 if anything was."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness")
    parser.add_argument("--cases", type=int, default=1500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--format", choices=[kind.name for kind in FORMATS])
    parser.add_argument("--case", type=int)
    parser.add_argument("--kills", type=int)
    parser.add_argument("--leaks", type=int)
    parser.add_argument("--determinism", action="store_true")
    given = parser.parse_args()
    if given.kills is not None:
        return _kills(given.seed, range(given.kills) if given.case is None else [given.case])
    if given.leaks is not None:
        return _leaks(given.leaks)
    if given.determinism:
        return _determinism()
    kinds = [kind.name for kind in FORMATS if given.format in (None, kind.name)]
    if given.case is not None:
        batches = [(name, given.seed, given.case, 1) for name in kinds]
    else:
        each = -(-given.cases // len(kinds))
        batches = [
            (name, given.seed, at, min(BATCH, each - at)) for name in kinds for at in range(0, each, BATCH)
        ]
    began, count, done = time.monotonic(), 0, 0
    group = 4 * (given.jobs or 1)  # processes that are replaced one by one may wait for ever (CPython 115634)
    for at in range(0, len(batches), group):
        with ProcessPoolExecutor(given.jobs, get_context("spawn")) as pool:
            waiting = {pool.submit(batch_of, *batch): batch for batch in batches[at : at + group]}
            for future in as_completed(waiting):
                batch = waiting[future]
                try:
                    findings = future.result()
                    done += batch[3]
                except BrokenProcessPool:
                    findings = [Finding(batch[0], batch[1], batch[2], f"a process ended; cases {batch[2:]}")]
                count += len(findings)
                for finding in findings:
                    print(
                        f"{finding.format} seed {finding.seed} case {finding.case}: {finding.what}",
                        flush=True,
                    )
    print(f"{done} damaged files, {count} findings, {time.monotonic() - began:.0f} s")
    return 1 if count else 0


def _kills(seed: int, cases: Iterable[int]) -> int:
    count = 0
    for case in cases:
        for what in killed(seed, case):
            count += 1
            print(f"kill, seed {seed} case {case}: {what}", flush=True)
    print(f"{count} findings")
    return 1 if count else 0


def _leaks(count: int) -> int:
    found = growths(count)
    for name, bytes_per_call in found.items():
        print(f"{name}: {bytes_per_call:.0f} bytes per call")
    return 1 if max(found.values()) > MOST else 0


def _determinism() -> int:
    names = (*SMALL, *LARGE)
    first, second = in_new_process(names, number=1), in_new_process(names[::-1], number=2)
    found = [name for name in names if first[name] != second[name]]
    for name in found:
        print(f"{name}: differs by what was planned before, by hashes, threads, language or place")
    print(f"{len(names)} plans, {len(found)} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
