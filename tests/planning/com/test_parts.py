"""Long motions on other contacts than feet are planned in parts, from rest to rest."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.balance import motion_margin
from manikin.contact import Phase, Stance, StanceSequence, point
from manikin.errors import SplineError
from manikin.planning.com import CentroidalProblem, plan_com, timing_free
from manikin.planning.com.feasibility import Failure
from manikin.planning.com.timing_free import (
    CALM_ON_POINTS,
    LEVEL,
    LONG,
    PART,
    _part,
    _parted,
    _rest_margin,
)

LIMBS = {
    "left_wrist": (0.5, 0.15),
    "right_wrist": (0.5, -0.15),
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


def resting(found):
    """Inner key instants at which the centre of mass stands still."""
    trajectory, instants = found.trajectory, found.key_instants
    return [
        key for key in range(1, len(instants) - 1)
        if np.abs(trajectory.velocity(instants[key])).max() < 1e-6
        and np.abs(trajectory.acceleration(instants[key])).max() < 1e-4
    ]  # fmt: skip


def test_the_parts_meet_at_rest_where_a_posture_is_known(planned, problem):
    """Level parts are as long as they may be; between their ends the body goes on."""
    keys = resting(planned)
    assert keys == [*range(PART, len(problem.sequence), PART)]
    for key in keys:
        position = planned.trajectory.position(planned.key_instants[key])
        np.testing.assert_allclose(position, problem.rests[key], atol=1e-7)


def test_a_crawl_keeps_most_of_the_margin_of_its_rests(planned, problem):
    """In the middle part, whose ends are rests: a limb that carries little keeps its load."""
    first, last = PART, 2 * PART
    margins = [_rest_margin(problem, planned.polytopes, key) for key in range(first, last + 1)]
    least = CALM_ON_POINTS * min(margins)
    assert _part(problem, planned.polytopes, first, last).required_margin == pytest.approx(least)
    assert least > problem.required_margin
    measured = planned.trajectory  # along the part, on the contacts of its phases
    times = np.linspace(*planned.key_instants[[first, last]], 200)[1:-1]
    stances = [phase.stance for phase in problem.sequence]
    found = motion_margin(
        stances, measured.schedule.phase_at(times), measured.pseudo_wrench(times),
        measured.position(times), polytopes=planned.polytopes,
    )  # fmt: skip
    assert found.margin.min() > least - 0.1  # the tolerance of the certificate is less [N.m]


def test_a_part_can_be_slower_while_the_others_keep_their_pace(planned, problem):
    """The same path; accelerations fall by the square of the factor, and what is at rest stays so."""
    slower, factor = planned.trajectory.slowed((PART, 2 * PART), 1.5), 1.5
    before, after = planned.key_instants, slower.schedule.instants
    durations = np.diff(before)
    durations[PART : 2 * PART] *= factor
    np.testing.assert_allclose(np.diff(after), durations, atol=1e-9)
    for first, last, scale in ((0, PART, 1.0), (PART, 2 * PART, factor), (2 * PART, len(durations), 1.0)):
        times = np.linspace(before[first], before[last], 300)[1:-1]
        then = np.interp(times, before, after)
        np.testing.assert_allclose(slower.position(then), planned.trajectory.position(times), atol=1e-7)
        wanted = planned.trajectory.acceleration(times) / scale**2
        np.testing.assert_allclose(slower.acceleration(then), wanted, atol=1e-4)
    again = planned.along(slower)
    assert again.certificate.within()
    assert again.d_min >= problem.required_margin
    with pytest.raises(SplineError, match="rests there"):
        planned.trajectory.slowed((PART + 1, 2 * PART), 1.5)


def test_a_body_that_rises_comes_to_rest_at_each_change(problem):
    """Limbs fold and stretch on the way: postures between the rests are not known."""
    up = np.array([0.0, 0.0, 1.1 * LEVEL])
    rests = [None if rest is None else rest + up * (key % 2) for key, rest in enumerate(problem.rests)]
    steep = replace(problem, rests=tuple(rests))
    keys = [*range(len(problem.sequence) + 1)]
    assert _parted(problem, keys) == [*range(0, len(problem.sequence), PART), len(problem.sequence)]
    assert _parted(steep, keys) == keys


@pytest.mark.long
def test_a_part_of_one_phase_has_the_six_conditions_of_rest_at_both_ends(problem):
    """A spline of degree 4, as walks have, would have five control points there."""
    kept = {1, *range(PART + 1, len(problem.sequence), PART)}
    rests = tuple(rest if key in kept else None for key, rest in enumerate(problem.rests))
    found = plan_com(replace(problem, degree=4, rests=rests))
    assert found.succeeded, found.failure
    assert found.residuals().within()
    assert resting(found) == sorted(kept)


def test_a_short_motion_and_one_without_rests_are_planned_at_once():
    """Nothing holds a motion still then between its ends."""
    short = replace(crawl(1), rests=())
    found = plan_com(short)
    assert found.succeeded
    assert np.linalg.norm(found.trajectory.velocity(found.key_instants[1:-1]), axis=1).min() > 1e-3


def test_a_part_that_fails_is_divided_at_its_rests_and_names_its_phase_in_the_whole(problem, monkeypatch):
    """The last of the parts into which it is divided fails as well, with either margin."""
    lengths = []

    def only_short_ones(part):
        lengths.append(len(part.sequence))
        if len(part.sequence) == 1 and len(lengths) < 4:
            return plan_com(part)
        found = replace(part, sequence=StanceSequence(part.sequence.phases[:1]), regions=())
        return replace(
            plan_com(found), failure=Failure("balance margin", "too small", 0, 0.25), trajectory=None
        )

    monkeypatch.setattr(timing_free, "plan_com", only_short_ones)
    failed = plan_com(problem)
    assert not failed.succeeded
    assert failed.trajectory is None
    assert lengths == [PART, 1, 1, 1, 1]
    assert failed.failure.phase == 2
    assert failed.failure.time > 0.25 + sum(problem.min_durations[:2]) - 1e-9  # after the parts before it
    assert "too small" in failed.failure.reason
