"""Degrees of freedom of a body whose feet are held, and what is linear in their accelerations.

With both feet on the ground the generalised acceleration is ``a = basis phi'' + drift`` ([Kudoh2002]_ 2.2):
``basis`` spans the accelerations that leave the feet where they are and ``drift`` is what their centripetal
accelerations ask for. The thesis takes coordinates ``phi`` of the loops and finds the maps by evaluating the
inverse dynamics at unit vectors (Fig. 2.6); an orthonormal basis gives the same maps at once, and since the
objective and all limits are written in joint accelerations, forces and moments, it does not matter which
basis is taken.
"""

from dataclasses import dataclass

import numpy as np

from manikin.control.dynamics import DynamicsState
from manikin.spatial import GRAVITY, FloatArray, skew


@dataclass(frozen=True, eq=False)
class LinearMap:
    """A value ``matrix @ phi'' + offset``.

    Attributes:
        matrix: (m, k).
        offset: (m,).
    """

    matrix: FloatArray
    offset: FloatArray

    @classmethod
    def none(cls, size: int) -> "LinearMap":
        """No value at all, of ``size`` accelerations."""
        return cls(np.zeros((0, size)), np.zeros(0))

    def joined(self, other: "LinearMap") -> "LinearMap":
        """Both values, one after the other."""
        return LinearMap(
            np.concatenate((self.matrix, other.matrix)), np.concatenate((self.offset, other.offset))
        )

    def __call__(self, phi: FloatArray) -> FloatArray:
        """(m,) value at the accelerations (k,)."""
        return self.matrix @ phi + self.offset


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """Linear maps of the accelerations ``phi''`` (k,) at one state ([Kudoh2002]_ 2.4-2.6).

    Attributes:
        acceleration: (nv,) generalised acceleration.
        joints: (nv - 6,) joint accelerations, ``J phi'' + k``.
        com: (3,) acceleration of the centre of mass [m/s^2].
        force: (3,) force of the ground, ``C_f phi'' + d_f`` [N].
        moment: (3,) moment of the ground about the centre of mass, ``C_n phi'' + d_n`` [N.m].
    """

    acceleration: LinearMap
    joints: LinearMap
    com: LinearMap
    force: LinearMap
    moment: LinearMap

    @property
    def size(self) -> int:
        """Number k of degrees of freedom."""
        return self.acceleration.matrix.shape[1]


@dataclass(frozen=True, eq=False)
class FeltPush:
    """What pushes the body besides the ground.

    Attributes:
        wrench: (6,) force [N] and moment about the world's origin [N.m].
        generalised: (nv,) the same on the generalised coordinates.
    """

    wrench: FloatArray
    generalised: FloatArray

    @classmethod
    def none(cls, nv: int) -> "FeltPush":
        """Nothing pushes."""
        return cls(np.zeros(6), np.zeros(nv))


def close_loop(
    state: DynamicsState, feet: tuple[str, ...], push: FeltPush, *, settling: float = 0.0
) -> ClosedLoop:
    """Find the maps at a state.

    Args:
        state: With a frame for each foot.
        feet: Effectors that do not move.
        push: What pushes besides the ground.
        settling: Rate at which what the feet move all the same is damped [1/s].
    """
    jacobian = np.concatenate([state.frames[name].jacobian for name in feet])
    wanted = np.concatenate(
        [-state.frames[name].drift - settling * state.frames[name].twist for name in feet]
    )
    held = len(wanted)
    factors = np.linalg.qr(jacobian.T, mode="complete")
    full: FloatArray = factors.Q
    upper: FloatArray = factors.R
    drift = full[:, :held] @ np.linalg.solve(upper[:held].T, wanted)
    basis = full[:, held:]
    momentum_rate = state.centroidal_map @ basis
    offset = state.centroidal_map @ drift + state.momentum_drift
    weight = np.array([0.0, 0.0, state.mass * GRAVITY])
    push_force = push.wrench[:3]
    push_moment = push.wrench[3:] - skew(state.com) @ push_force
    return ClosedLoop(
        acceleration=LinearMap(basis, drift),
        joints=LinearMap(basis[6:], drift[6:]),
        com=LinearMap(momentum_rate[:3] / state.mass, offset[:3] / state.mass),
        force=LinearMap(momentum_rate[:3], offset[:3] + weight - push_force),
        moment=LinearMap(momentum_rate[3:], offset[3:] - push_moment),
    )
