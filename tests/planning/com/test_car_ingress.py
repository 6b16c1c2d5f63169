"""The car case of Qiu (2012), chapter 7, with its printed tables and the inputs that fit them."""

import numpy as np
import pytest

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule, StanceSequence
from manikin.numerics.spline import BSpline
from manikin.planning.com import CentroidalTrajectory, plan_com
from manikin.planning.com.feasibility import assess_feasibility, intersection_radii, polytopes_of
from manikin.scenarios import load_scenario

# Table 7.6; 17 knots, of which it prints the internal ones (they equal t_dist / 4.5592 to 4 digits).
CONTROL_POINTS = np.array([
    [0.2350, 0.2350, 0.2492, 0.2763, 0.1825, -0.3005, -0.2687, -0.2684, -0.3894, -0.1642, -0.0454],
    [-1.0112, -1.0112, -0.9860, -0.9350, -0.8688, -0.6894, -0.7915, -0.5306, -0.5296, -0.2661, -0.1463],
    [0.4659, 0.4659, 0.4635, 0.4505, 0.4260, 0.3694, 0.3299, 0.2706, 0.2336, 0.2153, 0.2104],
]).T  # fmt: skip
INSTANTS = np.array([0.0, 0.7176, 1.1176, 2.0679, 2.5679, 3.9592, 4.5592])


@pytest.fixture(scope="module")
def problem():
    return load_scenario("car-ingress").build_centroidal_problem()


@pytest.fixture(scope="module")
def planned(problem):
    return plan_com(problem)


def test_the_smallest_intersection_has_the_published_radius(problem):
    """32.63 N.m about the H-point (7.2.2), to the width of 9 cm that was derived from it."""
    radii = intersection_radii([polytope.at_reference(np.zeros(3)) for polytope in polytopes_of(problem)])
    assert radii.min() == pytest.approx(32.63, abs=0.05)
    # The bound of the margin about the CoM is an upper one: no length of a row is less than its least one.
    assert assess_feasibility(problem, polytopes_of(problem)).radius > 32.63
    # The others are computed facts of the same reconstruction; the last depends on the friction.
    assert np.sort(radii)[:4] == pytest.approx([32.63, 32.63, 35.17, 35.17], abs=0.05)


def test_the_published_motion_is_balanced_with_the_inputs_that_fit_it(problem):
    """Table 7.6 says 19.4 N.m about the H-point; 79 kg, 24 x 9 cm and 0.5 give 19.1."""
    total = INSTANTS[-1]
    knots = np.concatenate([np.zeros(6), INSTANTS[1:-1] / total, np.ones(6)])
    spline = BSpline(5, knots, CONTROL_POINTS)
    least = []
    for index, polytope in enumerate(polytopes_of(problem)):
        # As in the thesis each phase is looked at after its first instant.
        time = np.linspace(INSTANTS[index], INSTANTS[index + 1], 201)[1:]
        wrench = pseudo_wrench(problem.mass, spline(time / total), spline(time / total, 2) / total**2)
        least.append(float(polytope.at_reference(np.zeros(3)).margin(wrench).min()))
    assert min(least) == pytest.approx(19.0, abs=1.0)
    # Phase 1 depends on the sampling near its start: 25.7 with it, 30.6 at ten samples.
    assert least[1:] == pytest.approx([19.1, 26.9, 25.5, 20.4, 20.6], abs=0.3)
    assert 25.5 < least[0] < 30.7


def test_the_plan_reaches_the_published_margin_in_the_published_time(planned):
    assert planned.succeeded, planned.failure
    assert planned.d_min >= 18.7
    assert planned.trajectory.duration <= 4.56
    assert np.all(planned.trajectory.schedule.durations >= [0.15, 0.4, 0.1, 0.5, 0.6, 0.6])


def test_a_joined_trajectory_is_both_of_its_parts(planned):
    first = planned.trajectory
    end = first.duration
    second = _onward(first)
    joined = first.followed_by(second)
    time = np.linspace(0.0, end, 301)
    assert joined.position(time) == pytest.approx(first.position(time), abs=1e-9)
    later = np.linspace(0.0, second.duration, 301)
    assert joined.position(end + later) == pytest.approx(second.position(later), abs=1e-9)
    # Continuous to the second derivative across the joint, to the steps' 1e-6 s times the jerk.
    for rate in (joined.velocity, joined.acceleration):
        assert rate(end - 1e-6) == pytest.approx(rate(end + 1e-6), abs=1e-3)
    assert joined.schedule.instants[len(first.schedule.instants) - 1] == pytest.approx(end)


def _onward(first):
    """One quintic from the end of the first part to rest, in a second for each phase that is left."""
    phases = load_scenario("car-ingress").build_sequence().phases[6:]
    end, total = first.duration, float(len(phases))
    start, rest = first.position(end), np.array([-0.05, -0.02, 0.22])
    second = start + first.velocity(end) * total / 5.0
    third = 2.0 * second - start + first.acceleration(end) * total**2 / 20.0
    spline = BSpline(5, np.repeat([0.0, 1.0], 6), np.array([start, second, third, rest, rest, rest]))
    schedule = ContactSchedule(StanceSequence(phases), np.arange(total + 1.0))
    return CentroidalTrajectory(first.mass, spline, schedule)
