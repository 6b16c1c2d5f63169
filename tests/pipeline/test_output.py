"""Run directories and atomic writing."""

import json
import stat

import numpy as np
import pytest

from manikin.errors import MotionFileError
from manikin.pipeline.run_directory import RunDirectory, read_summary
from manikin.runtime.files import LOCK, atomic_path, to_json, write_text


def test_files_of_a_run(tmp_path):
    run = RunDirectory(tmp_path / "a" / "b")
    run.write("scenario.yaml", "name: x\n")
    run.write("stages/centroidal.json", {"d_min": np.float64(33.0), "knots": np.arange(3.0), "nothing": None})
    run.write("summary.json", {"succeeded": True})
    assert json.loads((run.path / "stages" / "centroidal.json").read_text()) == {
        "d_min": 33.0, "knots": [0.0, 1.0, 2.0], "nothing": None,
    }  # fmt: skip
    assert read_summary(run.path) == {"succeeded": True}


def test_second_run_removes_what_the_first_left(tmp_path):
    run = RunDirectory(tmp_path)
    run.write("scenario.yaml", "name: x\n")
    run.write("stages/centroidal.json", {})
    run.write("summary.json", {})
    (run.figures / "com.png").write_bytes(b"x")
    (tmp_path / "notes.txt").write_text("mine")
    RunDirectory(tmp_path)
    left = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    left.remove(LOCK)
    assert left == ["notes.txt", "scenario.yaml"]


def test_directories_of_others_and_files_are_refused(tmp_path):
    (tmp_path / "thesis.doc").write_text("precious")
    with pytest.raises(MotionFileError, match=r"thesis\.doc.*valid"):
        RunDirectory(tmp_path)
    with pytest.raises(MotionFileError, match="is a file"):
        RunDirectory(tmp_path / "thesis.doc")
    with pytest.raises(MotionFileError, match="cannot be written"):
        RunDirectory(tmp_path / "thesis.doc" / "run")
    assert (tmp_path / "thesis.doc").read_text() == "precious"


def test_missing_and_damaged_summaries_give_one_line(tmp_path):
    with pytest.raises(MotionFileError, match="no such file"):
        read_summary(tmp_path)
    for text in ("{", "[1]"):
        (tmp_path / "summary.json").write_text(text)
        with pytest.raises(MotionFileError, match=r"summary\.json") as caught:
            read_summary(tmp_path)
        assert "\n" not in str(caught.value)


def test_leftovers_of_a_killed_run_are_removed_by_the_next(tmp_path):
    first = RunDirectory(tmp_path)
    first.write("scenario.yaml", "name: a")
    first.write("stages/centroidal.json", {})
    for folder in (tmp_path, tmp_path / "stages"):
        (folder / ".motion.h5.0a1b.tmp").write_bytes(b"half")
    RunDirectory(tmp_path)
    assert sorted(item.name for item in tmp_path.rglob("*")) == [LOCK, "scenario.yaml", "stages"]


def test_json_has_no_nan():
    value = {"a": np.nan, "b": [np.inf, np.int64(3), True], "c": np.array([[1.5]]), "d": ("x", None)}
    assert json.loads(to_json(value)) == {"a": None, "b": [None, 3, True], "c": [[1.5]], "d": ["x", None]}


def test_old_content_stays_until_the_new_is_whole(tmp_path):
    path = tmp_path / "file.txt"
    write_text(path, "old")

    def interrupted():
        with atomic_path(path) as temporary:
            temporary.write_text("ne")
            assert path.read_text() == "old"
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [item.name for item in tmp_path.iterdir()] == ["file.txt"]
    assert path.read_text() == "old"


def test_links_are_followed_and_permissions_are_the_usual_ones(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"
    (tmp_path / "plain.txt").write_text("x")
    usual, ours = ((tmp_path / name).stat().st_mode for name in ("plain.txt", "real.txt"))
    assert stat.S_IMODE(usual) == stat.S_IMODE(ours)
