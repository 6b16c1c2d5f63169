"""What has to push a recorded person so that they move as they did: the external wrench, frame by frame.

Everything follows from the smoothed postures, their velocities and accelerations: one pass of the recursive
Newton-Euler equations gives the torques that a body without contacts would need, and its first six
components, those of the free pelvis, are the wrench that the ground has to supply.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from manikin.balance import pseudo_wrench, zero_moment_point
from manikin.body import BodyModel
from manikin.body.further_contacts import with_knees_and_elbows
from manikin.body.human import body_from_signature
from manikin.mocap.effector_places import JOINTS
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_motion import rates_of, smoothed_postures
from manikin.mocap.recorded_supports import RecordedSupports
from manikin.motion.dynamics import FreeDynamics
from manikin.spatial import GRAVITY_VECTOR, FloatArray, cross, frozen_array

CUTOFF = 5.0
"""Low-pass of postures that are differentiated twice, as [Qiu2012]_ 3.2.1, one for all recordings [Hz]. With
4 Hz touch-downs reach too far, with 6 Hz and more the noise of the trunk takes over."""


@dataclass(frozen=True, eq=False)
class RecordedDynamics:
    """A recorded motion and the wrench that it needs; world frame, but ``v`` and ``a`` as in Pinocchio.

    Attributes:
        body: With the mass used.
        time: (n,) instants, 0 at the first [s].
        q: (n, nq) smoothed postures; hinges overshoot their limits by as much as smoothing makes them.
        v: (n, nv) velocities.
        a: (n, nv) accelerations.
        com: (n, 3) centre of mass [m].
        angular_momentum: (n, 3) about the centre of mass [kg.m^2/s].
        free_torque: (n, nv) generalised forces without contacts [N, N.m]; the first six in the pelvis' frame.
        wrench: (n, 6) external force [N] and moment about the world's origin [N.m], without gravity.
        jacobians: (n, 6, nv) of all joints: velocity of the point at the world's origin, and angular one.
    """

    body: BodyModel
    time: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    com: FloatArray
    angular_momentum: FloatArray
    free_torque: FloatArray
    wrench: FloatArray
    jacobians: FloatArray

    def __len__(self) -> int:
        """Number of instants."""
        return len(self.time)

    @cached_property
    def com_acceleration(self) -> FloatArray:
        """(n, 3) of the centre of mass [m/s^2]."""
        return frozen_array(self.wrench[:, :3] / self.body.mass + GRAVITY_VECTOR, "com_acceleration")

    @cached_property
    def angular_momentum_rate(self) -> FloatArray:
        """(n, 3) about the centre of mass [N.m]."""
        return frozen_array(self.wrench[:, 3:] - cross(self.com, self.wrench[:, :3]), "rate")

    @cached_property
    def point_mass_wrench(self) -> FloatArray:
        """(n, 6) of a point mass, about the world's origin ([Qiu2012]_ 4.54, 4.56)."""
        return frozen_array(pseudo_wrench(self.body.mass, self.com, self.com_acceleration), "wrench")

    @property
    def vertical_force(self) -> FloatArray:
        """(n,) of the ground on the person [N]."""
        return self.wrench[:, 2]

    def zero_moment_point(self, height: float) -> FloatArray:
        """(n, 2) centre of pressure on level ground of a height [m]; NaN without vertical force."""
        return zero_moment_point(self.wrench, height)


def dynamics_of(
    found: Reconstruction, cutoff: float = CUTOFF, touch_downs: Sequence[float] = ()
) -> RecordedDynamics:
    """Smooth a reconstruction, differentiate it twice and find the wrench that it needs.

    Args:
        found: At least four instants at an even rate, not yet smoothed.
        cutoff: Of the low-pass of the postures [Hz].
        touch_downs: Instants at which it rises for a moment, on the clock of ``found`` [s], see
            :func:`touch_downs_of`.

    Raises:
        InputError: If there are too few instants, or the cutoff is not below half their rate.
    """
    return dynamics_of_postures(
        found, smoothed_postures(found, cutoff, limits=False, touch_downs=touch_downs)
    )


def touch_downs_of(supports: RecordedSupports) -> tuple[float, ...]:
    """Instants at which a support begins, on the clock of the reconstruction [s]."""
    return tuple(one.start - supports.start for one in supports.supports if one.start_seen)


def dynamics_of_postures(found: Reconstruction, q: FloatArray) -> RecordedDynamics:
    """The wrench that (n, nq) smooth postures at the instants of a reconstruction need.

    Raises:
        InputError: If there are too few instants.
    """
    v, a = rates_of(found, q)
    model, data, n = found.body.pinocchio, found.body.pinocchio.createData(), len(q)
    com, spin = np.empty((n, 3)), np.empty((n, 3))
    for frame in range(n):
        spin[frame] = pin.computeCentroidalMomentum(model, data, q[frame], v[frame]).angular
        com[frame] = data.com[0]
    free = FreeDynamics.of(found.body, q, v, a)
    return RecordedDynamics(
        found.body, found.time, q, v, a, com, spin, free.needed, free.wrench, free.jacobians
    )


def with_mass(found: Reconstruction, mass: float) -> Reconstruction:
    """The same postures of a body of another mass [kg], its shares of segments and its effectors kept.

    Raises:
        BodyError: If it is not the mass of an adult.
    """
    body = body_from_signature(found.body.signature() | {"mass": mass})
    if set(JOINTS) <= set(found.body.effectors):
        body = with_knees_and_elbows(body)
    return replace(found, body=body)
