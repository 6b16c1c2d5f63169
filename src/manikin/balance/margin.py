"""Force and moment spaces of W_p and the three stability margins ([Qiu2012]_ 4.2.7, 4.2.9)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.wrench import WrenchPolytope
from manikin.errors import InputError
from manikin.polytope import Polytope
from manikin.spatial import FloatArray, frozen_array, skew

_BLOCK = 200_000
"""Distances looked at together: they stay in the processor's cache."""

_NO_LEVER = 1e-12


@dataclass(frozen=True, eq=False)
class StabilityMargins:
    """The smallest perturbations that end balance; negative when it is lost already.

    Attributes:
        force: (...) Ms1, a force at the CoM alone [N].
        moment: (...) Ms2, a moment alone [N.m].
        wrench: (...) Ms3, both, moments about the reference of W_p, alpha = 1 m [N.m].
        wrench_about_com: (...) Ms3 with moments about the CoM, which makes scenes
            comparable ([Qiu2012]_ 4.2.9, remark 2) [N.m].
    """

    force: FloatArray
    moment: FloatArray
    wrench: FloatArray
    wrench_about_com: FloatArray


def force_space(W: WrenchPolytope, com: ArrayLike) -> Polytope:
    """F_p: forces at the CoM, without angular momentum, that W_p admits ([Qiu2012]_ 4.38).

    Args:
        W: Wrench polytope.
        com: (3,) in the world [m].

    Returns:
        A polytope of dimension 3 in ``m (a - g)`` [N].
    """
    arm = frozen_array(com, "com [m]", (3,)) - W.reference
    return W.preimage(np.vstack([np.eye(3), skew(arm)]))


def moment_space(W: WrenchPolytope, force: ArrayLike) -> Polytope:
    """T_p: moments about the reference that W_p admits beside a fixed force.

    The thesis projects F_p (4.39), which is flat; a perturbing moment leaves the force
    alone, so the right set is the slice ``{tau : H2 tau <= h - H1 f}``.

    Args:
        W: Wrench polytope.
        force: (3,) pseudo-force ``m (a - g)`` [N].

    Returns:
        A polytope of dimension 3 [N.m].
    """
    f = frozen_array(force, "force [N]", (3,))
    return W.preimage(np.vstack([np.zeros((3, 3)), np.eye(3)]), np.concatenate([f, np.zeros(3)]))


def stability_margins(W: WrenchPolytope, wrench: ArrayLike, com: ArrayLike) -> StabilityMargins:
    """All margins of pseudo-wrenches, each the smallest over the facets of a distance.

    Row ``i`` is reached after ``d_i = h_i - H_i w``; a unit force at the CoM covers
    ``|H1_i + H2_i (x - o)^|`` of it, a unit moment ``|H2_i|``.

    Args:
        W: Wrench polytope.
        wrench: (..., 6) about ``W.reference``, of a point mass or a whole body.
        com: (..., 3) in the world [m].

    Raises:
        InputError: If the shapes do not fit.
    """
    w, x = np.asarray(wrench, dtype=np.float64), np.asarray(com, dtype=np.float64)
    if w.shape[-1:] != (6,) or x.shape[-1:] != (3,):
        raise InputError(f"wrench has shape {w.shape} and com {x.shape}; valid: (..., 6) and (..., 3)")
    shape = np.broadcast_shapes(w.shape[:-1], x.shape[:-1])
    w = np.broadcast_to(w, (*shape, 6)).reshape(-1, 6)
    x = np.broadcast_to(x, (*shape, 3)).reshape(-1, 3)
    found = np.empty((4, len(w)))
    step = max(1, _BLOCK // max(1, len(W)))
    for start in range(0, len(w), step):
        part = slice(start, start + step)
        found[:, part] = _margins(W, w[part], x[part] - W.reference)
    return StabilityMargins(*(row.reshape(shape) for row in found))


def force_levers(H: FloatArray, arm: FloatArray) -> FloatArray:
    """(n, m) ``|H1 + H2 arm^|``: change of each row per newton at points ``arm`` (n, 3) from the reference.

    Args:
        H: (m, 6) rows over force and moment.
        arm: (n, 3) from the point of the rows' moments [m].
    """
    force, (x, y, z) = H[:, :3], H[:, 3:].T
    zero = np.zeros_like(x)
    squares = np.zeros((len(arm), len(H)))
    for axis, turned in enumerate(((zero, -z, y), (z, zero, -x), (-y, x, zero))):
        squares += (force[:, axis] + arm @ np.array(turned)) ** 2
    return np.sqrt(squares)


def wrench_levers(H: FloatArray, arm: FloatArray) -> FloatArray:
    """(n, m) lengths that rows have with moments about points ``arm`` (n, 3) from the reference.

    Args:
        H: (m, 6) rows over force and moment.
        arm: (n, 3) from the point of the rows' moments [m].
    """
    return np.hypot(force_levers(H, arm), np.linalg.norm(H[:, 3:], axis=1))


def _margins(W: WrenchPolytope, wrench: FloatArray, arm: FloatArray) -> FloatArray:
    """(4, n) margins in the order of :class:`StabilityMargins`."""
    distances = W.distances(wrench)
    moment_lever = np.linalg.norm(W.H[:, 3:], axis=1)
    force_lever = force_levers(W.H, arm)
    return np.stack(
        [
            _smallest(distances, force_lever),
            _smallest(distances, moment_lever),
            distances.min(axis=1),
            _smallest(distances, np.hypot(force_lever, moment_lever)),
        ]
    )


def _smallest(distances: FloatArray, lever: FloatArray) -> FloatArray:
    """Smallest ``distance / lever``; rows without lever count only when they are broken."""
    still = lever < _NO_LEVER
    if not still.any():
        return (distances / lever).min(axis=1)
    ratio = distances / np.where(still, 1.0, lever)
    out_of_reach = np.where(distances < 0, -np.inf, np.inf)
    return np.where(still, out_of_reach, ratio).min(axis=1)
