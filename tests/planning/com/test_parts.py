"""Long motions on other contacts than feet are planned in parts, from rest to rest."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import Phase, Stance, StanceSequence, point
from manikin.planning.com import CentroidalProblem, plan_com, timing_free
from manikin.planning.com.feasibility import Failure
from manikin.planning.com.timing_free import LONG

LIMBS = {
    "left_fist": (0.5, 0.15),
    "right_fist": (0.5, -0.15),
    "left_knee": (0.0, 0.1),
    "right_knee": (0.0, -0.1),
}
STRIDE, HEIGHT = 0.1, 0.4


def crawl(cycles: int) -> CentroidalProblem:
    """One limb after the other goes on by a stride: four points, three, four, three, ..."""
    places = {name: np.array([*place, 0.0]) for name, place in LIMBS.items()}

    def stance(without=None):
        held = [point(name, place, friction=0.6) for name, place in places.items() if name != without]
        return Stance(held, 2000.0)

    def rest(without=None):
        held = [place for name, place in places.items() if name != without]
        return np.mean(held, axis=0) + np.array([0.0, 0.0, HEIGHT])

    start, phases, rests = rest(), [Phase(stance(), 0.2)], [None]
    for _ in range(cycles):
        for name in LIMBS:
            rests += [rest(name), rest(name)]  # where it leaves and where it comes down, on the other three
            phases.append(Phase(stance(name), 0.4))
            places[name] = places[name] + [STRIDE, 0.0, 0.0]
            phases.append(Phase(stance(), 0.2))
    return CentroidalProblem(
        70.0, StanceSequence(phases), start, rest(), required_margin=5.0, rests=tuple(rests), samples=6
    )


@pytest.fixture(scope="module")
def problem():
    return crawl(3)


@pytest.fixture(scope="module")
def planned(problem):
    return plan_com(problem)


def test_a_crawl_keeps_its_margin_all_along(planned, problem):
    """Measured every millisecond over the whole, joints of the parts included."""
    assert len(problem.sequence) >= LONG
    assert planned.succeeded, planned.failure
    certificate = planned.residuals()
    assert certificate.within()
    assert certificate.min_margin == planned.d_min >= 5.0
    assert len(planned.key_instants) == len(problem.sequence) + 1


def test_the_parts_meet_at_rest_where_a_posture_is_known(planned, problem):
    trajectory, instants = planned.trajectory, planned.key_instants
    resting = [
        key for key in range(1, len(problem.sequence))
        if np.abs(trajectory.velocity(instants[key])).max() < 1e-6
        and np.abs(trajectory.acceleration(instants[key])).max() < 1e-4
    ]  # fmt: skip
    assert len(resting) == len(problem.sequence) - 1
    for key in resting:
        np.testing.assert_allclose(trajectory.position(instants[key]), problem.rests[key], atol=1e-7)


def test_a_short_motion_and_one_without_rests_are_planned_at_once():
    """Nothing holds a motion still then between its ends."""
    short = replace(crawl(1), rests=())
    found = plan_com(short)
    assert found.succeeded
    assert np.linalg.norm(found.trajectory.velocity(found.key_instants[1:-1]), axis=1).min() > 1e-3


def test_a_part_that_fails_names_its_phase_in_the_whole(problem, monkeypatch):
    lengths = []

    def second_fails(part):
        lengths.append(len(part.sequence))
        found = plan_com(part)
        if len(lengths) == 1:
            return found
        return replace(found, failure=Failure("balance margin", "too small", 1, 0.25), trajectory=None)

    monkeypatch.setattr(timing_free, "plan_com", second_fails)
    failed = plan_com(problem)
    assert not failed.succeeded
    assert failed.trajectory is None
    assert len(lengths) == 3  # the second one again with the margin that the problem requires
    assert failed.failure.phase == lengths[0] + 1
    assert failed.failure.time > 0.25 + problem.sequence[0].min_duration - 1e-9  # after the first part
    assert "too small" in failed.failure.reason
