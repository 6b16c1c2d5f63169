"""A result directory belongs to one process at a time."""

import pickle
import signal
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from manikin.api.runs import Drawing
from manikin.errors import MotionFileError
from manikin.pipeline.batch import BatchDirectory
from manikin.pipeline.run_directory import RunDirectory
from manikin.reports.figures import save_figure
from manikin.runtime.files import columns_csv, write_result

OTHER = """
import sys
from manikin.errors import MotionFileError
from manikin.pipeline.run_directory import RunDirectory
for line in sys.stdin:
    try:
        RunDirectory(line.strip())
        print("taken", flush=True)
    except MotionFileError as error:
        print(error, flush=True)
"""


@pytest.fixture
def by_another_process():
    """What another process, that stays, says when it is to take a directory."""
    with subprocess.Popen(
        [sys.executable, "-c", OTHER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:

        def said(path):
            process.stdin.write(f"{path}\n")
            process.stdin.flush()
            return process.stdout.readline().strip()

        yield said


def test_a_run_directory_is_refused_to_a_second_process_and_free_afterwards(tmp_path, by_another_process):
    first = RunDirectory(tmp_path / "run")
    first.write("scenario.yaml", "name: first\n")
    first.write("summary.json", {"verdict": "proved"})
    said = by_another_process(tmp_path / "run")
    assert said.startswith(f"{tmp_path / 'run'}: another process writes to this run; valid: ")
    assert (tmp_path / "run" / "summary.json").exists()
    again = RunDirectory(tmp_path / "run")  # in one process a later run takes over
    del first
    assert by_another_process(tmp_path / "run") != "taken"
    copy = pickle.loads(pickle.dumps(again))
    del again
    assert by_another_process(tmp_path / "run") == "taken"
    assert copy.path == tmp_path / "run"


def test_a_directory_that_is_something_else_is_not_claimed(tmp_path):
    (tmp_path / "letter.txt").write_text("Dear reader")
    with pytest.raises(MotionFileError, match=r"letter\.txt"):
        RunDirectory(tmp_path)
    assert [item.name for item in tmp_path.iterdir()] == ["letter.txt"]


RUN_ALL = """
import sys
from manikin.pipeline import batch
batch.built_in_jobs = lambda **_: (batch.Job("platform"),)
from manikin.cli import main
raise SystemExit(main(sys.argv[1:]))
"""
"""The command with fewer scenarios to look at."""


def test_a_set_of_runs_belongs_to_one_process_and_leaves_other_files_alone(tmp_path):
    (tmp_path / "letter.txt").write_text("Dear reader")
    (tmp_path / "results.json").write_text("{}")
    directory = BatchDirectory(tmp_path)
    assert not (tmp_path / "results.json").exists()
    done = subprocess.run(
        [sys.executable, "-c", RUN_ALL, "run", "all", "--out", str(tmp_path)], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"manikin: {tmp_path}: another process writes to this set of runs; valid: ")
    assert len(done.stderr.splitlines()) == 1
    assert directory.write("results.json", {"runs": []}).exists()
    assert (tmp_path / "letter.txt").read_text() == "Dear reader"


@pytest.fixture
def full_disk():
    """A disk on which files of this process cannot grow beyond 1,000 bytes."""
    resource = pytest.importorskip("resource")
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def _figure(path):
    figure = Figure((4, 4))
    figure.subplots().plot([0.0, 1.0])
    save_figure(figure, path)


WRITERS = {
    "page.html": lambda path: write_result(path, "<p>" * 1000),
    "summary.json": lambda path: write_result(path, {"values": np.arange(1000.0)}),
    "series.csv": lambda path: write_result(path, columns_csv({"t": np.arange(1000.0)}, 6)),
    "figure.png": _figure,
    "drawing.svg": lambda path: Drawing("<svg/>" * 1000).save(path),
}


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_told_in_one_line_and_leaves_the_earlier_file(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"earlier")
    with pytest.raises(MotionFileError, match="cannot be written") as caught:
        WRITERS[name](path)
    assert "\n" not in str(caught.value)
    assert [item.name for item in tmp_path.iterdir()] == [name]
    assert path.read_bytes() == b"earlier"
