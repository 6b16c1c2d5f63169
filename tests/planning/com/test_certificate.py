"""The certificate tells the truth about any trajectory."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.balance import WrenchPolytope
from manikin.contact import ContactSchedule
from manikin.numerics.spline import BSpline
from manikin.planning.com import CentroidalResult, CentroidalTrajectory
from manikin.planning.com.com_certificate import measure, phase_margins, phase_times
from manikin.planning.com.feasibility import polytopes_of


def with_point(trajectory: CentroidalTrajectory, index: int, shift) -> CentroidalTrajectory:
    points = trajectory.spline.control_points.copy()
    points[index] += shift
    spline = BSpline(trajectory.spline.degree, trajectory.spline.knots, points)
    return CentroidalTrajectory(trajectory.mass, spline, trajectory.schedule)


def remeasured(result: CentroidalResult, trajectory: CentroidalTrajectory, **changes):
    return measure(replace_problem(result.problem, **changes), trajectory, result.polytopes)


def replace_problem(problem, **changes):
    names = (
        "mass", "sequence", "start_com", "goal_com", "start_velocity", "goal_velocity", "start_acceleration",
        "goal_acceleration", "degree", "margin_space", "required_margin", "support_distance", "geometric",
        "max_duration", "weights", "samples",
    )  # fmt: skip
    return type(problem)(**({name: getattr(problem, name) for name in names} | changes))


def test_phase_minima_of_table_5_4_are_those_of_an_independent_check(platform, table_5_4):
    """DOUBTS Q-12: sole 0.28 x 0.12 m, mu 0.7, cap 1500 N, moments about the world origin."""
    problem = platform(margin_space="wrench_about_origin")
    margins = phase_margins(problem, table_5_4, polytopes_of(problem))
    published = [27.1, 24.1, 60.9, 12.1, 42.6, 29.9, 30.5]
    # The published minima are over 11-41 samples of the phase, ours over every millisecond.
    assert [float(m.min()) for m in margins] == pytest.approx(published, abs=1.0)


def test_table_5_4_breaks_the_lower_surface_by_5_cm_and_no_distance(platform, table_5_4):
    """DOUBTS Q-13: the height band 5.29 is broken by up to 0.0495 m below."""
    problem = platform(required_margin=0.0, margin_space="wrench_about_origin")
    residuals = measure(problem, table_5_4, polytopes_of(problem))
    assert residuals["height above the lower surface"].value == pytest.approx(0.0495, abs=5e-4)
    assert residuals["height below the upper surface"].value == pytest.approx(0.0094, abs=2e-3)
    assert residuals["support distance"].value == pytest.approx(0.955 - 1.0, abs=1e-3)
    assert residuals.min_margin == pytest.approx(12.1, abs=0.5)
    assert residuals.limiting_phase == 3
    assert not residuals.within()


def test_times_hold_both_ends_of_every_phase_and_every_millisecond(table_5_4):
    times = phase_times(table_5_4)
    for phase, instants in enumerate(times):
        assert instants[0] == table_5_4.schedule.instants[phase]
        assert instants[-1] == table_5_4.schedule.instants[phase + 1]
        assert np.diff(instants).max() <= 1e-3 + 1e-9
        assert np.diff(instants).min() > 0


def test_planned_trajectory_meets_every_requirement(planned: CentroidalResult):
    assert planned.residuals().within(1e-6)


@pytest.mark.parametrize(
    ("index", "shift", "requirement"),
    [
        (0, (1e-4, 0, 0), "start position"),
        (1, (0, 1e-4, 0), "start velocity"),
        (-1, (0, 0, 1e-4), "goal position"),
        (-2, (1e-4, 0, 0), "goal velocity"),
        (6, (0.25, 0.0, 0.0), "balance margin"),
        (6, (0.0, 0.0, 0.08), "height below the upper surface"),
        (6, (0.0, 0.0, -0.08), "height above the lower surface"),
    ],
)
def test_moving_a_control_point_is_noticed(planned: CentroidalResult, index, shift, requirement):
    """A displaced control point violates the requirement it serves."""
    assert planned.trajectory is not None
    residuals = remeasured(planned, with_point(planned.trajectory, index, shift))
    assert residuals[requirement].value > 1e-5
    assert not residuals.within()


def test_other_durations_are_noticed(planned: CentroidalResult):
    trajectory = planned.trajectory
    assert trajectory is not None
    for factor, requirement in ((0.9, "phase duration"), (1.2, "total duration")):
        schedule = ContactSchedule(trajectory.schedule.sequence, factor * trajectory.schedule.instants)
        residuals = remeasured(planned, CentroidalTrajectory(trajectory.mass, trajectory.spline, schedule))
        assert residuals[requirement].value > 0.01


def test_a_shorter_reach_is_noticed(planned: CentroidalResult):
    assert planned.trajectory is not None
    spare = -planned.residuals()["support distance"].value
    residuals = remeasured(planned, planned.trajectory, support_distance=1.0 - spare - 0.01)
    assert residuals["support distance"].value == pytest.approx(0.01, abs=1e-9)
    assert residuals.largest.requirement == "support distance"


def test_margin_is_the_smallest_of_the_polytopes_at_every_instant(planned: CentroidalResult):
    """The certificate equals a plain loop over instants and polytopes, both at key instants."""
    trajectory = planned.trajectory
    assert trajectory is not None
    lowest = np.inf
    for phase, polytope in enumerate(planned.polytopes):
        start, end = trajectory.schedule.instants[phase : phase + 2]
        for t in np.arange(start, end, 1e-3):
            com = trajectory.position(float(t))
            wrench = trajectory.pseudo_wrench(float(t), com)
            at_com = polytope.at_reference(com)
            lowest = min(lowest, float(np.min(at_com.h - at_com.H @ wrench)))
    # The loop's millisecond grid starts anew in each phase; margins change by < 0.1 N.m per ms.
    assert planned.residuals().min_margin == pytest.approx(lowest, abs=0.1)


def test_force_margin_is_the_largest_push_at_the_com_that_stays_inside(platform, table_5_4):
    """In force space the margin is the distance to the boundary along the worst push."""
    problem = platform(margin_space="force")
    polytopes = polytopes_of(problem)
    margins = phase_margins(problem, table_5_4, polytopes)
    phase, index = 3, 100
    t = phase_times(table_5_4)[phase][index]
    W: WrenchPolytope = polytopes[phase]
    com, wrench = table_5_4.position(t), table_5_4.pseudo_wrench(t, W.reference)
    directions = np.random.default_rng(0).normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    reach = []
    for u in directions:
        push = np.concatenate([u, np.cross(com - W.reference, u)])
        growth = W.H @ push
        reach.append(float(np.min((W.distances(wrench) / np.maximum(growth, 1e-12))[growth > 1e-12])))
    # 4000 random directions come within a few degrees of the worst one: cos(5 deg) = 0.996.
    assert margins[phase][index] == pytest.approx(min(reach), rel=0.01)
    assert margins[phase][index] <= min(reach) + 1e-9


def test_residuals_name_what_exists(planned: CentroidalResult):
    with pytest.raises(KeyError, match="support distance"):
        planned.residuals()["nonsense"]
    assert "violated by" in str(planned.residuals()["balance margin"])


def test_residuals_are_frozen(planned: CentroidalResult):
    with pytest.raises(AttributeError):
        planned.residuals().min_margin = 0.0  # type: ignore[misc]
    assert replace(planned.residuals(), min_margin=1.0).min_margin == 1.0
