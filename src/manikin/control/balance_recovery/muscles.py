"""Muscles that do not react yet: they hold the posture as springs and dampers do."""

import numpy as np

from manikin.control.balance_recovery.joint_groups import JointGroups
from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.balance_recovery.standing import Standing
from manikin.control.dynamics import DynamicsState
from manikin.spatial import GRAVITY, FloatArray

LEG_STIFFNESS = 3.0
"""Stiffness of hips and knees before they react, at least, in ``m g h`` per radian."""


def held_posture(
    state: DynamicsState,
    standing: Standing,
    groups: JointGroups,
    settings: RecoverySettings,
    resting: FloatArray,
) -> FloatArray:
    """Joint torques that hold a posture without asking what the ground can give.

    A spring has the gains of :attr:`RecoverySettings.stiffness` on the inertia of what hangs on its joint;
    hips and knees have :data:`LEG_STIFFNESS` at least, ankles :attr:`RecoverySettings.ankle_stiffness`. The
    springs act on the state at the end of the period, so that stiff ones on light segments do not swing up
    ("stable PD", Tan et al. 2011).

    Args:
        state: Of the body.
        standing: Whose posture is held.
        groups: Of the joints.
        settings: Stiffnesses and the period.
        resting: (nv - 6,) torques at rest [N.m].

    Returns:
        (nv - 6,) [N.m].
    """
    period, joints = settings.period, groups.joints
    inertia = np.diag(state.mass_matrix)[6:]
    toppling = state.mass * GRAVITY * standing.height
    stiffness = settings.stiffness.stiffness * inertia
    legs = np.concatenate((joints["hip"], joints["knee"]))
    stiffness[legs] = np.maximum(stiffness[legs], LEG_STIFFNESS * toppling)
    stiffness[joints["ankle"]] = 0.5 * settings.ankle_stiffness * toppling
    damping = 2.0 * np.sqrt(stiffness * inertia)
    pull = np.zeros(len(state.v))
    ahead = state.q[7:] + period * state.v[6:]
    pull[6:] = stiffness * (standing.posture - ahead) - damping * state.v[6:]
    matrix = state.mass_matrix.copy()
    matrix[np.arange(6, len(pull)), np.arange(6, len(pull))] += period * damping
    slowed = np.linalg.solve(matrix, pull)[6:]
    return resting + pull[6:] - period * damping * slowed
