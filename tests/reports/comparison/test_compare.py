"""Comparisons: zero for the same run, the difference that was put in, and what cannot be matched."""

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point
from manikin.errors import FigureError
from manikin.motion.file import MotionFile
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.alignment import align_phases, timing_rows
from manikin.reports.comparison import compare_runs
from manikin.reports.comparison_tables import report
from manikin.reports.figures import COMPARISONS, write_figures

LEFT, RIGHT = point("left_foot", (0, 0.1, 0), friction=0.7), point("right_foot", (0, -0.1, 0), friction=0.7)
KINDS = {"l": [LEFT], "r": [RIGHT], "b": [LEFT, RIGHT], "-": []}


def stances(text):
    return [Stance(KINDS[letter], 1000.0) for letter in text]


def text_of(comparison):
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(report(comparison))
    return console.export_text()


def slowed(record, factor, **changes):
    """The same run, ``factor`` times slower."""
    schedule = ContactSchedule(record.schedule.sequence, factor * record.schedule.instants)
    motions = {
        name: replace(motion, time=factor * motion.time, **changes) for name, motion in record.motions.items()
    }
    return replace(record, label="slowed", content=replace(record.content, schedule=schedule, **motions))


@pytest.fixture(scope="module")
def run(finished_run):
    time = np.linspace(0.0, 4.193, 500)
    com = np.column_stack([0.1 * time, 0.0 * time, 0.9 + 0.0 * time])
    plan = ComTrack(time, com, np.gradient(com, time, axis=0), 0.0 * com, 30.0 + np.sin(time), "N.m")
    summary = {"scenario": "platform", "succeeded": True, "failure": None}
    return RunRecord("platform", finished_run, summary, finished_run.body.mass, plan)


def test_a_run_compared_with_itself_differs_in_nothing(run):
    found = compare_runs(run, run).as_dict()
    assert found["unmatched"] == []
    assert found["matched_phases"] == 7
    assert found["duration_difference_s"] == 0.0
    assert [row["duration_difference_s"] for row in found["timing"]] == [0.0] * 7
    for stage in ("point_mass", "planned", "executed"):
        assert found["com"][stage]["max_distance_m"] == 0.0
        assert found["com"][stage]["mean_difference_m"] == [0.0, 0.0, 0.0]
        assert found["margins"][stage]["min_difference"] == 0.0
        assert all(phase["difference"] == 0.0 for phase in found["margins"][stage]["phases"])
    assert found["postures_of"] == "executed"
    assert len(found["postures"]) == 8
    assert all(posture["rms_deg"] == 0.0 for posture in found["postures"])
    assert found["first"]["run"] != found["second"]["run"]


def test_a_slower_run_differs_in_its_durations_alone(run):
    """Phases are compared at equal shares: the path and the margins of the slowed motion are the same."""
    found = compare_runs(run, slowed(run, 2.0)).as_dict()
    durations = run.schedule.durations
    np.testing.assert_allclose(
        [row["duration_difference_s"] for row in found["timing"]], durations, atol=1e-12
    )
    assert found["duration_difference_s"] == pytest.approx(4.193)
    # Linear interpolation of a 200 Hz recording at slightly other places: 3 mm sin(9 t) bends by 0.24 m/s^2.
    assert found["com"]["executed"]["max_distance_m"] < 1e-6
    assert all(posture["rms_deg"] < 1e-9 for posture in found["postures"])


def test_differences_are_second_less_first(run):
    """The second body stands 5 cm higher, bends one knee by 0.3 rad more and has 4 N.m more margin."""
    planned = run.motions["planned"]
    knee = 7 + planned.joint_names.index("left_knee_flexion")
    q = planned.q.copy()
    q[:, knee] += 0.3
    other = replace(planned, q=q, com=planned.com + np.array([0.0, 0.0, 0.05]), margin=planned.margin + 4.0)
    first = replace(run, content=replace(run.content, executed=None))
    second = replace(first, label="other", content=replace(first.content, planned=other))
    found = compare_runs(first, second).as_dict()
    np.testing.assert_allclose(found["com"]["planned"]["mean_difference_m"], [0.0, 0.0, 0.05], atol=1e-12)
    assert found["com"]["planned"]["max_distance_m"] == pytest.approx(0.05, abs=1e-12)
    assert found["margins"]["planned"]["min_difference"] == pytest.approx(4.0)
    largest = found["postures"][2]["largest"][0]
    assert largest["joint"] == "left_knee_flexion"
    assert largest["difference_deg"] == pytest.approx(np.rad2deg(0.3))
    assert found["postures"][2]["rms_deg"] == pytest.approx(
        np.rad2deg(0.3) / np.sqrt(len(planned.joint_names))
    )
    assert "left knee flexion +17.2" in text_of(compare_runs(first, second))


def test_a_run_that_failed_is_compared_as_far_as_it_got(run):
    failure = {"stage": "execution", "reason": "fell", "time_s": 2.0, "where": "phase 4"}
    fallen = replace(run, label="fallen", content=replace(run.content, executed=None),
                     summary={"scenario": "platform", "succeeded": False, "failure": failure})  # fmt: skip
    found = compare_runs(run, fallen).as_dict()
    assert found["com"]["executed"] is None
    assert found["postures_of"] == "planned"
    assert found["unmatched"] == ["the second run has no executed motion (it failed in execution: fell)"]
    nothing = RunRecord("nothing", MotionFile(), {"scenario": "platform", "failure": failure})
    found = compare_runs(nothing, run).as_dict()
    assert found["timing"] is None
    assert found["postures"] is None
    assert any("first run has no contact schedule" in line for line in found["unmatched"])
    assert "not compared: the first run has no planned point mass" in text_of(compare_runs(nothing, run))
    assert "neither run has a centre of mass" in compare_runs(nothing, nothing).unmatched


def test_margins_of_different_units_are_shown_and_not_subtracted(run):
    other = replace(run, label="newtons", plan=replace(run.plan, margin_unit="N"))
    comparison = compare_runs(run, other)
    margins = comparison.as_dict()["margins"]["point_mass"]
    assert (margins["unit"], margins["min_difference"]) == (None, None)
    assert margins["min_first"] == margins["min_second"]
    assert "margins of the planned point mass are in N.m and in N" in comparison.unmatched
    assert "N.m / N" in text_of(comparison)


def test_other_scenarios_are_matched_by_their_supports(run):
    """Of the seven phases the other run has the first three, then a flight."""
    phases = [*run.schedule.sequence.phases[:3], Phase(Stance([], 1000.0))]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.4, 0.8, 1.2, 1.5])
    other = RunRecord("other", MotionFile(schedule=schedule), {"scenario": "other", "succeeded": True})
    comparison = compare_runs(run, other)
    found = comparison.as_dict()
    assert found["matched_phases"] == 3
    assert [row["supports"] for row in found["timing"] if row["first"] is None] == [[]]
    assert "phase 3 of the second run (no contact) has no match in the first" in found["unmatched"]
    assert "phase 5 of the first run (right_foot) has no match in the second" in found["unmatched"]
    assert "flight" in text_of(comparison)


def test_phases_are_aligned_in_order_and_as_many_as_possible():
    pairs = align_phases(stances("blbrb"), stances("brb"))
    matched = [pair for pair in pairs if None not in pair]
    assert [number for _, number in matched] == [0, 1, 2]
    assert matched[1:] == [(3, 1), (4, 2)]


def test_between_two_matches_the_nearer_contacts_decide():
    far = Stance([point("left_foot", (2.0, 0.1, 0), friction=0.7)], 1000.0)
    near = stances("l")[0]
    pairs = align_phases([far, near], [near])
    assert pairs == [(0, None), (1, 0)]


@given(st.text("lrb-", max_size=7), st.text("lrb-", max_size=7))
def test_an_alignment_holds_every_phase_once_in_order(one, other):
    pairs = align_phases(stances(one), stances(other))
    assert [first for first, _ in pairs if first is not None] == list(range(len(one)))
    assert [second for _, second in pairs if second is not None] == list(range(len(other)))
    matched = [pair for pair in pairs if None not in pair]
    assert all(one[first] == other[second] for first, second in matched)
    assert len(matched) == longest_common(one, other)


def longest_common(one, other):
    """Length of the longest common subsequence, by its definition."""
    if not one or not other:
        return 0
    if one[0] == other[0]:
        return 1 + longest_common(one[1:], other[1:])
    return max(longest_common(one[1:], other), longest_common(one, other[1:]))


def test_timing_rows_hold_the_key_instants(run):
    schedule = run.schedule
    rows = timing_rows(schedule, schedule)
    np.testing.assert_array_equal([row.first.start_s for row in rows], schedule.instants[:-1])
    np.testing.assert_array_equal([row.second.end_s for row in rows], schedule.instants[1:])


def test_figures_of_two_runs(run, tmp_path):
    written = write_figures(compare_runs(run, slowed(run, 1.5)), tmp_path)
    assert [path.stem for path in written] == list(COMPARISONS)
    bars = COMPARISONS["compare_timing"](compare_runs(run, slowed(run, 1.5))).axes[1].patches
    heights = [bar.get_height() for bar in bars]
    np.testing.assert_allclose(heights[1::2], 1.5 * run.schedule.durations)
    planes = COMPARISONS["compare_planes"](compare_runs(run, run)).axes[1]
    com = run.motions["planned"].com
    assert sum(np.array_equal(line.get_xydata(), com[:, [0, 2]]) for line in planes.get_lines()) == 2


def test_figures_that_two_runs_do_not_allow_are_left_out(run, tmp_path):
    nothing = RunRecord("nothing", MotionFile(), {})
    assert write_figures(compare_runs(run, nothing), tmp_path) == []
    for draw in COMPARISONS.values():
        with pytest.raises(FigureError, match="this figure needs"):
            draw(compare_runs(nothing, run))
