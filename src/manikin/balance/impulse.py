r"""The impulse that a body on its way can take, predicted from what it is doing.

A push changes the momentum of the body by its impulse `J`. With the frequency ``w = sqrt(g / h)`` of a linear
inverted pendulum of height `h`, the capture point ``c = s + s' / w`` jumps by ``J / (m w)``, and its
deviation ``e`` from the plan then obeys

    ``e' = w (e - d)``

where ``d`` is how far the ZMP goes beyond its planned place. It can go no farther than to the edge of the
support polygon, which is ``D`` away in the direction of the push. Hence, with less and less known:

``plan``
    ``e`` stays bounded if and only if it begins below ``integral_0^inf w exp(-w t) D(t) dt``, the mean of the
    room that the plan leaves from now on, what comes soon counting most. This sees the next lift-off and the
    next landing.
``capture``
    A plan that could be stopped at once leaves the room between the capture point and the edge:
    ``e < D_c``. Negative where the capture point is already outside, as in the middle of a stride.
``margin``
    All that is known is the margin `r` of the wrench polytope [N.m], the least over all directions: a moment
    `r` more moves the ZMP by about ``r / (m g)``, and ``J = m w r / (m g) = r w / g``.

In each case ``J = m w e``. Two corrections hold for all: a force that lasts `T` does its first part of the
work early, and its last part, which is seen by a ZMP that has long moved, counts with ``exp(-w T)``, so that
``J`` may be ``w T / (1 - exp(-w T))`` larger; and a push at the height `z` over the ground instead of `h`
also turns the body, and stopping the turning costs room, so that ``J`` is ``h / z`` of it.

Left out are: arms and trunk that turn, and so take more than the ZMP can; a plan that waits; friction,
joint strength, what a swinging arm or a bowing head meets; a foot that lands elsewhere; and the part of the
polygon that is lost when the body also moves sideways.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.zmp_path import SupportPlane, contact_wrench, support_plane
from manikin.contact import ContactSchedule
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.spatial import GRAVITY, FloatArray, finite_number, frozen_array

HORIZON = 5.0
"""Room this many time constants ``1 / w`` ahead counts; of what comes later, less than 1 % would."""

STEP = 0.01
"""Steps in which the room ahead is looked at [s]."""


@dataclass(frozen=True)
class ImpulsePrediction:
    """Impulses that a body can take in one direction at one time [N.s]; see the module for what they mean.

    Attributes:
        plan: From the room that the plan leaves from then on.
        capture: From the capture point's distance to the edge of the support polygon.
        margin: From the wrench margin, the same in all directions.
        frequency: ``w`` [1/s].
    """

    plan: float
    capture: float
    margin: float
    frequency: float


def predict_impulse(
    motion: Motion,
    schedule: ContactSchedule,
    mass: float,
    time: float,
    direction: ArrayLike,
    *,
    duration: float = 0.0,
    height: float | None = None,
) -> ImpulsePrediction:
    """Predict the impulse that a body can take at a time of its motion, as a point mass would.

    Args:
        motion: What it does, with contact forces.
        schedule: Its contacts in time.
        mass: [kg].
        time: When the push begins [s].
        direction: (2,) level direction of the push; its length does not matter.
        duration: Of the push [s].
        height: In the world at which it acts [m]; that of the centre of mass when omitted.

    Raises:
        InputError: If a number is not usable, or nothing carries the body at that time.
    """
    finite_number(mass, "mass [kg]", above=0.0)
    finite_number(duration, "push duration [s]", at_least=0.0)
    finite_number(time, "push time [s]", at_least=float(motion.time[0]), at_most=float(motion.time[-1]))
    way = frozen_array(direction, "push direction", (2,))
    if not np.any(way):
        raise InputError("push direction is [0, 0]; valid: a direction")
    way = way / np.linalg.norm(way)
    planes = tuple(support_plane(phase.stance) for phase in schedule.sequence)
    plane = planes[int(schedule.phase_at(time))]
    if plane is None:
        raise InputError(f"nothing carries the body at {time:g} s; valid: a time with a foot on the ground")

    com = np.array([np.interp(time, motion.time, column) for column in motion.com.T])
    ground = float(plane.origin[2])
    frequency = float(np.sqrt(GRAVITY / (com[2] - ground)))
    velocity = np.gradient(motion.com, motion.time, axis=0)
    speed = np.array([np.interp(time, motion.time, column) for column in velocity.T])
    captured = _room(plane, com[:2] + speed[:2] / frequency, way)
    ahead = _discounted_room(motion, schedule, planes, time, way, frequency)
    margin = float(np.interp(time, motion.time, motion.margin))

    lasting = frequency * duration
    gain = 1.0 if lasting == 0.0 else lasting / (1.0 - np.exp(-lasting))
    if height is not None:
        gain *= (com[2] - ground) / finite_number(height - ground, "height of the push [m]", above=0.0)
    impulse = float(gain) * mass * frequency
    return ImpulsePrediction(
        plan=impulse * ahead,
        capture=impulse * captured,
        margin=impulse * margin / (mass * GRAVITY),
        frequency=frequency,
    )


def _discounted_room(
    motion: Motion,
    schedule: ContactSchedule,
    planes: tuple[SupportPlane | None, ...],
    time: float,
    way: FloatArray,
    frequency: float,
) -> float:
    """``integral w exp(-w t) D(t) dt`` from ``time`` on [m]; after its end the motion stands still."""
    since = np.arange(0.0, HORIZON / frequency, STEP)
    rows = np.searchsorted(motion.time, np.minimum(time + since, motion.time[-1]))
    used, back = np.unique(rows, return_inverse=True)
    wrench = contact_wrench(motion, schedule)[used]
    phases = schedule.phase_at(motion.time[used])
    room = np.zeros(len(used))
    for number, (phase, row) in enumerate(zip(phases, wrench, strict=True)):
        plane = planes[int(phase)]
        if plane is not None:
            point = plane.zero_moment_point(row[None])[0]
            if np.all(np.isfinite(point)):
                room[number] = _room(plane, (plane.origin + plane.axes[:, :2] @ point)[:2], way)
    weight = np.exp(-frequency * since)
    return float(weight @ room[back] / weight.sum())


def _room(plane: SupportPlane, point: FloatArray, way: FloatArray) -> float:
    """How far a point (2,) of the ground is from the edge of the polygon along a direction [m].

    Seen from above. Negative outside: the way back to where the direction's edge is.
    """
    corners = plane.corners_in_world[:, :2]
    if len(corners) < 3:
        return float(max((corners - point) @ way, default=0.0)) if len(corners) else 0.0
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((along[:, 1], -along[:, 0]))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    facing = normals @ way
    ahead = facing > 1e-9
    offsets = np.sum(normals * (corners - point), axis=1)
    return float(np.min(offsets[ahead] / facing[ahead]))
