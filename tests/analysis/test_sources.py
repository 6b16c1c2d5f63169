"""Recordings among files and folders."""

import pytest

from manikin.analysis.analyze import recordings_in
from manikin.errors import InputError


def test_folders_are_searched_and_files_are_taken_as_they_are(tmp_path):
    for name in ("b/walk.bvh", "a/run.C3D", "a/run.mot", "b/notes.txt", "a/person.asf"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert recordings_in([tmp_path]) == (tmp_path / "a/run.C3D", tmp_path / "b/walk.bvh")
    odd = tmp_path / "b/notes.txt"
    assert recordings_in([odd, tmp_path / "b", tmp_path]) == (
        odd, tmp_path / "b/walk.bvh", tmp_path / "a/run.C3D",
    )  # fmt: skip


def test_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"no\.bvh: there is no such file"):
        recordings_in([tmp_path / "no.bvh"])
    with pytest.raises(InputError, match=r"holds no recording; valid: files \.bvh, \.amc, \.c3d, \.trc"):
        recordings_in([tmp_path])
