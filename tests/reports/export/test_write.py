"""Choosing and writing an export; CSV; resampling."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from manikin.errors import InputError, MotionFileError
from manikin.motion.file import MotionFile
from manikin.reports.export import export_motion, pick_motion, resample, to_csv


def test_csv_holds_every_number_under_its_name(finished_run):
    motion = finished_run.executed
    rows = list(csv.reader(to_csv(motion).splitlines()))
    header = rows[0]
    table = np.array(rows[1:], dtype=float)
    column = {name: table[:, index] for index, name in enumerate(header)}
    assert len(set(header)) == len(header)
    assert all(name.endswith("]") for name in header)
    # 9 significant digits are written: 5e-10 of a value near one.
    np.testing.assert_allclose(column["time [s]"], motion.time, rtol=1e-8)
    np.testing.assert_allclose(column["com_z [m]"], motion.com[:, 2], rtol=1e-8)
    np.testing.assert_allclose(column["margin [N.m]"], motion.margin, rtol=1e-8)
    np.testing.assert_allclose(column["right_foot_force_z [N]"], motion.contact_force[:, 1, 2], rtol=1e-8)
    np.testing.assert_array_equal(column["left_foot_support [-]"], motion.support[:, 0])
    for index, name in enumerate(motion.joint_names):
        np.testing.assert_allclose(column[f"{name} [rad]"], motion.q[:, 7 + index], rtol=1e-8, atol=1e-12)


def test_executed_motion_is_the_default_and_others_can_be_asked_for(finished_run):
    assert pick_motion(finished_run) is finished_run.executed
    assert pick_motion(finished_run, "planned") is finished_run.planned
    assert pick_motion(replace(finished_run, executed=None)) is finished_run.planned
    with pytest.raises(InputError, match="valid here: planned, executed"):
        pick_motion(finished_run, "recorded")


def test_files_go_beside_the_motion_or_where_they_are_wanted(finished_run, tmp_path):
    assert export_motion(finished_run, tmp_path, "csv") == tmp_path / "motion.csv"
    assert export_motion(finished_run, tmp_path / "motion.h5", "bvh") == tmp_path / "motion.bvh"
    assert export_motion(finished_run, tmp_path, "bvh", out=tmp_path / "a.bvh", rate=30.0).exists()
    # 5.19 s at 30 Hz and at 100 Hz
    assert "Frames: 156\n" in (tmp_path / "a.bvh").read_text()
    assert "Frames: 520\nFrame Time: 0.01\n" in (tmp_path / "motion.bvh").read_text()


def test_bad_requests_give_one_line(finished_run, tmp_path):
    for format_name in ("gltf", "avi", "BVH", ""):
        with pytest.raises(InputError, match="valid: bvh, csv"):
            export_motion(finished_run, tmp_path, format_name)
    with pytest.raises(InputError, match="rate"):
        export_motion(finished_run, tmp_path, "csv", rate=0.0)
    with pytest.raises(InputError, match="rate"):
        export_motion(finished_run, tmp_path, "csv", rate=float("nan"))
    with pytest.raises(MotionFileError, match="no body"):
        export_motion(MotionFile(finished_run.planned), tmp_path, "bvh")
    with pytest.raises(MotionFileError, match="cannot be written"):
        export_motion(finished_run, tmp_path, "csv", out=tmp_path / "none" / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_resampling_keeps_the_samples_it_meets(finished_run):
    motion = finished_run.executed
    half = resample(motion, 100.0)
    np.testing.assert_allclose(half.time[:500], motion.time[:1000:2], atol=1e-15)
    for name in set(half.arrays()) - {"time"}:
        np.testing.assert_array_equal(half.arrays()[name][:500], motion.arrays()[name][:1000:2], err_msg=name)
    assert resample(motion, None) is motion


def test_rotations_are_resampled_on_the_great_arc(finished_run):
    body = finished_run.body
    rng = np.random.default_rng(0)
    n = 12
    rotations = Rotation.random(n, rng=rng)
    q = np.tile(body.standing_posture(), (n, 1))
    q[:, 3:7] = rotations.as_quat() * rng.choice([-1.0, 1.0], n)[:, None]
    arrays = {name: array[:n] for name, array in finished_run.executed.arrays().items()}
    motion = replace(finished_run.executed, **{**arrays, "q": q, "time": np.arange(n) * 0.1})
    fine = resample(motion, 70.0)
    wanted = Slerp(motion.time, rotations)(fine.time)
    error = (wanted.inv() * Rotation.from_quat(fine.q[:, 3:7])).magnitude()
    # Angles near zero come from a difference of ones: square root of rounding.
    assert error.max() < 1e-7
    np.testing.assert_allclose(np.linalg.norm(fine.q[:, 3:7], axis=1), 1.0, atol=1e-12)


def test_single_sample_can_be_exported(finished_run, tmp_path):
    arrays = {name: array[:1] for name, array in finished_run.planned.arrays().items()}
    content = replace(finished_run, planned=replace(finished_run.planned, **arrays), executed=None)
    for format_name in ("bvh", "csv"):
        assert export_motion(content, tmp_path, format_name).stat().st_size > 0
