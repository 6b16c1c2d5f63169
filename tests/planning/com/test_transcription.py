"""The programme says the same as the spline, the wrench and the polytopes."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.numerics.spatial import GRAVITY, GRAVITY_VECTOR
from manikin.numerics.spline import BSpline, bernstein_matrix, clamped_knots
from manikin.planning.com.com_constraints import CeilingHeight, Zone, height_below
from manikin.planning.com.feasibility import polytopes_of
from manikin.planning.com.optimise import (
    MarginTargets,
    build_programme,
    facet_distances,
    nearest_facets,
    optimise,
    trajectory_of,
    with_violated,
)
from manikin.planning.com.timing_free import GUESS_STYLES, PENDULUM, guess
from manikin.planning.com.transcription import (
    ComStructure,
    bernstein_gram,
    spline_from_bezier,
    transcribe,
    written,
)
from manikin.scenarios import load_scenario


@given(st.integers(3, 6), st.lists(st.floats(0.1, 2.0), min_size=1, max_size=8), st.integers(0, 2**16))
def test_spline_and_bezier_pieces_are_the_same_curve(degree: int, durations: list[float], seed: int):
    """Phases as polynomials with k - 1 continuous derivatives are the spline of 5.4.3."""
    total = sum(durations)
    knots = clamped_knots(degree, np.concatenate([[0.0], np.cumsum(durations)]) / total)
    points = np.random.default_rng(seed).normal(size=(len(knots) - degree - 1, 3))
    spline = BSpline(degree, knots, points)
    again = spline_from_bezier(
        spline.bezier_points(), np.array(durations), start=(points[0],), goal=(points[-1],)
    )
    t = np.linspace(0.0, 1.0, 101)
    assert np.allclose(again(t), spline(t), atol=1e-8)


def test_gram_matrix_integrates_products():
    s = (np.arange(20000) + 0.5) / 20000
    basis = bernstein_matrix(4, s)
    # The midpoint rule's error is its step squared, 2.5e-9, times second derivatives of about 20.
    assert np.allclose(bernstein_gram(4), basis.T @ basis / len(s), atol=1e-7)


@pytest.mark.parametrize("style", [PENDULUM, *GUESS_STYLES])
def test_guesses_meet_the_ends_and_the_durations(platform, style):
    for problem in (platform(), platform(max_duration=2.7)):
        bezier, durations = guess(problem, style, polytopes_of(problem))
        assert np.allclose(bezier[0, 0], problem.start_com)
        assert np.allclose(bezier[-1, -1], problem.goal_com)
        assert np.allclose(bezier[0, 1], problem.start_com)
        assert np.all(durations >= problem.min_durations)
        assert durations.sum() <= problem.max_duration


def programme_values(problem, bezier, durations, margin):
    """Objective and rows of the programme at a point."""
    polytopes = polytopes_of(problem)
    facets = tuple(np.arange(len(polytope.h)) for polytope in polytopes)
    programme = build_programme(problem, facets)
    from manikin.planning.com.optimise import _parameters

    unknowns = programme.pack_unknowns(
        bezier - problem.reference, durations, float(durations.sum()), margin, 0.0
    )
    values = programme.pack_parameters(_parameters(problem, polytopes, facets))
    oracle = programme.solver.get_function("nlp_f"), programme.solver.get_function("nlp_g")
    objective, rows = (np.asarray(function(unknowns, values)).ravel() for function in oracle)
    return programme, polytopes, float(objective[0]), rows


def _about(point, reference):
    """(6, 6) map of wrenches about a reference to such about a point."""
    x, y, z = reference - point
    moved = np.eye(6)
    moved[3:, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    return moved


@pytest.mark.parametrize("space", ["wrench", "wrench_about_origin"])
def test_balance_rows_are_the_facet_distances_at_the_samples(platform, space):
    """Row j of a phase is h - H w - d |H| about the CoM at j / n_s of the phase, j = 0 ... n_s (Q-8)."""
    problem = platform(margin_space=space)
    bezier, durations = guess(problem, GUESS_STYLES[0], polytopes_of(problem))
    programme, polytopes, _, rows = programme_values(problem, bezier, durations, 7.0)
    trajectory = trajectory_of(problem, bezier, durations)
    phase, start = 0, 0
    for group, count in programme.groups:
        if group == "balance":
            instants = trajectory.schedule.instants[phase : phase + 2]
            times = np.linspace(*instants, problem.samples + 1)
            values = rows[start : start + count].reshape(-1, problem.samples + 1).T * 10.0
            for time, value in zip(times, values, strict=True):
                com = trajectory.position(time)
                about = np.zeros(3) if space == "wrench_about_origin" else com
                at = polytopes[phase].at_reference(about)
                length = 1.0 / np.linalg.norm(at.H @ _about(about, problem.reference), axis=1)
                distances = at.distances(trajectory.pseudo_wrench(time, about))
                # Rows of length 1 about the middle of the contacts, but about the origin of length 1 there.
                wanted = distances - 7.0 if space == "wrench_about_origin" else length * (distances - 7.0)
                assert np.allclose(value, wanted, atol=1e-6)
            phase += 1
        start += count
    assert phase == 7


def test_continuity_and_end_rows_vanish_on_a_spline(platform):
    problem = platform()
    bezier, durations = guess(problem, GUESS_STYLES[0], polytopes_of(problem))
    programme, _, _, rows = programme_values(problem, bezier, durations, 0.0)
    start = 0
    ends = 0
    for group, count in programme.groups:
        values = rows[start : start + count]
        if group == "continuity":
            assert np.allclose(values, 0.0, atol=1e-9)
        if group == "end":
            # Velocities vanish in the guess, accelerations (every second group) need not.
            assert ends % 2 == 1 or np.allclose(values, 0.0, atol=1e-12)
            ends += 1
        start += count


def test_objective_is_the_time_average_of_the_squares(platform):
    """[Qiu2012]_ 5.28 against a fine sum over samples of the trajectory."""
    problem = platform()
    bezier, durations = guess(problem, GUESS_STYLES[0], polytopes_of(problem))
    _, _, objective, _ = programme_values(problem, bezier, durations, 7.0)
    trajectory = trajectory_of(problem, bezier, durations)
    t = (np.arange(200_000) + 0.5) / 200_000 * trajectory.duration
    w = problem.weights
    mean = np.mean(
        (trajectory.velocity(t) ** 2) @ w.velocity
        + (trajectory.acceleration(t) ** 2) @ w.acceleration
        + (trajectory.jerk(t) ** 2) @ w.jerk
    )
    expected = -w.margin * 7.0 + w.smoothness * mean + w.duration * trajectory.duration
    # Kinks of the jerk at six knots between 200000 midpoints: relative error below 1e-6.
    assert objective == pytest.approx(expected, rel=1e-5)


def test_nearest_facets_are_kept_and_violated_ones_added():
    distances = [np.array([5.0, 1.0, 9.0, 3.0]), np.array([2.0])]
    chosen = nearest_facets(distances, 2)
    assert [list(rows) for rows in chosen] == [[1, 3], [0]]
    assert [list(rows) for rows in with_violated(chosen, distances, 4.0, 1)] == [[1, 3], [0]]
    assert [list(rows) for rows in with_violated(chosen, distances, 6.0, 1)] == [[0, 1, 3], [0]]


def test_leaving_facets_out_does_not_change_the_solution(platform):
    """Few facets with a certificate over all give the optimum of all facets."""
    problem = platform()
    polytopes = polytopes_of(problem)
    bezier, durations = guess(problem, GUESS_STYLES[0], polytopes_of(problem))
    distances = facet_distances(problem, trajectory_of(problem, bezier, durations), polytopes)
    few, every = nearest_facets(distances), nearest_facets(distances, 1000)
    attempts = [
        optimise(problem, polytopes, facets, MarginTargets.of(problem), bezier, durations)
        for facets in (few, every)
    ]
    assert all(attempt.converged for attempt in attempts)
    assert attempts[0].margin == pytest.approx(attempts[1].margin, abs=1e-3)
    assert np.allclose(attempts[0].durations, attempts[1].durations, atol=1e-3)


def test_problems_of_one_structure_share_the_compiled_programme(platform):
    heavier = platform(mass=95.0, goal_com=(0.61, 0.64, 0.86))
    facets = tuple(np.arange(12) for _ in range(7))
    assert build_programme(platform(), facets) is build_programme(heavier, facets)


def test_the_pendulum_stands_on_its_feet():
    """In the middle of each single support the zero moment point of the guess is on the sole."""
    problem = load_scenario("walk").build_centroidal_problem()
    bezier, durations = guess(problem, PENDULUM, polytopes_of(problem))
    trajectory = trajectory_of(problem, bezier, durations)
    instants = trajectory.schedule.instants
    for phase, start, end in zip(problem.sequence, instants[:-1], instants[1:], strict=True):
        if len(phase.stance) > 1:
            continue
        (contact,) = phase.stance
        time = (start + end) / 2
        com, acceleration = trajectory.position(time), trajectory.acceleration(time)
        zmp = com - com[2] / (GRAVITY + acceleration[2]) * (acceleration - GRAVITY_VECTOR)
        local = contact.rotation_contact_to_world.T @ (zmp - contact.position)
        assert abs(local[0]) < contact.length / 2
        assert abs(local[1]) < contact.width / 2


def test_second_derivatives_grow_with_the_number_of_phases_only():
    """Twice the phases have twice the entries of the Hessian, but for the few unknowns that all share."""

    def entries(phases):
        structure = ComStructure(4, 2, (1,) * phases, (1,) * phases, "wrench", (), False)
        return transcribe(structure).solver.get_function("nlp_hess_l").nnz_out(0)

    few, double = entries(4), entries(8)
    # One block is (3 (k + 1) + 1)^2 / 2; ties to the neighbour through the continuity are of the same kind.
    assert double / few == pytest.approx(2.0, rel=0.1)


def test_equal_problems_share_one_programme():
    """Each of ten runs of a scenario with an overhead obstacle kept 60 MB of another programme."""
    surfaces = [
        CeilingHeight(Zone.below([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (), 0.1), 1.1, low)
        for low in (0.8, 0.8, 0.7)
    ]
    texts = [written(height_below("roof", surface).function) for surface in surfaces]
    assert texts[0] == texts[1]
    assert texts[0] != texts[2]
    structures = [ComStructure(4, 2, (1,), (1,), "wrench", (text,), False) for text in texts]
    before = transcribe.cache_info().misses
    programmes = [transcribe(structure) for structure in structures]
    assert transcribe.cache_info().misses - before == 2
    assert programmes[0] is programmes[1]


def test_a_written_constraint_has_the_values_of_its_function():
    surface = CeilingHeight(Zone.below([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (), 0.1), 1.1, 0.8)
    function = height_below("roof", surface).function
    again, places = ca.Function.deserialize(written(function)), np.random.default_rng(0).random((50, 3))
    found = [float(again(*place)) for place in places]
    np.testing.assert_allclose(found, function(*places.T), rtol=0.0, atol=1e-15)
