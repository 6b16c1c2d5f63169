"""Best paths of the clothoid system: goals met, necessary conditions, words, symmetry, a peer's optimum."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from manikin.errors import InputError
from manikin.walking import START
from manikin.walking.words import STRAIGHT, WordPath, residuals, word_path, word_paths, word_program
from manikin.walking.words.word_program import DEGREE, basis
from manikin.walking.words.word_solver import cheapest, guesses, words_of

BEGIN = np.array(START)


def grid_goals(rng, count):
    """Goals on the thesis' grid."""
    return np.column_stack(
        [
            -2.0 + 0.2 * rng.integers(21, size=count),
            3.0 + 0.2 * rng.integers(31, size=count),
            np.radians(10.0 * rng.integers(36, size=count)),
        ]
    )


def wrapped(angle):
    return abs(np.angle(np.exp(1j * angle)))


def test_polynomials_let_the_curvature_end_at_zero():
    ends = basis(np.array([0.0, 1.0]), 1)
    assert np.allclose(ends, 0.0, atol=1e-12)
    turned = basis(np.array([1.0]), 2)[0]
    assert np.allclose(turned, [-1 / 6, *np.zeros(DEGREE - 1)], atol=1e-12)


def test_a_goal_straight_ahead_is_walked_to_straight():
    path = word_path((0.0, 5.0, np.pi / 2))
    assert path.word == STRAIGHT
    assert path.cost == pytest.approx(5.0, abs=1e-9)
    assert path.switches.size == 0


@pytest.mark.parametrize("goal", grid_goals(np.random.default_rng(0), 3))
def test_system_leads_to_the_goal_and_the_cost_is_its_integral(goal):
    """The system (3.2), integrated by another method under u2, ends at the goal to 1e-8."""
    path = word_path(goal)

    def rate(s, state):
        u2 = float(path.curvature_rate(np.array([s / path.length]))[0])
        return [np.cos(state[2]), np.sin(state[2]), state[3], u2, 1.0 + u2**2]

    end = solve_ivp(rate, (0.0, path.length), [*START, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-12).y[
        :, -1
    ]
    assert np.hypot(*(end[:2] - goal[:2])) < 1e-8
    assert wrapped(end[2] - goal[2]) < 1e-8
    assert abs(end[3]) < 1e-9
    assert end[4] == pytest.approx(path.cost, rel=1e-9)


def test_many_goals_are_met_and_satisfy_the_maximum_principle():
    """Ends to 1e-9; u2 agrees with the adjoint to 1e-3 of its largest value; the Hamiltonian is zero."""
    paths = word_paths(grid_goals(np.random.default_rng(3), 40))
    found = residuals(
        BEGIN, np.array([p.goal for p in paths]), np.array([p.shape for p in paths]),
        np.array([p.length for p in paths]),
    )  # fmt: skip
    assert found.position.max() < 1e-9
    assert found.heading.max() < 1e-9
    assert found.curvature.max() < 1e-9
    assert found.adjoint.max() < 1e-3
    assert found.hamiltonian.max() < 1e-3


def test_a_path_that_is_no_optimum_fails_the_maximum_principle():
    path = word_path((1.0, 5.0, 0.5))
    shape = path.shape.copy()
    shape[3] += 20.0
    found = residuals(BEGIN, path.goal[None], shape[None], np.array([path.length]))
    assert found.adjoint[0] > 0.05
    assert found.position[0] > 1e-3


def test_mirrored_goals_have_mirrored_words_and_equal_costs():
    """Left and right are alike: x and the heading mirrored swap I and D."""
    goals = grid_goals(np.random.default_rng(1), 10)
    mirrored = goals * [-1.0, 1.0, -1.0] + [0.0, 0.0, np.pi]
    for one, other in zip(word_paths(goals), word_paths(mirrored), strict=True):
        assert one.cost == pytest.approx(other.cost, rel=1e-7)
        if one.length == pytest.approx(other.length, rel=1e-5) and abs(one.turn + other.turn) < 1e-6:
            swapped = other.word.translate(str.maketrans("ID", "DI")) if other.word != STRAIGHT else STRAIGHT
            assert one.word == swapped


def test_a_turned_start_turns_the_path():
    goal = np.array([1.2, 4.0, 2.5])
    path = word_path(goal)
    angle, shift = 0.7, np.array([3.0, -1.0])
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = word_path([*(rotation @ goal[:2] + shift), goal[2] + angle], [*shift, START[2] + angle])
    assert moved.word == path.word
    assert moved.cost == pytest.approx(path.cost, rel=1e-9)
    assert np.allclose(moved.states()[:, :2], path.states()[:, :2] @ rotation.T + shift, atol=1e-6)


def test_switching_points_are_the_extrema_of_the_curvature():
    path = word_path((-0.2, 6.0, np.radians(270)))
    assert len(path.switches) == len(path.word) - 1
    share = path.switches / path.length
    assert np.allclose(path.curvature_rate(share), 0.0, atol=1e-9)
    for at in share:
        around = path.curvature(np.array([at - 1e-3, at, at + 1e-3]))
        assert (around[1] - around[0]) * (around[2] - around[1]) < 0.0


def test_word_of_a_known_curvature():
    """u2 = cos(2 pi s): rises, falls, rises; the polynomials are fitted to it."""
    share = np.linspace(0.0, 1.0, 400)
    shape = np.linalg.lstsq(basis(share, 0), np.cos(2 * np.pi * share), rcond=None)[0]
    path = WordPath(BEGIN, BEGIN, shape, 1.0, 0.0)
    assert path.word == "IDI"
    assert path.switches == pytest.approx([0.25, 0.75], abs=1e-6)


def transcribed(path, intervals=100):
    """Cost of the same problem by direct collocation of the system (3.2) with IPOPT, from a path."""
    u, length = ca.SX.sym("u", 2 * intervals + 1), ca.SX.sym("L")
    z = ca.SX.sym("z", 4, intervals + 1)
    step = length / intervals

    def rate(state, control):
        return ca.vertcat(ca.cos(state[2]), ca.sin(state[2]), state[3], control)

    rows, cost = [z[:, 0] - ca.DM([*START, 0.0]), z[:, -1] - ca.DM([*path.goal, 0.0])], 0
    for i in range(intervals):
        a, m, b = u[2 * i], u[2 * i + 1], u[2 * i + 2]
        before, after = z[:, i], z[:, i + 1]
        fa, fb = rate(before, a), rate(after, b)
        middle = (before + after) / 2 + step / 8 * (fa - fb)
        rows.append(after - before - step / 6 * (fa + 4 * rate(middle, m) + fb))
        cost += step * (1 + (a**2 + 4 * m**2 + b**2) / 6)
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9}}
    problem = {"x": ca.vertcat(u, ca.vec(z), length), "f": cost, "g": ca.vertcat(*rows)}
    solver = ca.nlpsol("words", "ipopt", problem, options)
    control = path.curvature_rate(np.linspace(0, 1, 2 * intervals + 1))
    states = path.states()[:: 400 // intervals]
    found = solver(x0=np.concatenate([control, states.ravel(), [path.length]]), lbg=0, ubg=0)
    assert solver.stats()["success"]
    return float(found["f"])


@pytest.mark.parametrize("seed", range(3))
def test_direct_transcription_reaches_the_same_cost(seed):
    """Simpson's collocation on 100 intervals, whose error is of fourth order: 1e-5 of the cost."""
    path = word_path(grid_goals(np.random.default_rng(100 + seed), 1)[0])
    assert transcribed(path) == pytest.approx(path.cost, rel=1e-5)


def test_polynomials_of_higher_degree_change_nothing():
    paths = word_paths(grid_goals(np.random.default_rng(6), 20))
    goals = word_program.Goals.of(BEGIN, np.array([path.goal for path in paths]))
    finer = word_program.minimise(goals, np.array([[*path.shape, *np.zeros(12)] for path in paths]))
    assert np.allclose(finer.cost, [path.cost for path in paths], rtol=0.0, atol=1e-8)
    assert words_of(finer.shapes, finer.length) == [path.word for path in paths]


@pytest.mark.parametrize("count", [2, pytest.param(10, marks=pytest.mark.long)])
def test_more_guesses_find_nothing_cheaper(count):
    """Sixty random guesses for each turn, beside the fifteen that are used."""
    rng = np.random.default_rng(8)
    goals = grid_goals(rng, count)
    used = cheapest(BEGIN, goals, guesses())[1].cost
    random = [tuple(rng.normal(size=5) * [2.0, 1.5, 1.0, 0.5, 0.3]) for _ in range(60)]
    assert np.all(cheapest(BEGIN, goals, random)[1].cost > used * (1.0 - 1e-8))


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ((0.1, 0.2, 0.0), "0.5 to 15 m"),
        ((np.nan, 1.0, 0.0), "finite"),
        ((1.0, 2.0), "shape"),
        ((0, 40, 0), "40 m"),
    ],
)
def test_goals_that_are_not_usable_are_refused(goal, message):
    with pytest.raises(InputError, match=message):
        word_path(goal)


def test_a_singular_system_spoils_no_other():
    systems = np.array([np.eye(2), np.zeros((2, 2)), 2.0 * np.eye(2)])
    found = word_program._solved(systems, np.ones((3, 2)))
    assert np.allclose(found[[0, 2]], [[1.0, 1.0], [0.5, 0.5]])
    assert np.isnan(found[1]).all()
