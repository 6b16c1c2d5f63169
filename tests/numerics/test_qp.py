"""Quadratic programs against their optimality conditions and each other."""

import numpy as np
import pytest
from scipy import sparse

from manikin.numerics.qp import QuadraticProgram, WarmQPSolver, solve_qp, solve_sparse_qp


def program(seed):
    """A random program with two equalities, one-sided rows, and bounds on half of the unknowns."""
    rng = np.random.default_rng(seed)
    n, m = 12, 8
    factor, rows = rng.normal(size=(n, n)), rng.normal(size=(m, n))
    inside = rng.uniform(-0.5, 0.5, n)
    upper = rows @ inside + np.r_[0.0, 0.0, rng.uniform(0.0, 0.2, m - 2)]
    lower = np.r_[upper[:2], np.full(m - 2, -np.inf)]
    half = np.arange(n) < n // 2
    return QuadraticProgram(
        factor @ factor.T + np.eye(n), 5.0 * rng.normal(size=n), rows, lower, upper,
        np.where(half, -0.5, -np.inf), np.where(half, 0.5, np.inf), 2,
    )  # fmt: skip


def dense(item):
    return solve_qp(
        item.hessian, item.gradient, item.rows, item.rows_lower, item.rows_upper, (item.lower, item.upper),
        equalities=item.equalities,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_a_solution_is_optimal(seed):
    """Stationary with multipliers of the right sign, which vanish where a row or bound is not reached."""
    item = program(seed)
    solution = dense(item)
    assert solution.solved
    assert item.violation(solution.x) < 1e-6
    by_bound, by_row = np.split(solution.multipliers, [len(item.gradient)])
    slope = item.hessian @ solution.x + item.gradient + by_bound + item.rows.T @ by_row
    np.testing.assert_allclose(slope, 0.0, atol=1e-6)
    assert np.all(by_row[2:] >= -1e-9)
    assert np.all(np.abs(by_row[2:] * (item.rows_upper - item.rows @ solution.x)[2:]) < 1e-6)


def test_the_three_calls_agree():
    """A warm sequence gives each program its own solution, and so does the sparse solver."""
    warm = WarmQPSolver()
    for seed in range(5):
        item = program(seed)
        expected = dense(item)
        solution = warm.solve(item)
        other = solve_sparse_qp(
            sparse.csc_array(item.hessian), item.gradient, sparse.csc_array(item.rows),
            item.rows_lower, item.rows_upper, (item.lower, item.upper), equalities=2, tolerance=1e-9,
        )  # fmt: skip
        assert solution.solved
        assert other.solved
        np.testing.assert_allclose(solution.x, expected.x, atol=1e-6)
        np.testing.assert_allclose(other.x, expected.x, atol=1e-6)


def test_rows_without_a_solution_are_told():
    """Unknowns below 0 and above 1 do not exist; the sequence solves the next program all the same."""
    rows = np.array([[1.0], [1.0]])
    lower, upper = np.array([-np.inf, 1.0]), np.array([0.0, np.inf])
    eye, zero, free = np.eye(1), np.zeros(1), np.array([np.inf])
    assert not solve_qp(eye, zero, rows, np.array([-1e30, 1.0]), np.array([0.0, 1e30])).solved
    assert not solve_sparse_qp(sparse.csc_array(eye), zero, sparse.csc_array(rows), lower, upper,
                               (-free, free)).solved  # fmt: skip
    warm = WarmQPSolver()
    impossible = QuadraticProgram(eye, zero, rows, lower, upper, -free, free, 0)
    solution = warm.solve(impossible)
    assert not solution.solved
    assert solution.status.startswith("daqp")
    possible = QuadraticProgram(eye, zero, rows, lower, np.array([2.0, np.inf]), -free, free, 0)
    assert warm.solve(possible).x == pytest.approx([1.0])


def test_a_soft_row_is_violated_at_its_price():
    """The least x^2 / 2 + (1 - x)^2 / (2 s) is at 1 / (1 + s)."""
    solution = solve_qp(np.eye(1), np.zeros(1), np.eye(1), np.ones(1), None, softness=0.25)
    assert solution.solved
    assert solution.x == pytest.approx([0.8])
    hard = solve_qp(np.eye(1), np.zeros(1), np.eye(1), np.ones(1), None)
    assert hard.x == pytest.approx([1.0])


def test_inputs_may_be_read_only_or_transposed():
    item = program(3)
    hessian, rows = np.asfortranarray(item.hessian), np.asfortranarray(item.rows)
    rows.setflags(write=False)
    solution = solve_qp(hessian, item.gradient, rows, None, item.rows_upper)
    same = solve_qp(item.hessian, item.gradient, item.rows, None, item.rows_upper)
    np.testing.assert_array_equal(solution.x, same.x)


def test_unbounded_unknowns_leave_the_rest():
    item = program(0).without_bounds(0, 3)
    assert np.isinf(item.lower[:3]).all()
    np.testing.assert_array_equal(item.upper[3:], program(0).upper[3:])
