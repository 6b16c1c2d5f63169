"""Pushes: a force on a point of a segment, near the centre of mass or on the thorax of a body on its way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.control.recovery import joint_groups
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics import spatial
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array

STRONGEST = 5000.0
"""Largest force of a push [N]: some seven body weights, and far beyond what can be held."""


@dataclass(frozen=True, eq=False)
class Push:
    """A force on a point of a segment, constant or a sine of time.

    Attributes:
        segment: Name of the segment.
        force: (3,) in the world, at its largest [N].
        start: [s].
        duration: [s].
        point: (3,) where it acts in the segment's frame [m]; None for the segment's centre of mass.
        frequency: Frequency of the sine that begins with the push [Hz]; 0 for a constant force.

    Raises:
        InputError: If a number is not usable.
    """

    segment: str
    force: FloatArray
    start: float
    duration: float
    point: FloatArray | None = None
    frequency: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", frozen_array(self.force, "push force [N]", (3,)))
        finite_number(self.start, "push start [s]", at_least=0.0)
        finite_number(self.duration, "push duration [s]", above=0.0)
        finite_number(self.frequency, "push frequency [Hz]", at_least=0.0)
        if self.point is not None:
            object.__setattr__(self, "point", frozen_array(self.point, "push point [m]", (3,)))

    def active(self, time: float) -> bool:
        """Whether the force acts in the step that begins at ``time``."""
        return self.start - 1e-9 <= time < self.start + self.duration - 1e-9

    def at(self, time: float) -> FloatArray:
        """(3,) force in the step that begins at ``time`` [N]."""
        if not self.active(time):
            return np.zeros(3)
        wave = np.sin(2.0 * np.pi * self.frequency * (time - self.start)) if self.frequency > 0.0 else 1.0
        return float(wave) * self.force


def push_near_com(
    body: BodyModel, force: ArrayLike, start: float, duration: float, *, frequency: float = 0.0,
    q: ArrayLike | None = None,
) -> Push:  # fmt: skip
    """Push that acts near the centre of mass ([Kudoh2002]_ 3.2).

    It acts on the trunk's segment at whose height the centre of mass is in the posture, at that point.

    Args:
        force: (3,) in the world, at its largest [N].
        start: [s].
        duration: [s].
        frequency: As of :class:`Push` [Hz].
        q: (nq,) the posture; the body's standing one when omitted.

    Raises:
        InputError: If the force is not finite or beyond :data:`STRONGEST`, or a time is not usable.
    """
    strength = frozen_array(force, "push force [N]", (3,))
    if np.linalg.norm(strength) > STRONGEST:
        raise InputError(f"push force is {np.linalg.norm(strength):g} N; valid: at most {STRONGEST:g} N")
    state = Configuration(body, body.standing_posture() if q is None else q)
    # The segment of the trunk whose centre is nearest to the centre of mass.
    segment = min(
        joint_groups(body).segments["trunk"],
        key=lambda name: float(np.linalg.norm(state.point(name, body.segment(name).com) - state.com)),
    )
    rotation, position = state.segment_placement(segment)
    return Push(segment, strength, start, duration, rotation.T @ (state.com - position), frequency)


def push_on_the_way(
    motion: Motion, force: float, direction: float, start: float, duration: float, frequency: float = 0.0
) -> Push:
    """Push on the thorax of a body that carries out a motion.

    Args:
        force: Size, of a sine its amplitude [N].
        direction: Counter-clockwise from the forward axis that the pelvis has in the plan then [deg].
        start: In the motion's time [s].
        duration: [s].
        frequency: As of :class:`Push` [Hz].
    """
    sample = min(int(np.searchsorted(motion.time, start)), len(motion.time) - 1)
    forward = spatial.rotation_from_quaternion(motion.q[sample : sample + 1, 3:7])[0][:, 0]
    way = spatial.rotation_from_yaw(float(np.arctan2(forward[1], forward[0])) + np.deg2rad(direction))[:, 0]
    return Push("thorax", force * way, start, duration, frequency=frequency)


def push_impulse(push: Push) -> float:
    """Impulse of a push without regard to the sign of a sine [N.s]."""
    size = float(np.linalg.norm(push.force))
    if push.frequency == 0.0:
        return size * push.duration
    half_waves, rest = divmod(2.0 * push.frequency * push.duration, 1.0)
    return size / (np.pi * push.frequency) * (half_waves + 0.5 * (1.0 - np.cos(np.pi * rest)))
