"""The banded assembly agrees with dense linear algebra."""

import numpy as np
from scipy.interpolate import BSpline

from manikin.numerics.banded import BlockBandedSystem, SampledBasis


def _setup():
    degree = 5
    knots = np.concatenate([np.zeros(degree + 1), [0.2, 0.5, 0.9, 1.4], np.full(degree + 1, 2.0)])
    time = np.linspace(0.0, 2.0, 41)
    return degree, knots, time, SampledBasis.at(time, knots, degree)


def test_basis_evaluates_the_spline_and_its_derivatives():
    degree, knots, time, basis = _setup()
    points = np.random.default_rng(0).normal(size=(basis.size, 3))
    spline = BSpline(knots, points, degree)
    for order in range(3):
        # Second derivatives are of order 1e3 here, so 1e-9 is near machine precision.
        np.testing.assert_allclose(basis.evaluate(points, order), spline(time, nu=order), atol=1e-9)


def test_solution_equals_the_dense_normal_equations():
    degree, knots, time, basis = _setup()
    rng = np.random.default_rng(1)
    d, n = 4, len(time)
    system = BlockBandedSystem(basis, d)
    dense, right = np.zeros((basis.size * d,) * 2), np.zeros(basis.size * d)
    identity = BSpline(knots, np.eye(basis.size), degree)
    for order in range(3):
        jacobian = rng.normal(size=(n, 6, d))
        residual = rng.normal(size=(n, 6))
        system.add(jacobian.transpose(0, 2, 1) @ jacobian, np.einsum("nrd,nr->nd", jacobian, residual), order)
        for k, row in enumerate(identity(time, nu=order)):
            full = np.kron(row[None], jacobian[k])
            dense += full.T @ full
            right -= full.T @ residual[k]
    expected = np.linalg.solve(dense + 1e-3 * np.eye(len(dense)), right).reshape(basis.size, d)
    np.testing.assert_allclose(system.solve(1e-3), expected, rtol=1e-6, atol=1e-9)


def test_coupled_terms_equal_the_dense_normal_equations():
    degree, knots, time, basis = _setup()
    rng = np.random.default_rng(2)
    d, n = 3, len(time)
    jacobians = tuple(rng.normal(size=(n, 2, d)) for _ in range(3))
    residual = rng.normal(size=(n, 2))
    system = BlockBandedSystem(basis, d)
    system.add_coupled(jacobians, residual)
    identity = BSpline(knots, np.eye(basis.size), degree)
    full = sum(
        np.einsum("ns,nmd->nmsd", identity(time, nu=order), jacobians[order]) for order in range(3)
    ).reshape(n * 2, -1)
    dense = full.T @ full + 1e-3 * np.eye(full.shape[1])
    expected = np.linalg.solve(dense, -full.T @ residual.ravel()).reshape(basis.size, d)
    np.testing.assert_allclose(system.solve(1e-3), expected, rtol=1e-6, atol=1e-9)


def test_diagonal_terms_equal_full_ones():
    _, _, time, basis = _setup()
    rng = np.random.default_rng(3)
    weight, gradient = rng.uniform(size=(len(time), 4)), rng.normal(size=(len(time), 4))
    full, diagonal = BlockBandedSystem(basis, 4), BlockBandedSystem(basis, 4)
    for order in range(3):
        full.add(np.einsum("nd,de->nde", weight, np.eye(4)), gradient, order)
        diagonal.add_diagonal(weight, gradient, order)
    np.testing.assert_array_equal(diagonal.solve(1e-3), full.solve(1e-3))


def test_constrained_step_is_that_of_the_dense_optimality_conditions():
    """Residuals of some samples vanish; the step is the best of those for which they do (KKT system)."""
    degree, knots, time, basis = _setup()
    rng = np.random.default_rng(4)
    d, n = 3, len(time)
    wished, residual = rng.normal(size=(n, 4, d)), rng.normal(size=(n, 4))
    held = np.zeros((n, 1), dtype=bool)
    held[::8] = True  # Fewer constraints than control points.
    jacobian, missing = held[:, :, None] * rng.normal(size=(n, 1, d)), held * rng.normal(size=(n, 1))
    system = BlockBandedSystem(basis, d)
    dense, right = 1e-2 * np.eye(basis.size * d), np.zeros(basis.size * d)
    rows = []
    for part, value in ((wished, residual), (jacobian, missing)):
        transposed = part.transpose(0, 2, 1)
        system.add(transposed @ part, (transposed @ value[:, :, None])[:, :, 0])
        for k, row in enumerate(BSpline(knots, np.eye(basis.size), degree)(time)):
            full = np.kron(row[None], part[k])
            dense += full.T @ full
            right -= full.T @ value[k]
            if part is jacobian and held[k]:
                rows.append((full, value[k]))
    constraints, values = (np.concatenate(items) for items in zip(*rows, strict=True))
    size = len(values)
    kkt = np.block([[dense, constraints.T], [constraints, np.zeros((size, size))]])
    expected = np.linalg.solve(kkt, np.concatenate([right, -values]))
    step, multiplier = system.factorised(1e-2).constrained(
        system.right, jacobian, missing, np.zeros((n, 1)), rounds=40
    )
    np.testing.assert_allclose(step.ravel(), expected[: basis.size * d], atol=1e-6)
    np.testing.assert_allclose(multiplier[held], expected[basis.size * d :], atol=1e-5)
