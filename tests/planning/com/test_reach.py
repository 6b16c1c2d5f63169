"""Plans of the centre of mass stay where the body's postures have it."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.kinematics.com_reach import ComReach
from manikin.planning.com import CentroidalProblem, plan_com, timing_free
from manikin.planning.com.com_certificate import measure, phase_times
from manikin.planning.com.optimise import trajectory_of

LENGTH = 0.85


@pytest.fixture(scope="module")
def body():
    return human(1.75, 79.0, "male")


def stride(body, length=LENGTH):
    """A step forward with the left foot, from over the feet's middle to over it again, low enough."""
    size = {"length": 0.22, "width": 0.08, "friction": 0.7}
    right = sole("right_foot", (0.0, -0.1, 0.0), **size)
    behind, ahead = (sole("left_foot", (x, 0.1, 0.0), **size) for x in (0.0, length))
    stances = [Stance(held, 1500.0) for held in ((behind, right), (right,), (ahead, right))]
    reach = ComReach.of(body)
    return CentroidalProblem(
        body.mass, StanceSequence([Phase(stance, 0.4, 1.5) for stance in stances]),
        (0.0, 0.0, 0.93), (0.5 * length, 0.0, 0.84), degree=5, samples=4,
        regions=tuple(reach.region(stance.contacts) for stance in stances),
    )  # fmt: skip


def beyond(problem, trajectory):
    """Largest distance of the centre of mass beyond the region of its phase [m]."""
    return max(
        float(region.violation(trajectory.position(times)).max())
        for region, times in zip(problem.regions, phase_times(trajectory), strict=True)
    )


def test_a_long_stride_is_planned_within_reach(body):
    """Without the regions the centre of mass is centimetres too high for both legs; with them it is not."""
    problem = stride(body)
    freely = plan_com(replace(problem, regions=()))
    kept = plan_com(problem)
    assert beyond(problem, freely.trajectory) > 0.005
    assert kept.succeeded, kept.failure
    assert beyond(problem, kept.trajectory) <= 1e-6


def test_a_round_that_leaves_the_reach_far_behind_is_no_start_for_the_next(body, monkeypatch):
    """The first solution is moved up by more than that: the second round begins where the first one did."""
    optimise, starts = timing_free.optimise, []

    def lost_at_first(problem, polytopes, facets, targets, bezier, durations, faces):
        found = optimise(problem, polytopes, facets, targets, bezier, durations, faces)
        starts.append(bezier)
        if len(starts) > 1:
            return found
        away = found.bezier + np.array([0.0, 0.0, 2.0 * timing_free.LOST])
        trajectory = trajectory_of(problem, away, found.durations)
        certificate = measure(problem, trajectory, polytopes)
        return replace(found, bezier=away, trajectory=trajectory, certificate=certificate)

    monkeypatch.setattr(timing_free, "optimise", lost_at_first)
    problem = stride(body)
    kept = plan_com(problem)
    assert kept.succeeded, kept.failure
    assert beyond(problem, kept.trajectory) <= 1e-6
    np.testing.assert_array_equal(starts[1], starts[0])


def test_ends_out_of_reach_are_named_with_their_contacts(body):
    """A goal at standing height over a stride, and places of the feet with nothing in common."""
    problem = stride(body)
    high = plan_com(replace(problem, goal_com=np.array([0.5 * LENGTH, 0.0, 1.1]))).failure
    assert high.requirement == "reach"
    assert high.phase == 2
    assert "goal CoM is 0." in high.reason
    assert "left_foot, right_foot in phase 2" in high.reason
    far = replace(
        problem.regions[2], offsets=problem.regions[2].offsets + 3.0 * problem.regions[2].normals[:, 0]
    )
    apart = plan_com(replace(problem, regions=(*problem.regions[:2], far))).failure
    assert apart.requirement == "reach"
    assert "at T_2, on right_foot, left_foot" in apart.reason


def test_reach_moves_with_the_scene(body):
    """The plan of a stride moved by 3 m and raised by 1 m is the moved plan, to a tenth of a millimetre."""
    problem, shift = stride(body), np.array([3.0, -2.0, 1.0])
    phases = [
        replace(
            phase,
            stance=phase.stance.with_contacts(
                [replace(c, position=c.position + shift) for c in phase.stance]
            ),
        )
        for phase in problem.sequence
    ]
    reach = ComReach.of(body)
    moved = replace(
        problem, sequence=StanceSequence(phases), start_com=problem.start_com + shift,
        goal_com=problem.goal_com + shift,
        regions=tuple(reach.region(phase.stance.contacts) for phase in phases),
    )  # fmt: skip
    here, there = plan_com(problem).trajectory, plan_com(moved).trajectory
    assert there.duration == pytest.approx(here.duration, abs=1e-4)
    times = np.linspace(0.0, here.duration, 50)
    np.testing.assert_allclose(there.position(times), here.position(times) + shift, atol=1e-4)
