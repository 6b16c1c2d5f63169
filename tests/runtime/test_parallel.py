"""Processes beside this one: they end with it, however it ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from manikin.errors import ManikinError
from manikin.runtime.parallel import SERVED, side_by_side

SCRIPT = """
import os, time
from concurrent.futures import ProcessPoolExecutor
import multiprocessing
from manikin.runtime.parallel import prepare_worker

if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), prepare_worker)
    print(pool.submit(os.getpid).result(), flush=True)
    pool.submit(time.sleep, 600).result()
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="processes are killed by signals here")
def test_no_worker_outlives_a_parent_that_is_killed(tmp_path):
    """Its process is gone soon after, though its task would have lasted ten minutes."""
    file = tmp_path / "parent.py"
    file.write_text(SCRIPT)
    parent = subprocess.Popen([sys.executable, str(file)], stdout=subprocess.PIPE, text=True)
    try:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
    finally:
        parent.kill()
        parent.wait()
    deadline = time.monotonic() + 60.0
    while alive(worker) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(worker)


def alive(process: int) -> bool:
    """Whether a process runs; one that has ended and is not fetched yet does not."""
    if Path("/proc").is_dir():
        try:
            return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        except FileNotFoundError:
            return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def halved(value):
    if value < 0:
        raise ValueError("below 0")
    if value == 13:
        os._exit(1)
    return value / 2


@pytest.mark.parametrize("workers", [1, 2])
def test_work_side_by_side_is_that_of_one_after_the_other(workers):
    found = dict(side_by_side(halved, [3, 1, 2, 4], workers, "halves"))
    assert found == {0: 1.5, 1: 0.5, 2: 1.0, 3: 2.0}
    with pytest.raises(ValueError, match="below 0"):
        list(side_by_side(halved, [1, -1], workers, "halves"))


def test_a_process_that_ends_is_told_of():
    with pytest.raises(ManikinError, match="a process of the halves ended before its time"):
        list(side_by_side(halved, [13, 13], 2, "halves", method=SERVED))
