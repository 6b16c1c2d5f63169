"""Propositions 1 and 2, and what can be refused before any optimisation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance import pseudo_wrench
from manikin.contact import Phase, Stance, StanceSequence, point, sole
from manikin.numerics.polytope import Polytope
from manikin.planning.com import CentroidalProblem, assess_feasibility, intersection_radii, plan_com
from manikin.planning.com.feasibility import best_margin_at, polytopes_of


def box(centre, half: float, dimension: int = 6) -> Polytope:
    rows = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return Polytope(rows, rows @ np.broadcast_to(centre, dimension) + half)


def test_radius_is_that_of_the_inscribed_ball_of_the_overlap():
    """Two cubes of half side 1 whose centres are 1.5 apart overlap by 0.5 along x."""
    shifted = box([1.5, 0, 0, 0, 0, 0], 1.0)
    assert intersection_radii([box(0.0, 1.0), shifted]) == pytest.approx([0.25])


@given(st.floats(-3.0, 3.0), st.floats(0.1, 2.0), st.floats(0.1, 2.0))
def test_disjoint_polytopes_have_a_negative_radius(distance: float, first: float, second: float):
    """Proposition 1: the sign of the radius says whether the polytopes meet."""
    radius = intersection_radii([box(0.0, first), box([distance, 0, 0, 0, 0, 0], second)])[0]
    overlap = min(first, distance + second) - max(-first, distance - second)
    assert radius == pytest.approx(min(overlap / 2, first, second), abs=1e-9)


def test_disjoint_consecutive_polytopes_make_the_problem_infeasible(platform):
    """Proposition 1 with constructed polytopes: the pair is named."""
    problem = platform()
    polytopes = [box(0.0, 2000.0)] * 3 + [box(9000.0, 2000.0)] + [box(0.0, 2000.0)] * 3
    feasibility = assess_feasibility(problem, polytopes)
    assert feasibility.radius < 0
    assert feasibility.failure is not None
    assert feasibility.failure.phase == 2
    assert "phases 2 and 3" in feasibility.failure.reason
    assert "Proposition 1" in feasibility.failure.reason


def test_smallest_radius_is_an_upper_bound_of_the_margin(planned):
    """Proposition 2, on a solution whose margin was maximised."""
    assert planned.d_min < planned.feasibility_radius
    assert planned.feasibility_radius == pytest.approx(planned.feasibility.radii.min())


def test_a_margin_above_the_radius_is_refused_without_solving(platform):
    result = plan_com(platform(required_margin=120.0))
    assert not result.succeeded
    assert result.rounds == 0
    assert result.failure.requirement == "intersection"
    assert "Proposition 2" in result.failure.reason


def test_radii_of_the_car_are_the_published_ones(car_stances):
    """[Qiu2012]_ 7.2.2 gives 32.63 N.m for the smallest, recovered with a sole of 9 cm (DOUBTS Q-1)."""
    problem = CentroidalProblem(79.0, car_stances, (0.235, -1.0112, 0.4659), (-0.045, -0.1463, 0.21))
    radii = intersection_radii([polytope.at_reference(np.zeros(3)) for polytope in polytopes_of(problem)])
    # Four published digits.
    assert radii[:4] == pytest.approx([35.17, 35.17, 32.63, 32.63], abs=0.01)
    assert radii.min() == pytest.approx(32.63, abs=0.005)


def test_stances_without_a_common_contact_have_no_margin_between_them():
    """Hopping from one foot to the other passes through free fall."""
    feet = [
        sole(name, (x, 0.0, 0.0), length=0.28, width=0.12, friction=0.7)
        for name, x in (("left_foot", -0.3), ("right_foot", 0.3))
    ]
    sequence = StanceSequence([Phase(Stance([foot], 1500.0)) for foot in feet])
    result = plan_com(CentroidalProblem(70.0, sequence, (-0.3, 0, 0.9), (0.3, 0, 0.9)))
    assert result.failure.requirement == "intersection"
    assert result.feasibility_radius == pytest.approx(0.0, abs=1e-9)


def test_two_point_contacts_are_flat_and_have_no_margin():
    """No moment can be had about the line through two points."""
    feet = [point("left_foot", (-0.1, 0, 0), friction=0.7), point("right_foot", (0.1, 0, 0), friction=0.7)]
    sequence = StanceSequence([Phase(Stance(feet, 1500.0))])
    result = plan_com(CentroidalProblem(70.0, sequence, (0, 0, 0.9), (0, 0, 0.9)))
    assert result.failure.requirement == "start balance"


@pytest.mark.parametrize(
    ("changes", "requirement", "phase", "words"),
    [
        ({"goal_com": (0.6, 1.65, 0.86)}, "support distance", 6, "out of reach"),
        ({"start_com": (0.0, 0.0, 1.02)}, "support distance", 0, "left_foot"),
        ({"support_distance": None, "goal_com": (0.6, 1.65, 0.86)}, "goal balance", 6, "right_foot"),
        ({"support_distance": None, "start_com": (0.0, 1.0, 0.93)}, "start balance", 0, "left_foot"),
        ({"goal_com": (0.6, 0.65, 0.80)}, "height above the lower surface", 6, "goal CoM"),
        ({"start_com": (0.0, 0.0, 0.95)}, "height below the upper surface", 0, "start CoM"),
        ({"max_duration": 2.5}, "durations", None, "2.600 s"),
        ({"start_acceleration": (9.0, 0.0, 0.0)}, "start balance", 0, "left_foot"),
    ],
)
def test_what_cannot_be_met_is_named_before_solving(platform, changes, requirement, phase, words):
    result = plan_com(platform(**changes))
    assert not result.succeeded
    assert result.rounds == 0
    assert result.trajectory is None
    assert result.failure.requirement == requirement
    assert result.failure.phase == phase
    assert words in result.failure.reason
    assert "\n" not in result.failure.reason


@given(st.integers(0, 2**16))
def test_best_margin_is_not_exceeded_by_any_acceleration(seed: int):
    """The linear programme over accelerations against random ones."""
    rng = np.random.default_rng(seed)
    feet = [
        sole("left_foot", (-0.1, 0, 0), length=0.28, width=0.12, friction=0.7),
        sole("right_foot", (0.1, 0, 0.1), length=0.28, width=0.12, friction=0.7),
    ]
    com = rng.uniform([-0.2, -0.2, 0.6], [0.2, 0.2, 1.0])
    for space in ("wrench", "force"):
        sequence = StanceSequence([Phase(Stance(feet, 1500.0))])
        problem = CentroidalProblem(70.0, sequence, com, com, margin_space=space)
        polytope = polytopes_of(problem)[0]
        best = best_margin_at(polytope, problem, com, None)
        tried = [best_margin_at(polytope, problem, com, a) for a in rng.normal(scale=3.0, size=(30, 3))]
        assert max(tried) <= best + 1e-6


def test_margin_at_rest_is_that_of_the_static_wrench(platform):
    problem = platform()
    polytope = polytopes_of(problem)[0]
    at_com = polytope.at_reference(problem.start_com)
    static = float(at_com.margin(pseudo_wrench(79.0, np.zeros(3), np.zeros(3))))
    assert best_margin_at(polytope, problem, problem.start_com, np.zeros(3)) == pytest.approx(static)
