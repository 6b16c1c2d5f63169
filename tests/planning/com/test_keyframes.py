"""The keyframe-based method on the recorded CoM of an executed motion ([Qiu2012]_ 5.3)."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from manikin.balance import motion_margin, stability_margins, wrench_polytope
from manikin.errors import InputError
from manikin.motion.description import schedule_from
from manikin.numerics.spline import BSpline, basis_matrix
from manikin.planning.com import (
    GeometricConstraint,
    KeyframeProblem,
    RecordedCom,
    Weights,
    plan_com_through_key_frames,
)
from manikin.planning.com.keyframe_spline import keyframe_knots

FILE = Path(__file__).parent / "data" / "platform_com.csv"
MASS = 79.0
REST = (0.0, 0.0, 0.0)


def key_instants():
    line = FILE.read_text().splitlines()[1]
    return [float(word) for word in line.partition(":")[2].split()]


def recording(sequence, noise=0.0, seed=0):
    data = np.loadtxt(FILE, delimiter=",")
    error = np.random.default_rng(seed).normal(0.0, noise, (len(data), 3)) if noise else 0.0
    return RecordedCom(data[:, 0], data[:, 1:] + error, sequence, key_instants())


def problem(sequence, *, noise=0.0, seed=0, **options):
    return KeyframeProblem(MASS, recording(sequence, noise, seed), **options)


@pytest.fixture(scope="module")
def asked(platform_stances):
    return problem(platform_stances, start_acceleration=REST, goal_acceleration=REST)


@pytest.fixture(scope="module")
def found(asked):
    return plan_com_through_key_frames(asked)


@pytest.fixture(scope="module")
def repaired(platform_stances):
    """A margin that the first trajectory has at its key frames but not between them."""
    return plan_com_through_key_frames(problem(platform_stances, required_margin=11.0))


def test_it_passes_the_recorded_positions_at_the_key_frames(asked, found):
    assert found.succeeded, found.failure
    key = asked.recording
    np.testing.assert_allclose(
        found.trajectory.position(key.key_times), key.com[key.key_frames], rtol=0, atol=1e-9
    )
    assert found.residuals()["key frame position"].value < 1e-9


def test_it_starts_and_ends_at_rest(found):
    for time in (0.0, found.trajectory.duration):
        assert np.abs(found.trajectory.velocity(time)).max() < 1e-9
        assert np.abs(found.trajectory.acceleration(time)).max() < 1e-9


def test_given_velocities_are_met_and_free_ones_are_free(platform_stances):
    start = (0.05, 0.02, -0.01)
    result = plan_com_through_key_frames(problem(platform_stances, start_velocity=start, goal_velocity=None))
    np.testing.assert_allclose(result.trajectory.velocity(0.0), start, atol=1e-9)
    assert np.abs(result.trajectory.velocity(result.trajectory.duration)).max() > 1e-3


def test_timing_and_stances_are_those_of_the_recording(asked, found):
    np.testing.assert_array_equal(found.key_instants, asked.recording.key_times)
    assert found.trajectory.schedule.sequence is not None
    assert len(found.trajectory.schedule.sequence) == 7


def test_the_whole_motion_keeps_the_margin_every_millisecond(found, platform_stances):
    """Measured here from the polytopes, without the certificate."""
    time = np.arange(0.0, found.trajectory.duration, 1e-3)
    phases = found.trajectory.schedule.phase_at(time)
    wrench = found.trajectory.pseudo_wrench(time)
    com = found.trajectory.position(time)
    least = min(
        float(stability_margins(wrench_polytope(phase.stance), w, x).wrench_about_com.min())
        for index, phase in enumerate(platform_stances)
        for w, x in ((wrench[phases == index], com[phases == index]),)
    )
    assert least > 0.0
    assert found.d_min == pytest.approx(least, abs=0.05)  # the certificate looks at both sides of an instant


def test_the_recorded_motion_itself_is_balanced_at_every_frame(asked, found):
    """As in [Qiu2012]_ 4.4.1: the recorded positions with smoothed accelerations."""
    time, com = asked.recording.time, asked.recording.com
    acceleration = np.gradient(np.gradient(com, time, axis=0), time, axis=0)
    smooth = np.apply_along_axis(lambda a: np.convolve(a, np.ones(9) / 9, mode="same"), 0, acceleration)
    phases = found.trajectory.schedule.phase_at(time)
    force = MASS * (smooth + np.array([0.0, 0.0, 9.81]))
    wrench = np.column_stack([force, np.cross(com, force)])
    inner = slice(10, -10)
    stances = [phase.stance for phase in found.trajectory.schedule.sequence]
    assert motion_margin(stances, phases[inner], wrench[inner], com[inner]).margin.min() > 0.0


@pytest.fixture(scope="module")
def beam():
    """An executed passage under a beam with a left-hand grasp: 9 key frames, as in 01_TR_H1C1S2_1."""
    data = json.loads((FILE.parent / "beam_H1C1_S2.json").read_text())
    schedule = schedule_from(data["schedule"])
    time = 0.01 * np.arange(len(data["com"]))
    return KeyframeProblem(MASS, RecordedCom(time, data["com"], schedule.sequence, schedule.instants))


def test_nine_key_frames_have_sixteen_control_points_and_22_knots(beam):
    """The example of [Qiu2012]_ 5.3.3: degree 5, a left hand that grasps at the fifth key frame."""
    result = plan_com_through_key_frames(beam)
    assert len(beam.recording.key_frames) == 9
    assert "left_hand" not in beam.recording.sequence[3].stance
    assert "left_hand" in beam.recording.sequence[4].stance
    assert beam.control_points == len(result.trajectory.spline.control_points) == 16
    assert result.programme.degree == 5
    assert len(result.programme.knots) == 22


def test_the_passage_under_the_beam_is_balanced_throughout_and_fits_the_recording(beam):
    """[Qiu2012]_ 5.3.3: margins positive at all frames, a good fit; here 2 cm of a CoM path of 0.95 m."""
    result = plan_com_through_key_frames(beam)
    assert result.succeeded, result.failure
    assert result.added == ()
    assert result.d_min > 0.0
    assert result.residuals().within()
    distance = np.linalg.norm(result.trajectory.position(beam.recording.time) - beam.recording.com, axis=1)
    assert distance[beam.recording.key_frames].max() < 1e-9
    assert distance.max() < 0.02


def test_the_objective_is_the_exact_integral(found):
    """Adaptive quadrature of the mean squared velocity and jerk, weights 1 and 1e-3."""
    trajectory, total = found.trajectory, 0.0
    breaks = np.unique(trajectory.spline.knots) * trajectory.duration
    for start, end in itertools.pairwise(breaks):
        total += quad(lambda t: np.sum(trajectory.velocity(t) ** 2), start, end)[0]
        total += 1e-3 * quad(lambda t: np.sum(trajectory.jerk(t) ** 2), start, end)[0]
    # Weights' smoothness of 10 multiplies the mean.
    wanted = 10.0 * total / trajectory.duration
    assert found.programme.objective(trajectory.spline.control_points) == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize("margin", [0.0, 14.7])
def test_the_optimum_meets_the_kkt_conditions(platform_stances, margin):
    """Stationary on the equalities, multipliers not negative, complementary to the slack of the rows."""
    programme = plan_com_through_key_frames(
        problem(platform_stances, required_margin=margin, control_points=20)
    ).programme
    solution = programme.solve(margin)
    points = solution.control_points
    gradient = 2.0 * np.einsum("aij,ja->ia", programme.grams, points)
    gradient += (solution.multipliers @ programme.rows).reshape(-1, 3)
    # What is left must be a combination of the equalities' rows.
    rest = (
        gradient - programme.equalities.T @ np.linalg.lstsq(programme.equalities.T, gradient, rcond=None)[0]
    )
    size = np.abs(2.0 * np.einsum("aij,ja->ia", programme.grams, points)).max()
    assert np.abs(rest).max() < 1e-7 * size
    assert solution.multipliers.min() >= 0.0
    slack = programme.margins(points) - margin
    assert slack.min() >= 0.0
    assert np.all((solution.multipliers < 1e-9) | (slack < 1e-3))
    assert (solution.multipliers > 1e-9).any() == (margin > 0.0)


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(1e-4, 1e-2))
def test_perturbations_that_keep_the_key_frames_raise_the_objective(found, seed, size):
    """Nothing limits this solution but the equalities, so that every feasible direction is uphill."""
    programme, points = found.programme, found.trajectory.spline.control_points
    E = programme.equalities
    step = np.random.default_rng(seed).normal(size=points.shape)
    step -= np.linalg.pinv(E) @ (E @ step)
    step *= size / np.abs(step).max()
    assert programme.margins(points).min() > 0.0
    assert programme.objective(points + step) > programme.objective(points)


def test_balance_at_the_key_frames_limits_the_solution(platform_stances):
    """The required margin is kept to rounding by both polytopes at every key frame, and costs smoothness."""
    free, held = (
        plan_com_through_key_frames(problem(platform_stances, required_margin=m, control_points=20))
        for m in (0.0, 14.7)
    )
    cost = [r.programme.objective(r.trajectory.spline.control_points) for r in (free, held)]
    assert cost[1] > cost[0]
    assert free.d_min < 14.7 <= held.d_min


def test_added_key_frames_raise_the_least_margin(repaired, asked):
    assert repaired.succeeded, repaired.failure
    assert repaired.added
    assert repaired.least_margins[0] < 11.0 <= repaired.least_margins[-1] == repaired.d_min
    times = asked.recording.time[list(repaired.frames)]
    np.testing.assert_allclose(
        repaired.trajectory.position(times), asked.recording.com[list(repaired.frames)], rtol=0, atol=1e-9
    )


def test_each_added_key_frame_brings_a_control_point_and_keeps_its_distance(repaired, asked):
    assert len(repaired.programme.values) == len(repaired.frames) + 2
    assert len(repaired.trajectory.spline.control_points) == 15 + len(repaired.added)
    times = asked.recording.time[list(repaired.frames)]
    for frame in repaired.added:
        others = np.delete(times, repaired.frames.index(frame))
        assert np.abs(others - asked.recording.time[frame]).min() >= 0.05 - 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_a_noisy_recording_is_still_passed_and_balanced(platform_stances, seed):
    """2 mm of noise (standard deviation) on every coordinate of every sample."""
    asked = problem(platform_stances, noise=0.002, seed=seed, start_acceleration=REST, goal_acceleration=REST)
    result = plan_com_through_key_frames(asked)
    assert result.succeeded, result.failure
    assert result.d_min > 0.0
    assert result.residuals().within()
    key = asked.recording
    np.testing.assert_allclose(
        result.trajectory.position(key.key_times), key.com[key.key_frames], rtol=0, atol=1e-9
    )


def test_the_same_problem_gives_the_same_bits(asked, found):
    again = plan_com_through_key_frames(asked)
    assert np.array_equal(again.trajectory.spline.control_points, found.trajectory.spline.control_points)


def test_a_margin_beyond_the_intersections_is_explained(platform_stances):
    result = plan_com_through_key_frames(problem(platform_stances, required_margin=120.0))
    assert result.failure.requirement == "intersection"


def test_a_position_that_nothing_balances_is_explained(platform_stances):
    """The CoM 1.2 m beside the only foot: friction 0.7 reaches less than that at its height of 0.92 m."""
    good = recording(platform_stances)
    com = good.com.copy()
    com[good.key_frames[3]] += [1.2, 0.0, 0.0]
    asked = KeyframeProblem(MASS, RecordedCom(good.time, com, platform_stances, good.key_times))
    failure = plan_com_through_key_frames(asked).failure
    assert failure.requirement == "key frame balance"
    assert "key frame 3" in failure.reason
    assert failure.time == pytest.approx(good.key_times[3])


def test_a_recorded_position_that_breaks_a_constraint_is_explained(platform_stances):
    low = GeometricConstraint("height under the ceiling", lambda _x, _y, z: z - 0.9)
    failure = plan_com_through_key_frames(problem(platform_stances, geometric=[low])).failure
    assert failure.requirement == "height under the ceiling"
    limit = {"support_distance": 0.93}
    failure = plan_com_through_key_frames(problem(platform_stances, **limit)).failure
    assert failure.requirement == "support distance"
    assert "key frame" in failure.reason


def test_too_little_freedom_is_explained_with_the_largest_margin(platform_stances):
    result = plan_com_through_key_frames(problem(platform_stances, required_margin=14.7))
    assert not result.succeeded
    assert result.trajectory is None
    assert "15 control points" in result.failure.reason
    assert "the largest is 12." in result.failure.reason


def test_a_motion_that_no_sample_repairs_is_explained(platform_stances):
    """Only the key frames are given, so that nothing can be added."""
    full = recording(platform_stances)
    sparse = RecordedCom(
        full.time[full.key_frames], full.com[full.key_frames], platform_stances, full.key_times
    )
    result = plan_com_through_key_frames(KeyframeProblem(MASS, sparse, required_margin=11.0))
    assert not result.succeeded
    assert result.added == ()
    assert "no further sample of the recording helps" in result.failure.reason
    assert result.certificate.min_margin < 11.0


def test_constraints_on_the_position_bring_key_frames_too(platform_stances, platform):
    """The height band of the platform is kept by the recording but not by the smoothest curve."""
    band = platform().geometric
    plain = plan_com_through_key_frames(problem(platform_stances))
    positions = plain.trajectory.position(np.linspace(0.0, plain.trajectory.duration, 5001))
    assert max(constraint.violation(positions).max() for constraint in band) > 1e-4
    result = plan_com_through_key_frames(problem(platform_stances, geometric=band))
    positions = result.trajectory.position(np.linspace(0.0, result.trajectory.duration, 5001))
    assert result.added
    assert max(constraint.violation(positions).max() for constraint in band) <= 1e-6


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"control_points": 10}, "control_points is 10; valid: an integer >= 11"),
        ({"control_points": 12, "start_acceleration": REST, "goal_acceleration": REST}, "4 end conditions"),
        ({"control_points": 15.0}, "control_points is 15.0"),
        ({"degree": 2}, "degree is 2"),
        ({"frame_spacing": 0.0}, "frame_spacing"),
        ({"required_margin": float("nan")}, "required_margin"),
        ({"start_velocity": (0.0, 0.0)}, "start_velocity"),
        ({"weights": Weights(velocity=(1, 0, 1), jerk=(1, 0, 1))}, "all zero along an axis"),
    ],
)
def test_bad_problems_are_refused_in_one_line(platform_stances, options, says):
    with pytest.raises(InputError, match=says) as error:
        problem(platform_stances, **options)
    assert "\n" not in str(error.value)


@given(
    inner=st.lists(st.floats(0.01, 0.99), min_size=1, max_size=12, unique=True),
    extra=st.integers(0, 12),
    degree=st.integers(3, 7),
    derivatives=st.tuples(st.integers(0, 2), st.integers(0, 2)),
)
def test_key_frames_can_be_passed_whatever_their_times(inner, extra, degree, derivatives):
    """The interpolation conditions are independent (Schoenberg and Whitney)."""
    frames = np.array([0.0, *sorted(inner), 1.0])
    frames = frames[np.concatenate([[True], np.diff(frames) > 1e-3])]
    frames[-1] = 1.0
    count = max(len(frames) + sum(derivatives) + extra, degree + 1)
    knots = keyframe_knots(degree, frames, count, *derivatives)
    conditions = [basis_matrix(degree, knots, frames)]
    for end, number in zip((0.0, 1.0), derivatives, strict=True):
        conditions += [basis_matrix(degree, knots, end, order) for order in range(1, number + 1)]
    rows = np.vstack(conditions)
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    BSpline(degree, knots, np.zeros((count, 1)))
    assert np.linalg.matrix_rank(rows, tol=1e-12) == len(rows)
