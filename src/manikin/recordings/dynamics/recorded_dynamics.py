"""Smoothed postures of a recorded person, their derivatives, the wrench that they need, and its margins.

One pass of the recursive Newton-Euler equations gives the torques that a body without contacts would need;
their first six components, those of the free pelvis, are the wrench that the ground has to supply.

A foot that lands stops within a few hundredths of a second, while the rest of a step is slow: one cutoff for
both either smears the impact over the single support before it, or lets the noise of the markers through.
Here the cutoff may be a function of time, higher at each touch-down: the smooth values ``x`` minimise

    ``sum |x - y|^2 + sum lambda_k |x_(k-1) - 2 x_k + x_(k+1)|^2``,

which for one ``lambda`` is the filter of second order run forward and backward (the amplitude is halved at
the cutoff), and one banded system of equations for any other (Eilers, "A perfect smoother", Anal. Chem. 75,
2003).

How far recorded people are from losing their balance ([Qiu2012]_ 4.4): every phase has one polytope of
admissible wrenches; in every frame :func:`manikin.balance.motion_margin` measures the distance of the wrench
to its facets with moments about the centre of mass (4.2.9, remark 2, and 4.56), for a point mass (4.54) and
for the whole body with its angular momentum (4.55, by the derivatives of the motion instead of a difference
of two frames).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from manikin.balance import (
    LimitingConstraint,
    MotionMargin,
    WrenchPolytope,
    motion_margin,
    pseudo_wrench,
    wrench_polytopes,
    zero_moment_point,
)
from manikin.body import BodyModel
from manikin.body.human import body_from_signature
from manikin.body.limbs import with_knees_and_elbows
from manikin.contact import ContactSchedule, Stance
from manikin.errors import InputError
from manikin.kinematics.point_targets import PostureCost
from manikin.motion.configuration_spline import align_quaternions
from manikin.motion.dynamics import FreeDynamics, centroidal_motion
from manikin.motion.motion import Motion
from manikin.numerics.signals import low_passed
from manikin.numerics.spatial import (
    GRAVITY_VECTOR,
    FloatArray,
    cross,
    finite_number,
    frozen_array,
    wrench_about,
)
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import RecordedSupports
from manikin.recordings.supports.support_levels import JOINTS, com_path

MOTION_CUTOFF, FEWEST_FRAMES = 6.0, 4
"""Frequency above which a walk has little but noise [Hz] (Winter, Biomechanics and Motor Control, 2.2.4)."""


@dataclass(frozen=True)
class LocalCutoff:
    """A cutoff that is higher about touch-downs.

    Attributes:
        usual: Far from touch-downs [Hz]; ``highest`` at one [Hz].
        width: Time from a touch-down in which it falls to 1/e of its rise [s].
    """

    usual: float
    highest: float
    width: float = 0.08

    def __post_init__(self) -> None:
        finite_number(self.usual, "cutoff [Hz]", above=0.0)
        finite_number(self.highest, "highest cutoff [Hz]", at_least=self.usual)
        finite_number(self.width, "width [s]", above=0.0)

    def at(self, time: FloatArray, touch_downs: Sequence[float]) -> FloatArray:
        """(n,) at instants (n,) [s]: a bell over each touch-down, the highest [Hz]."""
        found, rise = np.full(len(time), self.usual), self.highest - self.usual
        for instant in touch_downs:
            found = np.maximum(found, self.usual + rise * np.exp(-(((time - instant) / self.width) ** 2)))
        return found


def smoothed(found: Reconstruction, cutoff: float = MOTION_CUTOFF) -> Reconstruction:
    """A reconstruction low-passed by a Butterworth filter of second order, forward and backward.

    Filtered are position, hinges, and the rotation of the pelvis as a quaternion of continuous sign, then
    normalised; hinges are kept to their limits. Residuals are those of the filtered postures. Each of the two
    passes halves the power at the cutoff [Hz]. InputError if there are less than four instants, or the cutoff
    is not below half their rate.
    """
    q = smoothed_postures(found, cutoff)
    residual = PostureCost(found.body, found.targets).distances(q, found.targets.positions)
    return replace(found, q=q, residual=residual)


def smoothed_postures(
    found: Reconstruction, cutoff: float | LocalCutoff = MOTION_CUTOFF, limits: bool = True,
    touch_downs: Sequence[float] = (),
) -> FloatArray:  # fmt: skip
    """(n, nq) postures of :func:`smoothed`, without their residuals.

    Hinges may go beyond their limits: the kink where an angle meets its limit spoils second derivatives. A
    :class:`LocalCutoff` rises at touch-downs, on the clock of ``found`` [s]; without any, and for a number,
    it is the Butterworth filter's.
    """
    rate, local = _rate(found), cutoff if isinstance(cutoff, LocalCutoff) else LocalCutoff(cutoff, cutoff)
    if local.usual >= 0.5 * rate:
        raise InputError(f"cutoff is {local.usual:g} Hz; valid: below half the rate, {0.5 * rate:g} Hz")
    q = align_quaternions(found.q)
    varies = len(touch_downs) and local.highest > local.usual
    q = smooth(q, rate, local.at(found.time, touch_downs)) if varies else low_passed(q, local.usual, rate)
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    if limits:
        q[:, 7:] = np.clip(q[:, 7:], found.body.lower, found.body.upper)
    return q


def motion_of(found: Reconstruction, cutoff: float | None = MOTION_CUTOFF) -> Motion:
    """A motion of the recorded postures, smoothed, with velocities and accelerations of :func:`rates_of`.

    There are no contacts and forces, and ``tau`` and ``margin`` are NaN. With the cutoff None postures are as
    they are; otherwise arguments and errors are those of :func:`smoothed`.
    """
    q = found.q if cutoff is None else smoothed_postures(found, cutoff)
    v, a = rates_of(found, q)
    moved, n = centroidal_motion(found.body, q, v, a), len(q)
    return Motion(
        time=found.time, q=q, v=v, a=a, tau=np.full_like(v, np.nan), com=moved.com,
        angular_momentum=moved.angular_momentum,
        margin=np.full(n, np.nan), support=np.zeros((n, 0), dtype=bool), contact_force=np.zeros((n, 0, 6)),
        contact_names=(), joint_names=tuple(found.body.joint_names),
    )  # fmt: skip


def rates_of(found: Reconstruction, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, nv) velocities and accelerations of postures at the instants of a reconstruction.

    By central differences on the configuration space, the pelvis' parts in its own frame; at both ends
    velocities continue the line of the next two. InputError if there are less than four instants.
    """
    model, rate = found.body.pinocchio, _rate(found)
    inner = [0.5 * pin.difference(model, before, after) for before, after in zip(q[:-2], q[2:], strict=True)]
    first, last = pin.difference(model, q[0], q[1]), pin.difference(model, q[-2], q[-1])
    v = rate * np.vstack([2.0 * first - inner[0], inner, 2.0 * last - inner[-1]])
    return v, np.gradient(v, 1.0 / rate, axis=0, edge_order=2)


def _rate(found: Reconstruction) -> float:
    if len(found.time) < FEWEST_FRAMES:
        raise InputError(f"reconstruction has {len(found.time)} instants; valid: at least {FEWEST_FRAMES}")
    return found.rate


HIGHEST_SHARE = 0.45
"""Highest cutoff per rate of the recording: faster motion aliases."""


def smooth(values: FloatArray, rate: float, cutoff: FloatArray) -> FloatArray:
    """(n, k) columns low-passed with a cutoff (n,) below half the rate for each instant [Hz].

    The amplitude is halved at the cutoff, of at most :data:`HIGHEST_SHARE` of the rate. Both ends are
    continued as point reflections, so that a straight line stays as it is. There are at least two instants at
    an even rate.
    """
    cutoff = np.minimum(cutoff, HIGHEST_SHARE * rate)
    pad = min(len(values) - 1, int(np.ceil(2.0 * rate / float(cutoff.min()))))
    first, last = 2.0 * values[0] - values[pad:0:-1], 2.0 * values[-1] - values[-2 : -pad - 2 : -1]
    known = np.vstack([first, values, last])
    weight = (2.0 * np.sin(np.pi * np.pad(cutoff, pad, mode="edge")[1:-1] / rate)) ** -4.0
    second = np.array([1.0, -2.0, 1.0])
    bands = np.zeros((3, len(known)))
    bands[2] = 1.0
    for row in range(3):
        for column in range(row, 3):
            end = len(known) - 2 + column
            bands[2 + row - column, column:end] += weight * second[row] * second[column]
    smoothed = np.asarray(solveh_banded(bands, known), dtype=np.float64)
    return smoothed[pad : pad + len(values)]


CUTOFF = LocalCutoff(5.0, 8.0)
"""Low-pass of postures that are differentiated twice, as [Qiu2012]_ 3.2.1, one for all recordings. With 4 Hz
touch-downs reach too far, with 6 Hz and more the noise of the trunk takes over."""

HEIGHT_CUTOFF = LocalCutoff(5.0, 7.0, 0.3)
"""Low-pass of the height of the centre of mass, which the noise of single joints reaches less: between the
touch-downs of a walk the vertical force has more above 5 Hz than its noise."""


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
    found: Reconstruction, cutoff: float | None = None, touch_downs: Sequence[float] = ()
) -> RecordedDynamics:
    """Smooth a reconstruction, differentiate it twice and find the wrench that it needs.

    Errors are those of :func:`smoothed`.

    Args:
        found: At least four instants at an even rate, not yet smoothed.
        cutoff: Of the low-pass of the postures [Hz]; those of :data:`CUTOFF` when omitted, with the centre of
            mass at its own height of :data:`HEIGHT_CUTOFF`.
        touch_downs: Instants at which those rise for a moment, see :func:`touch_downs_of` [s]; a cutoff that
            is given does not.
    """
    if cutoff is not None:
        return dynamics_of_postures(found, smoothed_postures(found, cutoff, limits=False))
    q = smoothed_postures(found, CUTOFF, limits=False, touch_downs=touch_downs)
    height = com_path(found.body, align_quaternions(found.q))[:, 2:]
    wanted = smooth(height, found.rate, HEIGHT_CUTOFF.at(found.time, touch_downs))
    q[:, 2:3] += wanted - com_path(found.body, q)[:, 2:]
    return dynamics_of_postures(found, q)


ALREADY = 0.1
"""Time for which another support has lasted where a touch-down is not that of a flight [s]."""


def touch_downs_of(supports: RecordedSupports) -> tuple[float, ...]:
    """Instants at which a support begins beside a lasting one, on the clock of the reconstruction [s].

    Who lands from a flight swings through a whole period of the low-pass in one support: a cutoff that rises
    there adds the wobble of the markers at the impact. The second foot of such a landing is no other case.
    """
    every = supports.supports
    return tuple(
        one.start - supports.start for one in every
        if one.start_seen and any(
            other.end > one.start and (other.start + ALREADY <= one.start or not other.start_seen)
            for other in every if other is not one
        )
    )  # fmt: skip


def dynamics_of_postures(found: Reconstruction, q: FloatArray) -> RecordedDynamics:
    """The wrench that (n, nq) smooth postures at four or more instants of a reconstruction need."""
    v, a = rates_of(found, q)
    moved, free = centroidal_motion(found.body, q, v, a), FreeDynamics.of(found.body, q, v, a)
    return RecordedDynamics(
        found.body, found.time, q, v, a, moved.com, moved.angular_momentum, free.needed, free.wrench,
        free.jacobians,
    )  # fmt: skip


def with_mass(found: Reconstruction, mass: float) -> Reconstruction:
    """Postures of a body of another adult's mass [kg], its shares of segments and its effectors kept."""
    body = body_from_signature(found.body.signature() | {"mass": mass})
    if set(JOINTS) <= set(found.body.effectors):
        body = with_knees_and_elbows(body)
    return replace(found, body=body)


FLIGHT = Stance(())
"""Contacts of a phase without any."""


@dataclass(frozen=True, eq=False)
class RecordedMargins:
    """Margins of each frame about the centre of mass, alpha = 1 m; negative outside of what is admissible.

    In flight only the wrench 0 is admissible: the margin is minus the length of the one that is needed.

    Attributes:
        body: (n,) of the whole body: margin [N.m], force at the centre of mass that would end balance [N],
            distance of the zero moment point from the edge [m]; ``mass`` is without angular momentum.
        phase: (n,) index of the phase in ``polytopes``, which are None in flight and without frames.
        wrench: (n, 6) of the whole body about the world's origin [N, N.m].
        com: (n, 3) centre of mass [m].
    """

    body: MotionMargin
    mass: MotionMargin
    phase: NDArray[np.int64]
    polytopes: tuple[WrenchPolytope | None, ...]
    wrench: FloatArray
    com: FloatArray

    @property
    def whole_body(self) -> FloatArray:
        """(n,) margin of the whole body [N.m]."""
        return self.body.margin

    @property
    def point_mass(self) -> FloatArray:
        """(n,) margin without angular momentum [N.m]."""
        return self.mass.margin

    @property
    def lowest(self) -> int:
        """Frame of the lowest margin of the whole body."""
        return self.body.lowest

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n,) whether there is any contact."""
        return np.array([one is not None for one in self.polytopes], dtype=bool)[self.phase]

    @property
    def balanced(self) -> float | None:
        """Share of the frames in contact in which the whole body's margin is positive; None without any."""
        held = self.held
        return float(np.mean(self.whole_body[held] > 0.0)) if held.any() else None

    def limiting(self, frame: int) -> LimitingConstraint | None:
        """Contact and limit that the facet with the margin of a frame stands for; None in flight."""
        polytope, com = self.polytopes[int(self.phase[frame])], self.com[frame]
        if polytope is None:
            return None
        return polytope.at_reference(com).limiting(wrench_about(self.wrench[frame], com))


def recorded_margins(
    dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0
) -> RecordedMargins:
    """Margins of a recorded motion on its stances; their clock is ``start`` [s] at its first instant."""
    phases = schedule.phase_at(dynamics.time + start)
    stances = [phase.stance for phase in schedule.sequence]
    held = [number for number in np.unique(phases).tolist() if len(stances[number])]
    found = dict(zip(held, wrench_polytopes([stances[number] for number in held]), strict=True))
    return margins_within([found.get(number) for number in range(len(stances))], phases, dynamics)


def margins_within(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], dynamics: RecordedDynamics
) -> RecordedMargins:
    """Margins of a recorded motion in the polytopes of its phases, None in flight, and (n,) phases."""
    wrenches = dynamics.wrench, dynamics.point_mass_wrench
    body, mass = (margins_of_wrenches(polytopes, phases, wrench, dynamics.com) for wrench in wrenches)
    return RecordedMargins(body, mass, phases, tuple(polytopes), dynamics.wrench, dynamics.com)


def margins_of_wrenches(
    polytopes: Sequence[WrenchPolytope | None], phases: NDArray[np.int64], wrench: FloatArray, com: FloatArray
) -> MotionMargin:
    """Margins of wrenches (n, 6) about the world's origin, CoM (n, 3) [m]; see :func:`margins_within`."""
    stances = [FLIGHT if one is None else one.stance for one in polytopes]
    return motion_margin(stances, phases, wrench, com, polytopes=polytopes)
