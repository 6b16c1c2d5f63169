"""Polynomials for the heading of a path whose curvature is zero at both ends."""

from functools import cache

import numpy as np
from numpy.polynomial import Legendre

from manikin.spatial import FloatArray

DEGREE = 20
"""Highest degree of the derivative of the curvature; 32 changes no word of the grid, no cost by 1e-9 m."""

_NODES = 48
"""Of the quadrature along the path."""


def basis(share: FloatArray, integrals: int, degree: int = DEGREE) -> FloatArray:
    """(n, degree) Legendre polynomials of degree 1, 2, ... on [0, 1], integrated from 0 so many times.

    Degree 0 is left out: the integrals of all others vanish at 1, so that the curvature ends at zero.

    Args:
        share: (n,) where, as a share of the length [-].
        integrals: How often they are integrated.
        degree: The highest.
    """
    columns = [_integrated(number, integrals)(share) for number in range(1, degree + 1)]
    return np.column_stack(columns)


@cache
def _integrated(number: int, integrals: int) -> Legendre:
    one = Legendre.basis(number, domain=[0.0, 1.0])
    return one.integ(integrals, lbnd=0.0) if integrals else one


@cache
def quadrature(degree: int = DEGREE) -> tuple[FloatArray, FloatArray]:
    """(m, degree) twice integrated polynomials at the nodes of Gauss' rule on [0, 1], and (m,) weights."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return basis((nodes + 1.0) / 2.0, 2, degree), weights / 2.0


def squares(degree: int = DEGREE) -> FloatArray:
    """(degree,) integrals of the squared polynomials over [0, 1]."""
    return 1.0 / (2.0 * np.arange(1.0, degree + 1.0) + 1.0)
