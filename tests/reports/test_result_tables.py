"""Tables of the documentation: results, and beams beside people."""

import importlib.util
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from manikin.pipeline.batch import counts
from manikin.reports.summary_table import HEADER, result_rows

spec = importlib.util.spec_from_file_location(
    "result_tables", Path(__file__).resolve().parents[2] / "docs/result_tables.py"
)
tables = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tables)

PUBLISHED = {"lowest_com_m": {"H1": 0.85, "H2": 0.80}, "beam_height_m": {"H1": 1.45, "H2": 1.30}}


def a_run(scenario, variant=None, **changes):
    run = {
        "scenario": scenario if variant is None else f"{scenario}@{variant}", "variant": variant,
        "expected": "success", "as_expected": True, "verdict": "proved", "planned": True, "proved": True,
        "succeeded": True, "failure": None, "wall_s": 9.0,
        "stature_m": 1.75, "mass_kg": 79.0, "seed": 0,
        "centroidal": {
            "duration_s": 5.0, "min_margin": 30.123456, "margin_unit": "N.m", "feasibility_radius": 70.0,
            "wall_s": 1.0,
        },
        "wholebody": {
            "min_clearance_m": 0.02, "min_margin": 20.5, "lowest_com_m": 0.7434, "head_clearance_m": 0.0312,
            "seed_matters": False, "wall_s": 5.0,
        },
        "execution": {
            "min_margin": 17.123456, "com_rms_error_m": 7e-5, "lowest_com_m": 0.742,
            "head_clearance_m": 0.031, "fell": False, "wall_s": 3.0,
        },
    }  # fmt: skip
    return {**run, **changes}


def a_report(*runs, **asked):
    return {
        "stature_m": None, "seed": None, **asked, "runs": list(runs), **counts(runs), "wall_s": 10.0,
    }  # fmt: skip


def cells(table):
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


MISSED = {"stage": "wholebody", "reason": "no posture", "time_s": 1.0, "where": ""}
STOPPED = a_run("beam-H1C1", as_expected=False, succeeded=False, failure=MISSED, execution=None)


def test_beams_stand_beside_people_and_infeasible_variants_are_left_out():
    low = a_run("beam-H1C1", "knee-high", expected="failure")
    table = cells(tables.beam_table(a_report(a_run("beam-H2C1", "S2"), low, a_run("platform")), PUBLISHED))
    assert table == [["beam-H2C1", "S2", "1.30", "0.80", "0.74", "0.74", "31.2", "31.0"]]


def test_what_was_not_measured_is_left_blank():
    assert cells(tables.beam_table(a_report(STOPPED), PUBLISHED))[0][-3:] == ["-", "31.2", "-"]
    old = a_run("beam-H1C1", execution={"min_margin": 1.0})
    assert cells(tables.beam_table(a_report(old), PUBLISHED))[0][-1] == "-"


def test_markdown_rows_have_as_many_cells_as_the_header():
    report = a_report(
        a_run("platform"), {**STOPPED, "failure": {"stage": "centroidal", "reason": "no | margin\nat all"}}
    )
    lines = tables.markdown_table(report).splitlines()
    assert len(lines) == 2 + 2
    assert {line.replace("\\|", "").count("|") for line in lines} == {len(HEADER) + 1}


def test_the_reduced_report_gives_the_same_table_but_for_rounding():
    full = a_report(a_run("platform"), a_run("walk", "slippery"))
    full["runs"][0]["wholebody"]["closest_pair"] = ["a", "b"]
    small = tables.reduced(full)
    assert small["runs"][0]["centroidal"]["min_margin"] == 30.12
    assert "closest_pair" not in small["runs"][0]["wholebody"]
    assert result_rows(small) == result_rows(full)
    assert tables.reduced({**small}) == small


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=1e-30, max_value=1e30))
def test_rounding_keeps_four_digits(value):
    assert abs(tables._rounded(value) - value) <= 0.5001e-3 * value
    assert tables._rounded(tables._rounded(value)) == tables._rounded(value)
