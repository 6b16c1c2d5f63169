"""A directory of slices can be gone on with, and refuses what is not its own."""

import json

import numpy as np
import pytest

from manikin.errors import InputError, MotionFileError
from manikin.reports.directories import WordsDirectory
from manikin.walking.words import WordGrid, solve_slice

GRID = WordGrid((-1.0, 1.0), (3.0, 3.5), 0.5)


@pytest.fixture(scope="module")
def slices():
    return {heading: solve_slice(heading, GRID) for heading in (0, 90)}


@pytest.fixture
def kept(tmp_path, slices):
    directory = WordsDirectory(tmp_path / "words", GRID)
    directory.begin([0, 90])
    directory.keep(slices[0])
    return directory


def test_a_slice_is_there_again_as_it_was(kept, slices):
    again = WordsDirectory(kept.path, GRID)
    assert list(again.slices) == [0]
    for name in ("turns", "shapes", "lengths", "costs"):
        assert np.array_equal(getattr(again.slices[0], name), getattr(slices[0], name))
    assert json.loads((kept.path / "words.json").read_text())["complete"] is False


def test_the_summary_says_what_is_known(kept, slices):
    half = kept.finish([0, 90])
    assert (half["complete"], half["problems"], half["solved"]) == (False, 20, 10)
    kept.keep(slices[90])
    whole = kept.finish([0, 90])
    assert (whole["complete"], whole["solved"], sum(whole["counts"].values())) == (True, 20, 20)
    assert sum(whole["shares"].values()) == pytest.approx(1.0)
    assert whole["max_residuals"]["position_m"] < 1e-9
    assert set(whole["slices"]) == {"0", "90"}
    assert json.loads((kept.path / "words.json").read_text()) == json.loads(json.dumps(whole))


def test_leftovers_of_a_killed_run_are_removed(kept):
    left = kept.path / "slices" / ".090.npz.12345678.tmp"
    left.write_bytes(b"half")
    WordsDirectory(kept.path, GRID)
    assert not left.exists()


def test_another_grid_is_refused(kept):
    with pytest.raises(InputError, match="another grid"):
        WordsDirectory(kept.path, WordGrid((-1.0, 1.0), (3.0, 3.5), 0.25))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04junk", b"no archive at all"])
def test_a_damaged_slice_is_refused(kept, content):
    (kept.path / "slices" / "000.npz").write_bytes(content)
    with pytest.raises(MotionFileError, match=r"000\.npz: is damaged"):
        WordsDirectory(kept.path, GRID)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("costs", lambda a: a + 1e-3),
        ("shapes", lambda a: -a),
        ("turns", lambda a: a + 0.1),
        ("lengths", lambda a: a[:3]),
    ],
)
def test_a_slice_whose_paths_miss_their_goals_is_refused(kept, slices, name, change):
    arrays = {key: getattr(slices[0], key) for key in ("turns", "shapes", "lengths", "costs")}
    np.savez(kept.path / "slices" / "000.npz", **(arrays | {name: change(arrays[name])}))
    with pytest.raises(MotionFileError, match="is damaged"):
        WordsDirectory(kept.path, GRID)


@pytest.mark.parametrize("text", ["", "[]", "{}", "{"])
def test_a_damaged_summary_is_refused(kept, text):
    (kept.path / "words.json").write_text(text)
    with pytest.raises(MotionFileError, match="is damaged"):
        WordsDirectory(kept.path, GRID)


def test_a_directory_of_something_else_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(MotionFileError, match=r"notes\.txt"):
        WordsDirectory(tmp_path, GRID)
    with pytest.raises(MotionFileError, match="is a file"):
        WordsDirectory(tmp_path / "notes.txt", GRID)
