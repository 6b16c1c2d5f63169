"""A requirement holds up to its limit and its rounding, and not beyond."""

import math

import pytest

from manikin.runtime.requirement import Requirement, requirement_table


def row(measured, sense, limit, **further):
    return Requirement("key", "error", "m", measured, sense, limit, **further)


@pytest.mark.parametrize(
    ("measured", "sense", "limit", "held"),
    [
        (1.0, "<=", 1.0, True), (math.nextafter(1.0, 2.0), "<=", 1.0, False),
        (1.0, ">=", 1.0, True), (math.nextafter(1.0, 0.0), ">=", 1.0, False),
        (1e-300, ">", 0.0, True), (0.0, ">", 0.0, False),
    ],
)  # fmt: skip
def test_the_limit_itself_holds_unless_more_is_asked_for(measured, sense, limit, held):
    assert row(measured, sense, limit).held is held


@pytest.mark.parametrize("sense", ["<=", ">=", ">"])
def test_what_could_not_be_measured_does_not_hold(sense):
    assert not row(math.nan, sense, 0.0).held


def test_rounding_is_allowed_to_both_sides():
    assert row(1.0 + 1e-6, "<=", 1.0, tolerance=2e-6).held
    assert row(1.0 - 1e-6, ">=", 1.0, tolerance=2e-6).held
    assert not row(1.0 - 3e-6, ">=", 1.0, tolerance=2e-6).held


def test_a_table_names_the_first_that_is_broken():
    rows = [row(0.0, "<=", 1.0), None, row(2.0, "<=", math.inf), row(2.0, "<=", 1.0, where="left_foot")]
    table = requirement_table(rows)
    assert len(table) == 2
    assert not table.held
    assert table.broken == {"key"}
    assert table.first_broken.reason == "error of left_foot is 2 m; allowed <= 1 m"
    assert table.first_broken.as_dict("execution")["held"] is False
    assert requirement_table(rows[:1]).first_broken is None
