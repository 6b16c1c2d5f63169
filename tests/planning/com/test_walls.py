"""Two vertical walls: phases without static balance, and impossible climbs ([Qiu2012]_ 5.4.4)."""

import numpy as np
import pytest

from manikin.balance import wrench_polytope
from manikin.numerics.spatial import GRAVITY, GRAVITY_VECTOR
from manikin.planning.com.feasibility import assess_feasibility, polytopes_of
from manikin.planning.com.timing_free import can_rest
from manikin.scenarios import list_variants, load_scenario

TWO = tuple(range(3, 19, 4))
"""Phases with two contacts; those with four come in three parts."""


@pytest.fixture(scope="module")
def problem():
    return load_scenario("walls", "trial-2").build_centroidal_problem()


@pytest.fixture(scope="module")
def polytopes(problem):
    return polytopes_of(problem)


@pytest.fixture(scope="module")
def planned(runs):
    """The plan of the run that the tests share."""
    return runs("walls@trial-2").centroidal


def test_the_scenario_has_the_published_numbers(problem):
    """[Qiu2012]_ 5.4.4."""
    assert (problem.mass, problem.degree, problem.margin_space) == (120.0, 4, "force")
    np.testing.assert_array_equal([problem.start_com, problem.goal_com], [[0, 0, 1], [0, 0, 2]])
    stances = [phase.stance for phase in problem.sequence]
    assert [len(stance) for stance in stances] == [4, 4, 4, *[2, 4, 4, 4] * 4]
    for contact in (contact for stance in stances for contact in stance):
        assert (contact.length, contact.width) == pytest.approx((0.4, 0.1))
        assert (contact.friction, contact.normal_force_cap) == (1.0, 500.0)
        x, y, _ = contact.position
        assert (abs(x), y) == (1.0, 0.0)
        np.testing.assert_allclose(contact.normal, [-np.sign(x), 0, 0], atol=1e-15)
        # The long edge is parallel to the ground.
        assert np.ptp(contact.points_in_world[:, 2]) == pytest.approx(0.1)
    heights = [sorted({round(c.position[2], 9) for c in stance}) for stance in stances]
    assert heights[::4] == [[0.85, 1.15], [1.15, 1.35], [1.35, 1.65], [1.65, 1.85], [1.85, 2.15]]
    # The phases of the thesis last 0.3 s at least; so do three parts together.
    shortest = problem.min_durations
    np.testing.assert_allclose(shortest[[0]] + shortest[[1]] + shortest[[2]], 0.3)
    np.testing.assert_allclose(shortest[list(TWO)], 0.3)


def test_two_feet_cannot_hold_the_body_still_and_four_can(problem, polytopes):
    """Two contacts carry 2 * 500 N of friction, the body weighs 1177 N."""
    for number, polytope in enumerate(polytopes):
        assert can_rest(polytope, problem.mass) == (number not in TWO)


def test_the_body_decelerates_on_two_feet(planned):
    """Their friction is 177 N short of the weight: at least 1.477 m/s^2 downwards, and the margin on top."""
    assert planned.succeeded
    trajectory = planned.trajectory
    instants = trajectory.schedule.instants
    for phase in TWO:
        times = np.linspace(instants[phase], instants[phase + 1], 50)
        assert trajectory.acceleration(times)[:, 2].max() <= 1000.0 / 120.0 - GRAVITY
    assert planned.d_min >= 150.0  # trial 2 of Table 5.1 has 196 N at this duration
    assert trajectory.duration <= 3.9 + 1e-6


def test_the_margin_is_a_force_that_can_be_applied(planned):
    """At the worst instant a force of the margin's size, in any direction, still leaves balance."""
    problem = planned.problem
    time, phase = planned.certificate.limiting_time, planned.certificate.limiting_phase
    com, acceleration = planned.trajectory.position(time), planned.trajectory.acceleration(time)
    force = problem.mass * (acceleration - GRAVITY_VECTOR)
    directions = np.random.default_rng(0).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    pushed = force + (planned.d_min - 1e-6) * directions
    wrenches = np.hstack([pushed, np.cross(com - problem.reference, pushed)])
    assert planned.polytopes[phase].distances(wrenches).min() >= -1e-6


def test_a_stance_moved_elsewhere_has_the_polytope_it_would_have(problem, polytopes):
    # Three of the nineteen phases: four and two contacts, at the start and on the way.
    for phase, polytope in [*zip(problem.sequence, polytopes, strict=True)][:10:4]:
        direct = wrench_polytope(phase.stance, reference=problem.reference)
        assert len(direct) == len(polytope)
        # The same set: every row of the one is a row of the other (newtons, rounding of the hull).
        rows = np.column_stack([polytope.H, polytope.h / 1000.0])
        wanted = np.column_stack([direct.H, direct.h / 1000.0])
        gaps = np.abs(rows[:, None] - wanted[None]).max(axis=2)
        assert gaps.min(axis=1).max() < 1e-7
        assert gaps.min(axis=0).max() < 1e-7


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        pytest.param(
            "supports.friction=0.05", "a friction of 0.05 pressed with 2000 N in all is too small",
            marks=pytest.mark.long,
        ),
        ("supports.contact_normal_force_cap_N=250", "push up with 1000 N at most"),
    ],
)  # fmt: skip
def test_too_little_friction_or_squeeze_is_named_at_once(setting, says):
    problem = load_scenario("walls", overrides=[setting]).build_centroidal_problem()
    failure = assess_feasibility(problem, polytopes_of(problem)).failure
    assert failure.requirement == "weight"
    assert says in failure.reason
    assert "weighs 1177 N" in failure.reason
    assert "more friction or a stronger squeeze" in failure.reason


def test_a_body_that_may_end_falling_needs_no_lift():
    """With a free velocity at the end the mean force may be smaller than the weight."""
    falling = load_scenario("walls", overrides=["supports.friction=0.05"]).build_centroidal_problem()
    object.__setattr__(falling, "goal_velocity", None)
    failure = assess_feasibility(falling, polytopes_of(falling)).failure
    assert failure is None or failure.requirement != "weight"


def test_the_trials_have_the_weights_of_table_5_1():
    weights = {
        name: load_scenario("walls", name).file.planning.weights
        for name in list_variants("walls")
        if "trial" in name
    }
    found = {name: (item.margin, item.smoothness, item.duration) for name, item in weights.items()}
    assert found == {
        "trial-1": (1, 1e3, 1), "trial-2": (1e3, 1, 1), "trial-3": (1e3, 1e-3, 1),
        "trial-4": (1e4, 1e-3, 1), "trial-5": (1e4, 10, 1),
    }  # fmt: skip
