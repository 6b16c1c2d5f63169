"""Posture control with the largest gains that keep the ZMP inside ([Kudoh2002]_ 2.5.2)."""

from dataclasses import dataclass

import numpy as np

from manikin.control.balance_recovery.closed_loop import ClosedLoop, LinearMap
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class PostureControl:
    """What the posture control asks for.

    Attributes:
        joints: (nv - 6,) joint accelerations [rad/s^2], nearest ones that leave the feet where they are.
        share: Of the largest damping, in [0, 1]; its square is that of the largest stiffness.
        inside: Whether it keeps the ZMP inside.
    """

    joints: FloatArray
    share: float
    inside: bool = True


def posture_control(
    loop: ClosedLoop, rows: LinearMap, stiff: FloatArray, damped: FloatArray, *, always: bool = False
) -> PostureControl | None:
    """Find the largest gains at which no row is positive, all reduced at the same damping ratio.

    With the share ``s`` of the damping and ``s^2`` of the stiffness the body comes back as it does with the
    largest gains, only ``1/s`` times more slowly: with equal shares of both, as the thesis' equal reduction
    of its gains has it, it would sway the more the smaller they have to be. Every row is quadratic in ``s``,
    so that its borders are found in closed form.

    Args:
        loop: Maps at the state.
        rows: Not positive when the ZMP is inside.
        stiff: (nv - 6,) joint accelerations ``K_p e`` at the largest gains ([Kudoh2002]_ 2.65).
        damped: (nv - 6,) joint accelerations ``K_d e'`` at the largest gains.
        always: Where no share keeps the ZMP inside, whether to take the one at which it leaves least.

    Returns:
        None where no share in (0, 1] keeps the ZMP inside.
    """
    sought = np.column_stack((-loop.joints.offset, damped, stiff))
    powers = np.linalg.lstsq(loop.joints.matrix, sought, rcond=None)[0]
    values = rows.matrix @ powers
    values[:, 0] += rows.offset
    scale = 1e-12 * np.abs(values).sum(axis=1, keepdims=True)
    shares = _shares(values)
    excess = np.max(_at(values, shares) - scale, axis=0)
    inside = (excess <= 0.0) & (shares > 0.0)
    if np.any(inside):
        share = float(shares[inside].max())
    elif always:
        pairs = np.triu_indices(len(values), 1)
        turns = np.divide(
            -values[:, 1], 2.0 * values[:, 2], where=values[:, 2] != 0.0, out=np.zeros(len(values))
        )
        shares = np.concatenate(
            (shares, _shares(values[pairs[0]] - values[pairs[1]]), np.clip(turns, 0.0, 1.0))
        )
        share = float(shares[np.argmin(np.max(_at(values, shares), axis=0))])
    else:
        return None
    return PostureControl(loop.joints(powers @ share ** np.arange(3)), share, bool(np.any(inside)))


def _shares(values: FloatArray) -> FloatArray:
    """0, 1 and the zeros between them of polynomials ``a + b s + c s^2`` (m, 3)."""
    a, b, c = values.T
    root = np.sqrt(np.maximum(b**2 - 4.0 * a * c, 0.0))
    far = -0.5 * (b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        zeros = np.concatenate((far / c, a / far))
    return np.concatenate(([0.0, 1.0], zeros[(zeros > 0.0) & (zeros < 1.0)]))


def _at(values: FloatArray, shares: FloatArray) -> FloatArray:
    """(m, n) values of polynomials (m, 3) at n shares."""
    return values @ np.power.outer(shares, np.arange(3)).T
