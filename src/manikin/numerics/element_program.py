"""Nonlinear programmes assembled from elements, as a stiffness matrix is in the finite-element method.

The objective of a programme in time is a sum, and its rows are a column, of terms of few unknowns; most terms
have the same expressions on other unknowns. An :class:`Element` is written, differentiated and compiled once;
a programme of many of them is put together from their derivatives, in a small share of the time that CasADi
needs to differentiate the whole.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


class Element:
    """Objective and rows of some unknowns x and parameters p, with their derivatives.

    Attributes:
        objective, gradient: Functions of (x, p), as are the next two.
        rows, slopes: The rows, and the nonzeros of their Jacobian.
        curvature: Function of (x, p, factor of the objective, multipliers of the rows), the nonzeros of the
            upper triangle of the Hessian of the Lagrangian.
        jacobian, hessian: Rows and columns of those nonzeros.
        count: Number of rows.
    """

    def __init__(self, unknowns: ca.SX, parameters: ca.SX, objective: ca.SX, rows: ca.SX) -> None:
        factor, multipliers = ca.SX.sym("factor"), ca.SX.sym("multipliers", rows.numel())
        jacobian, given = ca.jacobian(rows, unknowns), [unknowns, parameters]
        lagrangian = factor * objective + ca.dot(multipliers, rows)
        hessian = ca.triu(ca.hessian(lagrangian, unknowns)[0])
        self.objective = ca.Function("objective", given, [objective])
        self.gradient = ca.Function("gradient", given, [ca.densify(ca.gradient(objective, unknowns))])
        self.rows = ca.Function("rows", given, [rows])
        self.slopes = ca.Function("slopes", given, [ca.vec(jacobian.nz[:])])
        self.curvature = ca.Function("curvature", [*given, factor, multipliers], [ca.vec(hessian.nz[:])])
        self.jacobian, self.hessian = _places(jacobian), _places(hessian)
        self.count = rows.numel()


@dataclass(frozen=True, eq=False)
class PlacedElement:
    """An element with the numbers that its unknowns and parameters have in the programme."""

    element: Element
    unknowns: Indices
    parameters: Indices


def compile_programme(
    name: str, elements: Sequence[PlacedElement], unknowns: int, parameters: int, options: Mapping[str, Any]
) -> ca.Function:
    """CasADi's ``nlpsol`` (Ipopt) of the sum of the objectives and of all rows, in the elements' order."""
    x, p, factor = ca.MX.sym("x", unknowns), ca.MX.sym("p", parameters), ca.MX.sym("factor")
    starts = np.cumsum([0, *(one.element.count for one in elements)])
    multipliers = ca.MX.sym("multipliers", int(starts[-1]))
    placed = [(one.element, (x[one.unknowns.tolist()], p[one.parameters.tolist()])) for one in elements]
    objective = ca.sum1(ca.vertcat(*(element.objective(*at) for element, at in placed)))
    rows = ca.vertcat(*(element.rows(*at) for element, at in placed))
    gradient = _summed(
        [element.gradient(*at) for element, at in placed], (unknowns, 1),
        [(one.unknowns, np.zeros_like(one.unknowns)) for one in elements],
    )  # fmt: skip
    jacobian = _summed(
        [element.slopes(*at) for element, at in placed], (rows.numel(), unknowns),
        [(start + one.element.jacobian[0], one.unknowns[one.element.jacobian[1]])
         for one, start in zip(elements, starts, strict=False)],
    )  # fmt: skip
    hessian = _summed(
        [element.curvature(*at, factor, multipliers[int(start) : int(start) + element.count])
         for (element, at), start in zip(placed, starts, strict=False)], (unknowns, unknowns),
        [(np.minimum(*pair), np.maximum(*pair)) for one in elements
         for pair in [[one.unknowns[index] for index in one.element.hessian]]],
    )  # fmt: skip
    given, said = [x, p], ["x", "p"]
    lagrangian = [*given, factor, multipliers], [hessian], [*said, "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    derivatives: dict[str, Any] = {
        "grad_f": ca.Function(
            "nlp_grad_f", given, [objective, ca.densify(gradient)], said, ["f", "grad_f_x"]
        ),
        "jac_g": ca.Function("nlp_jac_g", given, [rows, jacobian], said, ["g", "jac_g_x"]),
        "hess_lag": ca.Function("nlp_hess_l", *lagrangian),
    }
    return ca.nlpsol(name, "ipopt", {"x": x, "p": p, "f": objective, "g": rows}, {**options, **derivatives})


def _places(matrix: ca.SX) -> tuple[Indices, Indices]:
    rows, columns = matrix.sparsity().get_triplet()
    return np.asarray(rows, dtype=np.int64), np.asarray(columns, dtype=np.int64)


def _summed(
    nonzeros: Sequence[ca.MX], shape: tuple[int, int], places: Sequence[tuple[Indices, Indices]]
) -> ca.MX:
    """Sparse matrix of the nonzeros of all elements at their rows and columns; equal places are added."""
    rows, columns = (np.concatenate(one) for one in zip(*places, strict=True))
    keys, where = np.unique(columns * shape[0] + rows, return_inverse=True)
    gather = ca.DM.triplet(where.tolist(), range(len(where)), ca.DM.ones(len(where)), len(keys), len(where))
    pattern = ca.Sparsity.triplet(*shape, (keys % shape[0]).tolist(), (keys // shape[0]).tolist())
    return ca.MX(pattern, gather @ ca.vertcat(*nonzeros))
