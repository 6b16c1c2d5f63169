"""A programme assembled from elements has the derivatives and the optimum of the one written as a whole."""

import casadi as ca
import numpy as np
import pytest

from manikin.numerics.element_program import Element, PlacedElement, compile_programme

QUIET = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
PLACES = [np.array([0, 1]), np.array([2, 1]), np.array([4, 3])]
"""Unknowns of the three elements: one is shared, and their order differs."""


def terms(x, p):
    """Objective and rows of two unknowns and a parameter, with a Hessian in every entry."""
    return (x[0] - p) ** 2 * (1 + x[1] ** 2) + x[1] ** 4, ca.vertcat(x[0] * x[1], ca.sin(x[0]) + x[1])


def plane(x, p):
    """No objective and one row without curvature, as the rows of planes are."""
    return ca.SX(0), p * x[0] + x[1]


@pytest.fixture(scope="module")
def programmes():
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    kinds = [terms, terms, plane]
    placed = [
        PlacedElement(Element(x, p, *kind(x, p)), at, np.array([number]))
        for number, (kind, at) in enumerate(zip(kinds, PLACES, strict=True))
    ]
    assembled = compile_programme("assembled", placed, 5, 3, QUIET)
    every, given = ca.SX.sym("x", 5), ca.SX.sym("p", 3)
    parts = [
        kind(every[at.tolist()], given[number])
        for number, (kind, at) in enumerate(zip(kinds, PLACES, strict=True))
    ]
    objective, rows = sum(part[0] for part in parts), ca.vertcat(*(part[1] for part in parts))
    whole = {"x": every, "p": given, "f": objective, "g": rows}
    return assembled, ca.nlpsol("whole", "ipopt", whole, QUIET)


def test_derivatives_are_those_of_the_whole(programmes):
    rng = np.random.default_rng(3)
    x, p, multipliers = rng.normal(size=5), rng.normal(size=3), rng.normal(size=5)
    for name, given in (
        ("nlp_f", (x, p)), ("nlp_g", (x, p)), ("nlp_grad_f", (x, p)), ("nlp_jac_g", (x, p)),
        ("nlp_hess_l", (x, p, 0.7, multipliers)),
    ):  # fmt: skip
        one, other = (programme.get_function(name)(*given) for programme in programmes)
        pairs = zip(one, other, strict=True) if isinstance(one, tuple) else [(one, other)]
        for mine, theirs in pairs:
            # Sums of a few products of numbers near one in another order.
            assert np.allclose(np.asarray(mine), np.asarray(theirs), rtol=1e-13, atol=1e-13), name


def test_a_shared_unknown_adds_its_curvatures(programmes):
    """Unknown 1 belongs to two elements, which share one entry of the Hessian; a plane has none."""
    assembled = programmes[0].get_function("nlp_hess_l")
    assert assembled.nnz_out(0) == 3 + 2


def test_the_optimum_is_that_of_the_whole(programmes):
    bounds = {"x0": np.full(5, 0.5), "p": [1.0, -0.5, 2.0], "lbg": np.full(5, -0.3), "ubg": np.full(5, 0.8)}
    found = [np.asarray(programme(**bounds)["x"]).ravel() for programme in programmes]
    # Both end within the solver's tolerance of 1e-10 of a minimum with curvatures near one.
    assert np.allclose(*found, atol=1e-8)
