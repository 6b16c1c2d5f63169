"""A reconstruction without the noise of its recording, and with velocities and accelerations."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.low_pass import low_passed
from manikin.mocap.local_cutoff import local_cutoff, smooth
from manikin.mocap.posture_cost import PostureCost
from manikin.mocap.reconstruction import Reconstruction
from manikin.motion.motion import Motion
from manikin.spatial import FloatArray, finite_number

CUTOFF = 6.0
"""Frequency above which a walk has little but noise [Hz] (Winter, Biomechanics and Motor Control, 2.2.4)."""

FEWEST_FRAMES = 4

HIGHEST_SHARE = 0.45
"""Highest cutoff at a touch-down, per rate of the recording: what is faster cannot be told from slower."""


def smoothed(found: Reconstruction, cutoff: float = CUTOFF) -> Reconstruction:
    """The same without fast changes: Butterworth of second order, forward and backward, so without delay.

    Filtered are place, hinges, and the turn of the pelvis as a quaternion of continuous sign, set to length 1
    again; hinges are kept to their limits. Residuals are those of the filtered postures.

    Args:
        found: At least four instants at an even rate.
        cutoff: Where each of the two passes halves the power [Hz].

    Raises:
        InputError: If there are too few instants, or the cutoff is not below half their rate.
    """
    q = smoothed_postures(found, cutoff)
    residual = PostureCost(found.body, found.targets).distances(q, found.targets.positions)
    return replace(found, q=q, residual=residual)


def smoothed_postures(
    found: Reconstruction, cutoff: float = CUTOFF, limits: bool = True, touch_downs: Sequence[float] = ()
) -> FloatArray:
    """(n, nq) postures of :func:`smoothed`, without their residuals.

    Args:
        found: As there.
        cutoff: As there [Hz].
        limits: Whether hinges are kept to their limits afterwards. Where a smooth angle meets its limit it
            gets a kink, so what is differentiated twice had better overshoot a little.
        touch_downs: Instants at which the cutoff rises for a moment, on the clock of ``found`` [s], see
            :mod:`manikin.mocap.local_cutoff`; none for the Butterworth filter.

    Raises:
        InputError: As there.
    """
    rate = _rate(found)
    finite_number(cutoff, "cutoff [Hz]", above=0.0)
    if cutoff >= 0.5 * rate:
        raise InputError(f"cutoff is {cutoff:g} Hz; valid: below half the rate, {0.5 * rate:g} Hz")
    q = np.array(found.q)
    flips = np.cumprod(np.where(np.sum(q[1:, 3:7] * q[:-1, 3:7], axis=1) < 0.0, -1.0, 1.0))
    q[1:, 3:7] *= flips[:, None]
    if len(touch_downs):
        ceiling = np.minimum(local_cutoff(found.time, touch_downs, cutoff), HIGHEST_SHARE * rate)
        q = smooth(q, rate, ceiling)
    else:
        q = low_passed(q, cutoff, rate)
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    if limits:
        q[:, 7:] = np.clip(q[:, 7:], found.body.lower, found.body.upper)
    return q


def motion_of(found: Reconstruction, cutoff: float | None = CUTOFF) -> Motion:
    """A motion of the recorded postures, smoothed, with velocities and accelerations by central differences.

    Differences are taken on the configuration space: the pelvis' parts are in its own frame. Contacts and
    forces are not known of a recording: there are none, and ``tau`` and ``margin`` are NaN.

    Args:
        found: At least four instants at an even rate.
        cutoff: Of :func:`smoothed` [Hz]; None for the postures as they are.

    Raises:
        InputError: As :func:`smoothed`.
    """
    _rate(found)
    q = found.q if cutoff is None else smoothed_postures(found, cutoff)
    v, a = rates_of(found, q)
    model, data, n = found.body.pinocchio, found.body.pinocchio.createData(), len(q)
    com, spin = np.empty((n, 3)), np.empty((n, 3))
    for frame in range(n):
        momentum = pin.computeCentroidalMomentum(model, data, q[frame], v[frame])
        com[frame], spin[frame] = data.com[0], momentum.angular
    return Motion(
        time=found.time, q=q, v=v, a=a, tau=np.full_like(v, np.nan), com=com, angular_momentum=spin,
        margin=np.full(n, np.nan), support=np.zeros((n, 0), dtype=bool), contact_force=np.zeros((n, 0, 6)),
        contact_names=(), joint_names=tuple(found.body.joint_names),
    )  # fmt: skip


def rates_of(found: Reconstruction, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, nv) velocities and accelerations of postures at the instants of a reconstruction.

    By central differences on the configuration space; at both ends velocities continue the line of the
    next two.

    Raises:
        InputError: If there are too few instants.
    """
    model, rate = found.body.pinocchio, _rate(found)
    inner = [0.5 * pin.difference(model, before, after) for before, after in zip(q[:-2], q[2:], strict=True)]
    first, last = pin.difference(model, q[0], q[1]), pin.difference(model, q[-2], q[-1])
    v = rate * np.vstack([2.0 * first - inner[0], inner, 2.0 * last - inner[-1]])
    return v, np.gradient(v, 1.0 / rate, axis=0, edge_order=2)


def level_heading(q: FloatArray) -> float:
    """Direction on the level into which a person looks on the whole, from the world's x [rad].

    That of the pelvis' x axis, or, of who lies on the back or the front, of its z axis: from the hips to the
    head.

    Args:
        q: (n, nq) postures.
    """
    turn = Rotation.from_quat(q[:, 3:7])
    ahead, above = (turn.apply(axis).mean(axis=0)[:2] for axis in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    way = ahead if np.hypot(*ahead) >= np.hypot(*above) else above
    return float(np.arctan2(way[1], way[0]))


def _rate(found: Reconstruction) -> float:
    if len(found.time) < FEWEST_FRAMES:
        raise InputError(f"reconstruction has {len(found.time)} instants; valid: at least {FEWEST_FRAMES}")
    return (len(found.time) - 1) / float(found.time[-1] - found.time[0])
