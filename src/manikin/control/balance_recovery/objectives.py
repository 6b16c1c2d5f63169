"""What the program of a step minimises: to hold a posture, to keep the balance, or to step."""

import numpy as np
from numpy.typing import NDArray

from manikin.control.balance_recovery.arm_swing import ArmSwing
from manikin.control.balance_recovery.com_law import ComLaw
from manikin.control.balance_recovery.joint_groups import JointGroups
from manikin.control.balance_recovery.problem import Objective
from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.dynamics import DynamicsState
from manikin.control.reference import EffectorReference
from manikin.control.settings import Impedance
from manikin.control.tasks import orientation_task, swing_task
from manikin.spatial import FloatArray

FIRM = 100.0
"""Weight of joints that hold an angle, against 1 of those that need not."""

STEPPING_JOINTS = 0.1
"""Weight of the joints while a foot steps."""

ROOT = "pelvis"
"""Effector that is kept upright while a foot steps."""


class Objectives:
    """The objectives of a body, of which some joints may be locked."""

    def __init__(
        self, settings: RecoverySettings, groups: JointGroups, arms: ArmSwing, upright: EffectorReference
    ) -> None:
        """Keep what all objectives have in common.

        Args:
            settings: Weights and gains.
            groups: Joints of the body.
            arms: Their swing.
            upright: How the pelvis is kept while a foot steps.
        """
        self._settings, self._groups, self._arms, self._upright = settings, groups, arms, upright
        self._locked = groups.locked(settings.locked)

    @property
    def locked(self) -> NDArray[np.int64]:
        """Hinges that hold the posture whatever happens."""
        return self._locked

    def held(self, state: DynamicsState, posture: FloatArray, wanted: FloatArray) -> Objective:
        """Joint accelerations as wanted, and of locked joints what holds them."""
        weight = np.full(len(wanted), FIRM)
        return Objective(weight, self._with_locked(state, posture, wanted, weight), np.zeros(3))

    def balancing(self, state: DynamicsState, posture: FloatArray, law: ComLaw, time: float) -> Objective:
        """The objective of the quadratic program (2.54) with the law of the centre of mass."""
        settings = self._settings
        weight = np.ones(len(posture))
        weight[self._groups.joints["arm"]] = settings.arm_weight
        weight[self._groups.joints["trunk"]] = settings.trunk_weight
        gains = settings.unwinding
        damping = gains.damping + (1.0 - law.need) * settings.stopping
        wanted = pull(Impedance(gains.stiffness, damping), state, posture)
        swing = self._arms.wish(state, time)
        if swing is not None:
            wanted[self._arms.joints], weight[self._arms.joints] = swing
        wanted = self._with_locked(state, posture, wanted, weight)
        return Objective(weight, wanted, law.acceleration, self._com_weight, settings.upward)

    def stepping(
        self, state: DynamicsState, posture: FloatArray, law: ComLaw, foot: str, way: EffectorReference
    ) -> Objective:
        """A foot follows its way, the trunk stays upright and the centre of mass keeps its law."""
        settings = self._settings
        weight = np.full(len(posture), STEPPING_JOINTS)
        joints = self._with_locked(state, posture, pull(settings.posture, state, posture), weight)
        tasks = (
            swing_task(foot, state.frames[foot], way, settings.swing, settings.swing_weight),
            orientation_task(
                ROOT, state.frames[ROOT], self._upright, settings.posture, settings.swing_weight
            ),
        )
        return Objective(weight, joints, law.acceleration, self._com_weight, tasks=tasks)

    @property
    def _com_weight(self) -> FloatArray:
        settings = self._settings
        return np.array([settings.com_weight, settings.com_weight, settings.height_weight])

    def _with_locked(
        self, state: DynamicsState, posture: FloatArray, wanted: FloatArray, weight: FloatArray
    ) -> FloatArray:
        """Wanted accelerations with those that hold the locked joints; their weights are set."""
        result = wanted.copy()
        result[self._locked] = pull(self._settings.stiffness, state, posture)[self._locked]
        weight[self._locked] = FIRM * 10.0
        return result


def pull(gains: Impedance, state: DynamicsState, posture: FloatArray) -> FloatArray:
    """(nv - 6,) joint accelerations back to a posture (nv - 6,) [rad/s^2]."""
    return gains.stiffness * (posture - state.q[7:]) - gains.damping * state.v[6:]
