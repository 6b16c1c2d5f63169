"""Walking under directives: velocities in, postures out, frame by frame ([Truong2010]_ chapter 6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.locomotion.blend import Blend
from manikin.locomotion.feet_in_place import FootState
from manikin.locomotion.gait import Gait
from manikin.locomotion.library import MotionLibrary, reference_body
from manikin.locomotion.library_file import load_library
from manikin.locomotion.model import to_world
from manikin.locomotion.stance_foot import Legs, corrected, poses
from manikin.locomotion.steady import travelled
from manikin.spatial import FloatArray, finite_number, frozen_array

FIRST_PHASE = 0.97
"""Of a walk that begins: just before the left toe-off."""

ACCELERATION = (2.0, 1.5, 4.0)
"""Largest rates of the velocities, forward, left [m/s^2] and angular [rad/s^2]; our choice, brisk."""

LONGEST_STEP = 0.1
"""Of the time [s]; a foot's swing has some frames at least."""

PREDICTED = 8
"""Instants of the next stance whose mean a foot steps to."""

IN_PLACE = 0.005
"""A foot is in place for standing when it is corrected by less [m, and rad at this many metres]."""

RISE_TIME = 0.15
"""In which the pelvis comes up again after it sank for a leg to reach its foot [s]."""


@dataclass(frozen=True, eq=False)
class WalkFrame:
    """A posture of a walk.

    Attributes:
        q: (nq,) posture.
        place: (3,) x, y [m], heading [rad] of the walker.
        velocity: (3,) forward, left [m/s], angular [rad/s] at this instant.
        phase: Share of the cycle, 0 at the left toe-off.
        support: (2,) whether the left and the right foot stand.
        notice: Why the directive is not walked as asked, or None.
    """

    q: FloatArray
    place: FloatArray
    velocity: FloatArray
    phase: float
    support: tuple[bool, bool]
    notice: str | None


class WalkController:
    """A person who walks as told, from standing.

    The velocities follow the directive with limited accelerations; the phase of the cycle goes on when the
    directive changes, ``p + dt / T`` with the duration T of the new blend ([Truong2010]_ 6.6.2). A directive
    beyond the library is replaced with the nearest velocity it reaches, and the frame says so. Without
    velocity the feet are put side by side by up to two steps, and the body stands.
    """

    def __init__(
        self,
        body: BodyModel | None = None,
        library: MotionLibrary | None = None,
        *,
        place: ArrayLike = (0.0, 0.0, 0.0),
        acceleration: Sequence[float] = ACCELERATION,
    ) -> None:
        """Stand somewhere.

        Args:
            body: A human; that of the library if omitted.
            library: Cycles; those that come with this package if omitted.
            place: (3,) x, y [m], heading [rad].
            acceleration: Limits, forward, left [m/s^2] and angular [rad/s^2].

        Raises:
            InputError: If an argument is not usable.
        """
        self.body = reference_body() if body is None else body
        self._gait = Gait(load_library() if library is None else library, self.body)
        self._legs = Legs(self.body)
        self._place = np.array(frozen_array(place, "walker's place [m, m, rad]", (3,)))
        self._limit = frozen_array(acceleration, "walking acceleration [m/s^2, m/s^2, rad/s^2]", (3,))
        if np.any(self._limit <= 0.0):
            raise InputError(f"walking acceleration is {self._limit.tolist()}; valid: numbers > 0")
        self._velocity, self._phase, self._sink = np.zeros(3), FIRST_PHASE, 0.0
        blend = self._gait.blend(np.zeros((1, 3)))
        frames = self._gait.frames(blend, np.array([self._phase]), self._place[None])
        self._feet = [FootState.at(pose) for pose in poses(self._legs.feet(frames))[:, 0]]
        self._asked: tuple[bytes, Blend] | None = None

    def step(self, dt: float, directive: ArrayLike) -> WalkFrame:
        """Walk on for a moment.

        Args:
            dt: Time to go on [s], at most :data:`LONGEST_STEP`.
            directive: (3,) wanted forward, left [m/s] and angular velocity [rad/s].

        Raises:
            InputError: If an argument is not usable.
        """
        dt = finite_number(dt, "walking time step [s]", above=0.0, at_most=LONGEST_STEP)
        wanted = frozen_array(directive, "walking directive [m/s, m/s, rad/s]", (3,))
        asked = self._blend_of(wanted)
        change = asked.velocity[0] - self._velocity
        blend = asked
        if np.any(np.abs(change) > dt * self._limit):
            change = np.clip(change, -dt * self._limit, dt * self._limit)
            blend = self._gait.blend((self._velocity + change)[None])
        before, self._velocity = self._velocity, blend.velocity[0]
        self._advance(dt, 0.5 * (before + self._velocity))
        if not self._rests(asked):
            self._phase = (self._phase + dt / float(self._gait.period(blend)[0])) % 1.0
        return self._frame(blend, dt, _notice(wanted, asked))

    def _blend_of(self, wanted: FloatArray) -> Blend:
        """Of the directive, which mostly is that of the step before."""
        key = wanted.tobytes()
        if self._asked is None or self._asked[0] != key:
            self._asked = (key, self._gait.blend(wanted[None]))
        return self._asked[1]

    def _advance(self, dt: float, velocity: FloatArray) -> None:
        moved = travelled(velocity, np.array(dt))
        self._place = self._place + to_world(self._place[2], moved)

    def _rests(self, asked: Blend) -> bool:
        """Whether nothing is asked for and both feet stand in place."""
        still = not np.any(asked.velocity) and not np.any(self._velocity)
        return still and all(
            foot.standing and np.hypot(*foot.offset[:2]) < IN_PLACE and abs(foot.offset[2]) < 10 * IN_PLACE
            for foot in self._feet
        )

    def _frame(self, blend: Blend, dt: float, notice: str | None) -> WalkFrame:
        frames = self._gait.frames(blend, np.array([self._phase]), self._place[None])
        swing, wanted = frames.swing(), self._legs.feet(frames)
        path = poses(wanted)[:, 0]
        for number, state in enumerate(self._feet):
            share = float(swing[number, 0])
            if share >= 0.0 and state.standing:
                state.lifted(share, self._next_offset(blend, number, frames.events[0]))
            state.update(path[number], share)
        offset = np.array([[state.offset] for state in self._feet])
        distance = np.array([[state.corrected_by] for state in self._feet])
        feet = corrected(wanted, swing, offset, distance)
        least = self._sink * float(np.exp(-dt / RISE_TIME))
        q, sink = self._legs.reached(frames, feet, least)
        self._sink = float(sink[0])
        for array in (q, self._place, self._velocity):
            array.setflags(write=False)
        left, right = (bool(standing) for standing in swing[:, 0] < 0.0)
        return WalkFrame(q[0], self._place, self._velocity, self._phase, (left, right), notice)

    def _next_offset(self, blend: Blend, foot: int, events: FloatArray) -> FloatArray:
        """Correction at landing that puts the foot at the mean of where the gait has it in its stance."""
        landing, off, other = events
        first, last = (landing, 1.0) if foot == 0 else (other + 1.0, off + 1.0)
        ahead = (first - self._phase) % 1.0
        phase = self._phase + np.linspace(ahead, ahead + last - first, PREDICTED)
        time = (phase - self._phase) * self._gait.period(blend)[0]
        moved = travelled(np.broadcast_to(blend.velocity[0], (PREDICTED, 3)), time)
        place = self._place + to_world(self._place[2], moved)
        same = np.zeros(PREDICTED, dtype=np.int64)
        several = Blend(blend.cycles[same], blend.weights[same], blend.velocity[same], blend.outside[same])
        path = poses(self._legs.feet(self._gait.frames(several, phase, place)))[foot]
        return path.mean(axis=0) - path[0]


def _notice(wanted: FloatArray, asked: Blend) -> str | None:
    if not asked.outside[0]:
        return None
    forward, left, angular = asked.velocity[0]
    return (
        f"directive {wanted[0]:.2f} m/s forward, {wanted[1]:.2f} m/s left, {wanted[2]:.2f} rad/s "
        f"is beyond the motion library; nearest: {forward:.2f}, {left:.2f}, {angular:.2f}"
    )
