"""Processes beside this one: they end with it, however it ends."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from manikin.errors import ManikinError
from manikin.runtime.parallel import side_by_side

SCRIPT = """
import os, signal, time
from manikin.runtime.parallel import side_by_side

def nap(seconds):
    time.sleep(seconds)
    return os.getpid()

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # xdist's workers ignore it
    for _, worker in side_by_side(nap, [0, 600, 600], 2, "naps"):
        print(worker, flush=True)
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
    assert ends(worker)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="processes are killed by signals here")
def test_ctrl_c_ends_parent_and_workers(tmp_path):
    """The signal reaches all of them; work is deaf to it, and its process is ended by the parent."""
    file = tmp_path / "parent.py"
    file.write_text(SCRIPT)
    parent = subprocess.Popen(
        [sys.executable, str(file)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    assert parent.stdout is not None
    worker = int(parent.stdout.readline())
    os.killpg(parent.pid, signal.SIGINT)
    _, errors = parent.communicate(timeout=60.0)
    assert parent.returncode != 0
    assert "KeyboardInterrupt" in errors
    assert "in nap" not in errors
    assert ends(worker)


def ends(process: int) -> bool:
    """Whether a process ends within a minute."""
    deadline = time.monotonic() + 60.0
    while alive(process) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not alive(process)


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
        list(side_by_side(halved, [13, 13], 2, "halves"))
    assert dict(side_by_side(halved, [2, 4], 2, "halves")) == {0: 1.0, 1: 2.0}


def threads(values):
    values += 1.0
    (values @ values).sum()
    return {pool["num_threads"] for pool in threadpool_info()}


@pytest.mark.parametrize("workers", [1, 2])
def test_every_process_works_on_one_thread_and_on_arrays_of_its_own(workers):
    """Large arrays, too, arrive as such, and can be written to."""
    items = [np.zeros((400, 400)) for _ in range(2)]
    assert dict(side_by_side(threads, items, workers, "threads")) == {0: {1}, 1: {1}}


def nap(seconds):
    time.sleep(seconds)
    return os.getpid()


def test_work_that_is_given_up_ends_at_once(recwarn):
    before = set(multiprocessing.active_children())
    with closing(side_by_side(nap, [0.0, 600.0, 600.0], 2, "naps")) as done:
        _, worker = next(done)
    assert ends(worker)
    assert not set(multiprocessing.active_children()) - before
    assert not list(recwarn)
