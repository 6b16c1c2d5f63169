"""A result directory belongs to one process at a time."""

import pickle
import subprocess
import sys

import pytest

from manikin.errors import MotionFileError
from manikin.pipeline.batch import BatchDirectory
from manikin.pipeline.run_directory import RunDirectory

OTHER = """
import sys
from manikin.errors import MotionFileError
from manikin.pipeline.run_directory import RunDirectory
try:
    RunDirectory(sys.argv[1])
    print("taken")
except MotionFileError as error:
    print(error)
"""


def by_another_process(path):
    command = [sys.executable, "-c", OTHER, str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def test_a_run_directory_is_refused_to_a_second_process_and_free_afterwards(tmp_path):
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


def test_a_set_of_runs_belongs_to_one_process_and_leaves_other_files_alone(tmp_path):
    (tmp_path / "letter.txt").write_text("Dear reader")
    (tmp_path / "results.json").write_text("{}")
    directory = BatchDirectory(tmp_path)
    assert not (tmp_path / "results.json").exists()
    command = [sys.executable, "-m", "manikin", "run", "all", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith(f"manikin: {tmp_path}: another process writes to this set of runs; valid: ")
    assert len(done.stderr.splitlines()) == 1
    assert directory.write("results.json", {"runs": []}).exists()
    assert (tmp_path / "letter.txt").read_text() == "Dear reader"
