"""The table of many runs, and the verdict of each."""

from manikin.pipeline.batch import counts
from manikin.reports.summary_table import HEADER, counts_line, result_rows, text_table, verdict_line

GOOD = {
    "scenario": "platform", "variant": None, "expected": "success", "as_expected": True,
    "verdict": "proved", "planned": True, "proved": True, "succeeded": True, "failure": None,
    "wall_s": 9.04321,
    "centroidal": {
        "method": "timing-free", "duration_s": 4.99999988, "min_margin": 24.334567, "margin_unit": "N.m",
        "feasibility_radius": 69.34321, "wall_s": 0.71234,
    },
    "wholebody": {"min_clearance_m": 0.0241512, "closest_pair": ["a", "b"], "wall_s": 3.31234},
    "execution": {
        "min_margin": 20.61234, "min_force_at_com_N": 29.71, "min_zmp_distance_m": 0.03262,
        "com_rms_error_m": 7.0e-5, "fell": False, "wall_s": 1.2987,
    },
}  # fmt: skip
POINT_MASS = {
    **GOOD, "scenario": "walls@trial-4", "variant": "trial-4", "wholebody": None, "execution": None,
    "verdict": "planned", "proved": False,
    "centroidal": {**GOOD["centroidal"], "min_margin": 280.6, "margin_unit": "N"},
}  # fmt: skip
BAD = {
    **POINT_MASS, "scenario": "platform@slippery", "variant": "slippery", "succeeded": False,
    "verdict": "failed", "planned": False,
    "expected": "failure", "as_expected": True,
    "failure": {"stage": "centroidal", "reason": "no | margin\nat all", "time_s": 0.0, "where": "phase 1"},
    "centroidal": {**GOOD["centroidal"], "duration_s": None, "min_margin": None, "feasibility_radius": None},
}  # fmt: skip
REPORT = {"runs": [GOOD, POINT_MASS, BAD], "wall_s": 12.345678, **counts([GOOD, POINT_MASS, BAD])}


def test_a_row_says_what_the_run_measured():
    assert result_rows(REPORT)[0] == (
        "platform", "-", "5.00", "24.3 N.m", "69.3", "24.2", "20.6", "30", "33", "0.07", "no",
        "0.7 + 3.3 + 1.3", "yes", "yes", "proved",
    )  # fmt: skip


def test_stages_that_did_not_run_are_left_blank():
    row = dict(zip(HEADER, result_rows(REPORT)[1], strict=True))
    assert row["planned margin"] == "280.6 N"
    assert (row["scenario"], row["variant"]) == ("walls", "trial-4")
    assert {row[name] for name in ("clearance", "executed margin", "CoM rms", "fell")} == {"-"}


def test_failures_say_whether_they_were_expected():
    expected, surprise = BAD, {**BAD, "as_expected": False}
    rows = result_rows({"runs": [expected, surprise]})
    assert rows[0][-1].startswith("failed as expected (centroidal): ")
    assert rows[1][-1].startswith("FAILED (centroidal): ")
    late = {**GOOD, "as_expected": False}
    assert result_rows({"runs": [late]})[0][-1] == "proved although a failure was expected"


FALLEN = {
    **GOOD, "verdict": "failed", "proved": False, "succeeded": False,
    "failure": {"stage": "execution", "reason": "fell at 27.6 s", "time_s": 27.6, "where": "phase 1"},
    "execution": {**GOOD["execution"], "fell": True},
}  # fmt: skip
"""Its plan keeps every requirement, its execution falls."""


def test_planned_and_proved_are_counted_apart_and_a_fall_is_no_success():
    runs = [GOOD, POINT_MASS, BAD, {**FALLEN, "expected": "failure"}]
    found = {"runs": runs, "wall_s": 1.0, **counts(runs)}
    assert counts(runs) == {
        "planned": 3, "proved": 1, "succeeded": 2, "failed": 2, "fell": 1, "as_expected": 4,
        "not_as_expected": 0,
    }  # fmt: skip
    assert counts_line(found).startswith("4 runs: 3 planned, 1 proved; 2 succeeded, 2 failed (1 fell); ")
    row = dict(zip(HEADER, result_rows({"runs": [FALLEN]})[0], strict=True))
    assert (row["planned"], row["proved"], row["fell"]) == ("yes", "no", "yes")
    assert row["result"] == "failed as expected (execution): fell at 27.6 s"


def test_the_verdict_says_first_what_failed():
    assert verdict_line(FALLEN).startswith("failed: fell at 27.6 s (platform, execution, after a plan")
    assert verdict_line(GOOD).startswith("proved: platform, ")
    assert verdict_line(POINT_MASS).startswith("planned: walls@trial-4, not executed")
    assert verdict_line(BAD).startswith("failed: no | margin")


def test_text_columns_are_aligned():
    lines = text_table(REPORT).splitlines()
    column = lines[0].index("variant")
    assert lines[3][column:].startswith("trial-4")
