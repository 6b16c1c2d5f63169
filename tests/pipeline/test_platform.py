"""The main job, end to end on the real scenario, whose run the tests share."""

import json
from dataclasses import replace

import numpy as np
import pytest

from manikin.ergonomics import lowest_margin
from manikin.motion.file import read_motions
from manikin.pipeline.runner import run
from manikin.pipeline.stages import ExecutionRequirements
from manikin.scenarios import load_scenario
from manikin.scene import Proximity, Scene
from manikin.simulation.execution import PushOutcome

KEYS = {
    "centroidal": {
        "method", "duration_s", "phase_durations_s", "min_margin", "margin_unit", "limiting_phase",
        "limiting_contact", "feasibility_radius", "wall_s", "min_force_at_com_N", "min_zmp_distance_m",
    },
    "wholebody": {
        "max_support_error_m", "max_meeting_error_m", "max_com_error_m", "min_clearance_m", "max_scuff_m",
        "closest_pair",
        "max_joint_limit_violation_rad", "seed_matters", "lowest_com_m", "head_clearance_m", "wall_s",
        "naturalness",
        "min_margin", "min_force_at_com_N", "min_zmp_distance_m",
    },
    "execution": {
        "fell", "com_rms_error_m", "com_max_error_m", "max_foot_error_m", "final_com_error_m", "min_margin",
        "max_penetration_m", "max_padding_compression_m", "peak_torque_Nm", "realtime_factor",
        "lowest_com_m", "head_clearance_m", "push", "wall_s", "min_force_at_com_N", "min_zmp_distance_m",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def platform(runs):
    return runs("platform")


@pytest.mark.slow
def test_the_platform_is_planned_and_stood_on(platform):
    """Every threshold is a requirement of the scenario (metres, newton metres, seconds)."""
    summary = platform.summary
    assert summary["succeeded"], summary["failure"]
    assert (summary["stature_m"], summary["mass_kg"], summary["seed"]) == (1.75, 79.0, 0)
    com, body, executed = summary["centroidal"], summary["wholebody"], summary["execution"]
    assert com["min_margin"] >= 20.0
    assert com["duration_s"] <= 5.0
    assert body["max_support_error_m"] <= 1e-3
    assert body["max_com_error_m"] <= 2e-3
    assert body["min_clearance_m"] >= 0.01
    assert body["max_joint_limit_violation_rad"] <= 1e-9
    assert not executed["fell"]
    assert executed["com_rms_error_m"] <= 0.015
    assert executed["max_foot_error_m"] <= 0.02
    assert executed["min_margin"] > 0.0
    assert executed["max_penetration_m"] <= 0.005


@pytest.mark.slow
def test_the_body_stands_for_a_second_after_the_end(platform):
    executed, planned = platform.executed, platform.planned
    assert executed.time[-1] >= planned.time[-1] + 0.99
    rest = executed.time > planned.time[-1] + 0.5
    np.testing.assert_allclose(executed.com[rest], planned.com[-1] * np.ones((rest.sum(), 1)), atol=5e-3)
    assert np.all(executed.support[rest])


@pytest.mark.slow
def test_arms_hang_at_rest(platform):
    """Elbows are bent by 10 to 30 degrees before and after, as those of people who stand.

    Upper arms hang at the start, where the body stands upright.
    """
    motion, body = platform.executed, load_scenario("platform").build_body()
    for side in ("left", "right"):
        elbow = np.rad2deg(motion.q[[0, -1], 7 + body.joint_index(f"{side}_elbow_flexion")])
        shoulder = np.rad2deg(motion.q[0, 7 + body.joint_index(f"{side}_shoulder_flexion")])
        assert ((elbow >= 10.0) & (elbow <= 30.0)).all()
        assert abs(shoulder) <= 20.0


@pytest.mark.slow
def test_the_head_keeps_clear_of_the_roof(platform):
    """Least distance of the executed head, every 20 ms; the summary has that of every 5 ms."""
    scenario = load_scenario("platform")
    body = scenario.build_body()
    roof = Scene([item for item in scenario.build_scene() if item.name == "roof"], floor_height=None)
    proximity = Proximity(body, roof, self_collision=False)
    others = frozenset((segment.name, "roof") for segment in body.segments if segment.name != "head")
    clearance = min(proximity.minimum(q, others).distance for q in platform.executed.q[::4])
    told = platform.summary["execution"]["head_clearance_m"]
    assert 0.02 <= told <= clearance + 1e-5
    assert clearance < told + 0.01


@pytest.mark.slow
def test_executed_forces_carry_the_weight_at_the_end(platform):
    """Standing still, the measured contact forces sum to the weight (within 1 %)."""
    vertical = platform.executed.contact_force[-1, :, 2].sum()
    assert vertical == pytest.approx(79.0 * 9.81, rel=0.01)


@pytest.mark.slow
def test_the_summary_has_the_documented_keys_and_is_on_disk(platform):
    for stage, keys in KEYS.items():
        assert keys <= set(platform.summary[stage])
    on_disk = json.loads((platform.directory / "summary.json").read_text())
    assert on_disk["succeeded"] is True
    assert on_disk["centroidal"] == json.loads(json.dumps(platform.summary["centroidal"]))


@pytest.mark.slow
def test_the_motion_file_holds_both_motions(platform):
    content = read_motions(platform.directory / "motion.h5")
    assert np.array_equal(content.planned.q, platform.planned.q)
    assert np.array_equal(content.executed.margin, platform.executed.margin)
    assert content.body.mass == pytest.approx(79.0)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["planned", "executed"])
def test_the_lowest_margin_is_explained_as_in_the_summary(platform, which):
    """Found again from the file, by the planned contacts and from the effectors alone.

    The execution's lowest margin may be at another instant: it is that of a foot that stands then. It counts
    the points that carried; the whole soles of the plan give it to a tenth.
    """
    content = read_motions(platform.directory / "motion.h5")
    motion = content.motions[which]
    stage = "wholebody" if which == "planned" else "execution"
    for schedule in (content.schedule, None):
        found = lowest_margin(content.body, motion, schedule)
        assert found.value == pytest.approx(platform.summary[stage]["min_margin"], abs=1e-9)
        assert found.reproduced or which == "executed"
        assert found.again == pytest.approx(found.value, rel=0.1)
        expected = platform.summary["centroidal"]["limiting_contact"]
        told = found.limiting.description
        if which == "planned":
            assert told == expected
        else:
            stands = motion.support[int(np.argmin(np.abs(motion.time - found.time)))]
            foot = ("left_foot", "right_foot").index(told.split(":")[0])
            assert stands[foot]


@pytest.mark.long
@pytest.mark.slow
def test_the_resolved_scenario_runs_again_to_the_same_bits_with_another_seed(platform, runs):
    """A run that draws no numbers says so, and its seed changes nothing, each in its own process."""
    again = runs(str(platform.directory / "scenario.yaml"), seed=7)
    assert not platform.summary["wholebody"]["seed_matters"]
    assert np.array_equal(again.planned.q, platform.planned.q)
    assert np.array_equal(again.executed.q, platform.executed.q)
    assert np.array_equal(again.executed.contact_force, platform.executed.contact_force)


@pytest.mark.long
@pytest.mark.slow
def test_an_executed_run_is_a_recording_for_the_keyframe_method(platform, tmp_path):
    """Same timing to half a control step, same CoM at the key frames, executed without falling."""
    file = tmp_path / "again.yaml"
    file.write_text(
        f"extends: platform\nname: again\nplanning: {{method: keyframes, recording: {platform.directory}}}\n"
    )
    result = run(file, out=tmp_path / "again")
    assert result.succeeded, result.summary["failure"]
    instants = result.centroidal.key_instants
    np.testing.assert_allclose(instants, platform.centroidal.key_instants, atol=2.5e-3)
    samples = np.searchsorted(platform.executed.time, instants - 1e-9)
    com = result.transform_task_to_world.points(result.centroidal.trajectory.position(instants))
    np.testing.assert_allclose(com, platform.executed.com[samples], rtol=0, atol=1e-9)
    assert result.summary["centroidal"]["method"] == "keyframes"
    assert result.summary["centroidal"]["min_margin"] >= 20.0
    assert result.summary["execution"]["min_margin"] > 0.0


@pytest.mark.slow
def test_an_execution_that_misses_its_requirement_is_a_failure(platform):
    requirements = ExecutionRequirements(margin=1e6)
    (broken,) = [row for row in requirements.table(platform.execution) if not row.held]
    assert broken.reason.startswith("executed margin is ")
    assert broken.time_s == platform.execution.motion.time[np.argmin(platform.execution.motion.margin)]
    broken = ExecutionRequirements(foot_error=1e-9).table(platform.execution).first_broken
    assert f"error of {platform.execution.worst_effector} is" in broken.reason
    assert broken.time_s == platform.execution.worst_effector_time_s


@pytest.mark.slow
def test_only_a_walk_may_be_out_of_balance_for_some_control_steps(platform):
    """One step of a hundred out of balance is allowed in a walk, five are not, and none is after it."""
    motion = platform.execution.motion
    count, end = len(motion.time), float(motion.time[-1])
    half = float(motion.time[count // 2])

    def broken(steps, walked):
        margin = np.array(motion.margin)
        margin[steps] = -1.0
        execution = replace(platform.execution, motion=replace(motion, margin=margin))
        row = ExecutionRequirements().table(execution, walked=walked).first_broken
        return None if row is None else row.key

    few, more, last = slice(0, count // 100), slice(0, count // 20), slice(count - 1, count)
    assert broken(few, -np.inf) == "min_margin"
    assert broken(few, end) is None
    assert broken(more, end) == "margin_share"
    assert broken(few, half) is None
    assert broken(last, half) == "min_margin"


@pytest.mark.slow
def test_a_pushed_walk_has_to_end_where_it_was_planned(platform):
    """Steps that catch a body move its walk: by 10 cm at most; what was not walking has no such end."""
    outcome = PushOutcome(15.0, 0.0, 1.0, True, 0.2, 2.0, 0.0, 0.01)
    table, end = ExecutionRequirements().table, float(platform.execution.motion.time[-1])
    near, far = (
        replace(platform.execution, push=outcome, final_com_error_m=0.0, moved_m=moved)
        for moved in (0.09, 0.11)
    )
    assert table(near, walked=end).first_broken is None
    assert table(far, walked=end).first_broken.key == "moved_m"
    assert "moved_m" not in {row.key for row in table(far)}
