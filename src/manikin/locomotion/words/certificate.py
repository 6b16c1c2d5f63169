r"""Whether paths meet their goals and the necessary conditions of optimality, measured without the solver.

For :math:`\int (1 + u_2^2)` Pontryagin's principle says :math:`u_2 = p_\kappa / 2`, :math:`\dot p_\kappa =
-p_\varphi`, :math:`\dot p_\varphi = p_x \sin\varphi - p_y \cos\varphi` with constant :math:`p_x, p_y`, and a
Hamiltonian that is zero since the length is free. So :math:`-2 \ddot u_2` must be a combination of
:math:`\sin\varphi` and :math:`\cos\varphi`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from manikin.locomotion.words.basis import basis
from manikin.spatial import FloatArray

_STEPS = 3000


@dataclass(frozen=True, eq=False)
class WordResiduals:
    """Largest violations of each of k paths.

    Attributes:
        position: (k,) distance from the goal of the system (3.2) integrated densely under u2 [m].
        heading: (k,) the same of the heading [rad].
        curvature: (k,) the same of the curvature, 0 at the goal [1/m].
        adjoint: (k,) largest difference of u2 and the adjoint's p_kappa / 2, as a share of the largest u2 (at
            least 0.01 / m^2) [-].
        hamiltonian: (k,) largest Hamiltonian; the cost's rate is at least 1 [-].
    """

    position: FloatArray
    heading: FloatArray
    curvature: FloatArray
    adjoint: FloatArray
    hamiltonian: FloatArray


def residuals(start: FloatArray, goals: FloatArray, shapes: FloatArray, lengths: FloatArray) -> WordResiduals:
    """Integrate (3.2) by Runge and Kutta's rule and fit the adjoint to every path.

    Args:
        start: (3,) x, y [m], heading [rad].
        goals: (k, 3) the same, with whole turns.
        shapes: (k, degree) of the paths.
        lengths: (k,) of the paths [m].
    """
    share = np.linspace(0.0, 1.0, 2 * _STEPS + 1)
    rates = shapes @ basis(share, 0, shapes.shape[1]).T / lengths[:, None] ** 2
    states = _integrated(start, rates, lengths)
    missed = np.abs(states[-1, :, :3] - goals)
    adjoint, hamiltonian = _adjoint(states, rates[:, ::2], lengths)
    return WordResiduals(
        np.hypot(missed[:, 0], missed[:, 1]), missed[:, 2], np.abs(states[-1, :, 3]), adjoint, hamiltonian
    )


def _integrated(start: FloatArray, rates: FloatArray, lengths: FloatArray) -> FloatArray:
    """(n, k, 4) states of the system under u2 given at every half step."""

    def derivative(state: FloatArray, control: FloatArray) -> FloatArray:
        return np.stack([np.cos(state[:, 2]), np.sin(state[:, 2]), state[:, 3], control], axis=1)

    state = np.tile(np.append(start, 0.0), (len(lengths), 1))
    step, states = (lengths / _STEPS)[:, None], [state]
    for i in range(0, 2 * _STEPS, 2):
        first = derivative(state, rates[:, i])
        second = derivative(state + step / 2 * first, rates[:, i + 1])
        third = derivative(state + step / 2 * second, rates[:, i + 1])
        fourth = derivative(state + step * third, rates[:, i + 2])
        state = state + step / 6 * (first + 2 * second + 2 * third + fourth)
        states.append(state)
    return np.array(states)


def _adjoint(states: FloatArray, rates: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Largest misfit of u2, and largest Hamiltonian, for the adjoint that fits both best.

    With p_x and p_y constant, p_phi = p_phi(0) + p_x (y - y_0) - p_y (x - x_0); it is integrated once more.
    """
    misfit, largest = np.empty(len(lengths)), np.empty(len(lengths))
    for k, length in enumerate(lengths):
        x, y, heading, curvature = states[:, k].T
        x, y, way, rate = x - x[0], y - y[0], np.linspace(0.0, length, len(x)), rates[k]
        none, ones = np.zeros_like(way), np.ones_like(way)
        # Columns: p_kappa(0), p_phi(0), p_x, p_y.
        p_curvature = np.column_stack([ones, -way, -_primitive(y, way), _primitive(x, way)])
        moving = np.column_stack(
            [none, curvature, np.cos(heading) + y * curvature, np.sin(heading) - x * curvature]
        )
        hamiltonian = moving + rate[:, None] * p_curvature
        price = 1.0 + rate**2
        rows, wanted = np.vstack([p_curvature / 2.0, hamiltonian]), np.concatenate([rate, price])
        missing = rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0] - wanted
        misfit[k] = np.max(np.abs(missing[: len(way)])) / max(0.01, np.abs(rate).max())
        largest[k] = np.max(np.abs(missing[len(way) :]))
    return misfit, largest


def _primitive(values: FloatArray, way: FloatArray) -> FloatArray:
    """Integral from the start at every instant, by a rule of fourth order."""
    return CubicSpline(way, values).antiderivative()(way)
