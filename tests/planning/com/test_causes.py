"""Failures name their cause: friction, or feet too far apart."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance import wrench_polytope
from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.planning.com import CentroidalProblem, assess_feasibility
from manikin.planning.com.com_constraints import height_band
from manikin.planning.com.feasibility import best_margin_at, low_friction, polytopes_of, slipping_slope

SOLE = {"length": 0.28, "width": 0.12}


def stance(*feet, friction=0.7, slope=0.0):
    names = ("left_foot", "right_foot")
    normal = (-np.sin(slope), 0.0, np.cos(slope))
    contacts = [
        sole(name, place, 0.0, normal=normal, friction=friction, **SOLE)
        for name, place in zip(names, feet, strict=False)
        if place is not None
    ]
    return Stance(contacts, 2000.0)


def problem(stances, goal, **changes):
    sequence = StanceSequence([Phase(s, 0.3) for s in stances])
    return CentroidalProblem(70.0, sequence, (0.0, 0.0, 0.95), goal, **changes)


def failure_of(task):
    return assess_feasibility(task, polytopes_of(task)).failure


@given(st.floats(0.02, 0.6), st.floats(0.05, 1.0))
def test_standing_on_a_slope_needs_its_tangent_as_friction(slope, friction):
    """Coulomb along the line of greatest slope, one of the pyramid's axes; without a grey zone of 1 %."""
    if abs(np.tan(slope) / friction - 1.0) < 0.01:
        return
    held = stance((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), friction=friction, slope=slope)
    reason = slipping_slope(held, wrench_polytope(held), 70.0)
    assert (reason is not None) == (np.tan(slope) > friction)
    if reason is not None:
        assert f"{np.degrees(slope):.1f} degrees" in reason


def test_a_step_beyond_the_legs_is_named():
    """Feet 1.2 m apart leave the CoM at most sqrt(0.974^2 - 0.6^2) = 0.77 m high."""
    start, far = (0.0, 0.1, 0.0), (1.2, 0.1, 0.0)
    other = (0.0, -0.1, 0.0)
    band = height_band(lambda x, y, z: 0.9 + 0 * z, lambda x, y, z: 1.0 + 0 * z)  # noqa: ARG005
    stances = [stance(start, other), stance(None, other), stance(far, other)]
    found = failure_of(problem(stances, (0.6, 0.0, 0.95), support_distance=0.974, geometric=band))
    assert found.requirement == "support distance"
    assert found.phase == 2
    assert "step is too long" in found.reason
    assert "1.22 m apart" in found.reason
    assert "left_foot" in found.reason


@pytest.mark.parametrize(("friction", "blamed"), [(0.05, True), (0.6, False)])
def test_low_friction_is_blamed_where_more_of_it_would_do(friction, blamed):
    """On ice the polytopes shrink; with firm friction the margin would be there."""
    both = stance((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), friction=friction)
    one = stance(None, (0.0, -0.1, 0.0), friction=friction)
    required = 25.0 if blamed else 2000.0
    found = failure_of(problem([both, one], (0.0, -0.1, 0.95), required_margin=required))
    assert ("friction" in found.reason) == blamed


@pytest.mark.parametrize(("space", "unit"), [("wrench", "N.m"), ("force", "N")])
def test_the_margin_with_firm_friction_has_the_unit_of_the_problem(space, unit):
    """On ice nobody accelerates by 1 m/s^2, on firm ground with the margin that is told, in one unit."""
    com, acceleration = np.array([0.0, 0.0, 0.95]), np.array([1.0, 0.0, 0.0])
    options = {"goal_acceleration": acceleration, "required_margin": 1.0, "margin_space": space}
    icy, firm = (stance((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), friction=mu) for mu in (0.05, 0.7))
    found = failure_of(problem([icy], com, **options))
    assert found.requirement == "goal balance"
    value, told = found.reason.split("too low: with 0.7 it would be ")[1].split()
    assert told == unit
    task = problem([firm], com, **options)
    measured = best_margin_at(polytopes_of(task)[0], task, com, acceleration)
    assert float(value) == pytest.approx(measured, abs=0.006)


@pytest.mark.parametrize(("unit", "blamed"), [("N", False), ("N.m", True)])
def test_a_margin_in_another_unit_than_that_asked_for_counts_by_its_sign(unit, blamed):
    """The ball in both of two polytopes is a moment, which says nothing of the 200 N that are asked for."""
    icy = stance((0.0, 0.1, 0.0), (0.0, -0.1, 0.0), friction=0.05)
    task = problem([icy], (0.0, 0.0, 0.95), required_margin=200.0, margin_space="force")
    told = low_friction([icy], task, lambda _: 5.0, unit)
    assert told.endswith("with 0.7 it would be 5.00 N.m") == blamed == bool(told)
