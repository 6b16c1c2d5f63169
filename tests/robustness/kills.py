"""Commands that are ended at random times: nothing half written, nothing left behind, no traceback.

Each is started in a directory of its own and gets SIGKILL, SIGTERM or SIGINT after a seeded time.
Then nothing of it may run, its directory must be free, and every file in it whole. Those that do not take
long are given once more, and must be done then; pieces that were kept are not done again.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from filelock import FileLock, Timeout
from tests.robustness.samples import other_module

from manikin.runtime.files import LOCK

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
INTERRUPTED = 130
LONGEST = 2.0
"""Time in which an interrupted command ends, and what it started with it [s]; our promise."""
RESUMED = 600.0
"""Time in which a command that is given again is done on a busy machine [s]."""
BUSY = 4.0
"""How much longer that may take where other programs have the processors."""


@dataclass(frozen=True)
class Command:
    """A command that writes to a directory.

    Attributes:
        name: As in reports.
        words: Arguments, with ``{out}`` for the directory, ``{recording}`` and ``{study}`` for such files.
        latest: Time in which it is ended [s].
        is_resumed: Whether it is given again.
        pieces: Pattern of the files of finished pieces, which stay as they are.
    """

    name: str
    words: tuple[str, ...]
    latest: float
    is_resumed: bool = False
    pieces: str = ""


COMMANDS = (
    Command("run", ("run", "beam-H2C1", "--out", "{out}"), 40.0, is_resumed=True),
    Command("run all", ("run", "all", "--jobs", "2", "--no-figures", "--out", "{out}"), 25.0),
    Command("words", ("words", "--out", "{out}"), 25.0),
    Command("push map", ("push", "--map", "--out", "{out}"), 25.0),
    Command("benchmark", ("benchmark", "--out", "{out}"), 25.0),
    Command("analyze", ("analyze", "{recording}", "--out", "{out}"), 15.0, is_resumed=True),
    Command(
        "benchmark of contacts",
        (
            "benchmark", "--families", "flat", "--seeds", "4", "--stage", "contacts", "--jobs", "2",
            "--out", "{out}",
        ),
        30.0, is_resumed=True, pieces="tasks/*.json",
    ),
    Command(
        "study", ("study", "{study}", "--jobs", "2", "--out", "{out}"), 30.0,
        is_resumed=True, pieces="tasks/*.json",
    ),
)  # fmt: skip


def killed(seed: int, case: int) -> list[str]:
    """What was wrong when one command was ended; empty if nothing was."""
    rng = np.random.default_rng((seed, case))
    command, number = COMMANDS[case % len(COMMANDS)], SIGNALS[int(rng.integers(len(SIGNALS)))]
    wait = float(rng.uniform(0.3, command.latest))
    with tempfile.TemporaryDirectory() as temporary:
        out = Path(temporary) / "out"
        recording = Path(temporary) / "standing.bvh"
        recording.write_text(other_module("conftest.py").standing_bvh())
        study = Path(temporary) / "study.yaml"
        study.write_text("{scenario: stairs, bodies: [{percentiles: [5, 50, 95]}]}")
        given = [word.format(out=out, recording=recording, study=study) for word in command.words]
        words = [sys.executable, "-m", "manikin", *given]
        token = f"{os.getpid()}-{seed}-{case}"
        process = subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True, env={**os.environ, "ROBUSTNESS_CASE": token},
        )  # fmt: skip
        try:
            output, errors = process.communicate(timeout=wait)
            return [f"{command.name}: {errors.strip()[-200:]}"] if "Traceback" in output + errors else []
        except subprocess.TimeoutExpired:
            pass
        found = _ended(process, number, out, token)
        if command.is_resumed:
            found += _resumed(command, words, out)
        return [f"{command.name}, {number.name} after {wait:.2f} s: {what}" for what in found]


def _ended(process: "subprocess.Popen[str]", number: signal.Signals, out: Path, token: str) -> list[str]:
    began = time.monotonic()
    process.send_signal(number)
    try:
        output, errors = process.communicate(timeout=60.0)
    except subprocess.TimeoutExpired:
        process.kill()
        return ["does not end within 60 s"]
    took, found = time.monotonic() - began, list[str]()
    if number is not signal.SIGKILL:
        if took > LONGEST + BUSY:
            found.append(f"ends after {took:.1f} s")
        if process.returncode not in (0, INTERRUPTED):
            found.append(f"ends with status {process.returncode}: {errors.strip()[-200:]}")
        if "Traceback" in output + errors:
            found.append(f"traceback: {errors.strip()[-300:]}")
    time.sleep(LONGEST)
    if left := _alive(token):
        found.append(f"leaves processes {left}")
    if not out.is_dir():
        return found
    if not _is_free(out):
        found.append("its directory is still locked")
    return found + _damaged(out, whole=number is not signal.SIGKILL)


def _resumed(command: Command, words: list[str], out: Path) -> list[str]:
    """What is wrong when the same command is given once more, and left to end."""
    kept = {file: file.stat().st_mtime_ns for file in out.glob(command.pieces)} if command.pieces else {}
    try:
        again = subprocess.run(
            words, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=RESUMED
        )
    except subprocess.TimeoutExpired:
        return [f"given again, it is not done within {RESUMED:g} s"]
    found = [
        f"given again, does {file.name} anew" for file, at in kept.items() if file.stat().st_mtime_ns != at
    ]
    if again.returncode != 0:
        found.append(f"given again, ends with status {again.returncode}: {again.stderr.strip()[-300:]}")
    return found + [f"given again: {what}" for what in _damaged(out, whole=True)]


def _is_free(out: Path) -> bool:
    """Whether another process may write to a directory now."""
    try:
        with FileLock(out / LOCK, timeout=0):
            return True
    except Timeout:
        return False


def _alive(token: str) -> list[str]:
    """Commands of the processes that began in this case and still compute."""
    alive, mark = [], f"ROBUSTNESS_CASE={token}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (folder / "environ").read_bytes().split(b"\0"):
                alive.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()[:80])
        except OSError:  # it ended, or belongs to somebody else
            continue
    return alive


def _damaged(out: Path, *, whole: bool) -> list[str]:
    """Files that are not whole; hidden temporary ones as well, unless the process could not remove them."""
    found = []
    for file in sorted(item for item in out.rglob("*") if item.is_file()):
        try:
            if file.name.endswith(".tmp"):
                if whole:
                    found.append(f"{file.name} is left")
            elif file.suffix == ".json":
                json.loads(file.read_text(encoding="utf-8"))
            elif file.suffix == ".h5":
                with h5py.File(file, "r") as opened:
                    list(opened)
            elif file.suffix == ".png" and not file.read_bytes().endswith(b"IEND\xaeB`\x82"):
                found.append(f"{file.name} is cut off")
            elif file.suffix == ".npz":
                np.load(file).close()
        except (OSError, ValueError) as error:
            found.append(f"{file.name}: {error}")
    return found
