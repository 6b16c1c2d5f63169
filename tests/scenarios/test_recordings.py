"""Scenarios that name a recording: which files they take, and what they say about the others."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.errors import ScenarioError
from manikin.motion.file import write_motions
from manikin.scenarios import load_scenario


@pytest.fixture
def write(tmp_path, finished_run):
    """Write a motion file beside a scenario that names it, and load the scenario."""

    def write(text="", **changes):
        (tmp_path / "run").mkdir(exist_ok=True)
        write_motions(tmp_path / "run" / "motion.h5", replace(finished_run, **changes))
        file = tmp_path / "again.yaml"
        file.write_text(
            "extends: platform\nname: again\nplanning: {method: keyframes, recording: run}\n" + text
        )
        return load_scenario(file)

    return write


def test_timing_and_positions_are_the_executed_ones(write, finished_run):
    asked = write().build_keyframe_problem()
    time = finished_run.executed.time
    for found, wanted in zip(asked.recording.key_times, finished_run.schedule.instants, strict=True):
        assert abs(found - wanted) <= 0.5 * (time[1] - time[0]) + 1e-12
    frames = np.searchsorted(time, asked.recording.key_times - 1e-9)
    np.testing.assert_array_equal(
        asked.recording.com[asked.recording.key_frames], finished_run.executed.com[frames]
    )
    assert asked.control_points == 8 + 7
    assert asked.requirements.required_margin == load_scenario("platform").required_margin == 16.7


def test_a_planned_motion_will_do(write, finished_run):
    asked = write(executed=None).build_keyframe_problem()
    np.testing.assert_array_equal(asked.recording.com[0], finished_run.planned.com[0])


def test_without_a_schedule_the_support_table_gives_the_key_frames(write):
    with_schedule = write().build_keyframe_problem().recording
    without = write(schedule=None).build_keyframe_problem().recording
    # The table ends with the last sample, the schedule with the last key instant.
    np.testing.assert_allclose(without.key_times[:-1], with_schedule.key_times[:-1], atol=5.1e-3)


def test_heights_are_scaled_to_the_body(write):
    asked = write("body: {stature_m: 1.60}\n").build_keyframe_problem().recording
    reference = write().build_keyframe_problem().recording
    np.testing.assert_allclose(asked.com[:, :2], reference.com[:, :2])
    assert asked.com[0, 2] == pytest.approx(1.60 / 1.75 * reference.com[0, 2])
    # At the end the supports are 0.2 m high.
    assert asked.com[-1, 2] == pytest.approx(0.2 + 1.60 / 1.75 * (reference.com[-1, 2] - 0.2), abs=1e-6)


def test_the_resolved_scenario_names_the_file_for_good(write, tmp_path):
    assert str(tmp_path / "run") in write().to_yaml()


def test_other_methods_have_no_keyframe_problem():
    assert load_scenario("platform").build_keyframe_problem() is None


def refusal(scenario):
    with pytest.raises(ScenarioError) as error:
        scenario.build_keyframe_problem()
    assert "\n" not in str(error.value)
    assert "again.yaml" in str(error.value)
    assert "planning.recording" in str(error.value)
    return str(error.value)


def test_bad_recordings_are_refused_with_the_place(write, finished_run, tmp_path):
    motion = finished_run.executed
    com = motion.com.copy()
    com[17, 1] = np.nan
    assert "com" in refusal(write(executed=replace(motion, com=com)))
    nothing = np.zeros_like(motion.support)
    assert "without any support" in refusal(write(executed=replace(motion, support=nothing), schedule=None))
    assert "control_points is 9; valid: an integer >= 13" in refusal(
        write("").with_overrides(["planning.control_points=9"])
    )
    (tmp_path / "run" / "motion.h5").unlink()
    assert "there is no such file" in refusal(load_scenario(tmp_path / "again.yaml"))


def test_recordings_of_other_supports_are_refused(write):
    moved = write().with_overrides(["supports.phases.2.left_foot.position.0=0.25"])
    assert "left_foot was recorded at [0.2, 0.4, 0.0] in phase 2" in refusal(moved)
    shorter = write().with_overrides(["supports.phases.6=null"])
    assert "with 7 phases, the scenario has 6" in refusal(shorter)


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("planning.method=keyframes", "planning.recording is missing"),
        ("planning.recording=runs/platform", "only with keyframes"),
        ("planning.control_points=16", "only with keyframes"),
        ("planning.method=frames", "planning.method is 'frames'"),
        ("expect=nothing", "expect is 'nothing'"),
    ],
)
def test_keys_that_do_not_fit_are_refused(setting, says):
    with pytest.raises(ScenarioError, match=says):
        load_scenario("platform", overrides=[setting])
