"""Rate of the centroidal momentum of sampled motions, with exact derivatives by raw coordinates."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.spatial import FloatArray, skew
from manikin.wholebody.configuration_spline import StateSamples, TurnDerivatives, turn_derivatives


@dataclass(frozen=True, eq=False)
class MomentumRate:
    """Rate of linear and angular momentum about the centre of mass.

    Attributes:
        value: (n, 6) [N, N.m], world axes.
        jacobians: Three (n, 6, nq) derivatives, by the raw coordinates, their rates and their
            second derivatives.
    """

    value: FloatArray
    jacobians: tuple[FloatArray, FloatArray, FloatArray]


class MomentumRateSamples:
    """Collects Pinocchio's derivatives sample by sample."""

    def __init__(self, model: pin.Model, count: int) -> None:
        self._model = model
        self._mass = float(pin.computeTotalMass(model))
        self._value = np.zeros((count, 6))
        self._by_q, self._by_v, self._by_a = np.zeros((3, count, 6, model.nv))

    def record(self, sample: int, data: pin.Data, states: StateSamples) -> None:
        """Evaluate one sample; ``data`` then holds its kinematics and joint Jacobians."""
        _, by_q, by_v, by_a = pin.computeCentroidalDynamicsDerivatives(
            self._model, data, states.q[sample], states.v[sample], states.a[sample]
        )
        self._value[sample] = data.dhg.vector
        self._by_q[sample], self._by_v[sample], self._by_a[sample] = by_q, by_v, by_a

    @property
    def linear_by_acceleration(self) -> FloatArray:
        """(n, 3, nv) derivative of the linear part by ``a``: mass times the centre of mass' Jacobian."""
        return self._by_a[:, :3]

    def by_raw(
        self, states: StateSamples, raw: tuple[FloatArray, FloatArray, FloatArray], tangent: FloatArray
    ) -> MomentumRate:
        """Differentiate by the raw coordinates (n, nq), their rates and second derivatives.

        Args:
            states: The states that were recorded.
            raw: Raw spline values, rates and second derivatives.
            tangent: (n, 7, 7) :func:`tangent_map` of the raw values.
        """
        turn = turn_derivatives(*(part[:, 3:7] for part in raw))
        blocks = [np.zeros((*self._by_q.shape[:2], raw[0].shape[1])) for _ in range(3)]
        for block, joints in zip(blocks, (self._by_q, self._by_v, self._by_a), strict=True):
            block[:, :, 7:] = joints[:, :, 6:]
        self._add_pelvis_turn(blocks, states, raw[2], tangent, turn)
        blocks[2][:, :3, :3] = self._mass * np.eye(3)
        return MomentumRate(self._value, (blocks[0], blocks[1], blocks[2]))

    def _add_pelvis_turn(
        self,
        blocks: list[FloatArray],
        states: StateSamples,
        raw_second: FloatArray,
        tangent: FloatArray,
        turn: TurnDerivatives,
    ) -> None:
        # With the world velocity of the pelvis held, its velocity in the pelvis frame turns.
        by_omega = self._by_v[:, :, 3:6] + self._by_a[:, :, :3] @ skew(states.v[:, :3])
        by_alpha = self._by_a[:, :, 3:6]
        # The whole body turns with the pelvis, and with it all of the momentum's rate but the
        # part that the pelvis' world acceleration gives.
        turning = self._value.copy()
        turning[:, :3] -= self._mass * raw_second[:, :3]
        pelvis_to_world = tangent[:, :3, :3].transpose(0, 2, 1)
        turned = [
            -skew(part) @ pelvis_to_world @ tangent[:, 3:6, 3:7] for part in (turning[:, :3], turning[:, 3:])
        ]
        blocks[0][:, :, 3:7] = (
            np.concatenate(turned, axis=1) + by_omega @ turn.omega_by_value + by_alpha @ turn.alpha_by_value
        )
        blocks[1][:, :, 3:7] = by_omega @ turn.omega_by_rate + by_alpha @ turn.alpha_by_rate
        blocks[2][:, :, 3:7] = by_alpha @ turn.alpha_by_second
