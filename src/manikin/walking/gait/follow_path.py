"""Whole-body walks along paths: a recorded way of walking on a planned way over the floor.

A walk follows a whole path at once, or directives frame by frame: velocities in, postures out ([Truong2010]_
chapter 6).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from manikin.body import BodyModel, Configuration
from manikin.contact.from_motion import LevelSupport, level_supports
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.recordings.readers.marker_sets import SIDES
from manikin.walking.gait.blend import Blend, Gait, travelled
from manikin.walking.gait.cycles import sole_points
from manikin.walking.gait.motion_library import MotionLibrary, load_library, reference_body
from manikin.walking.gait.stance_foot import FootState, Legs, corrected, poses, put_in_place
from manikin.walking.path.route import WalkRoute
from manikin.walking.path.walking_model import to_world
from manikin.walking.path.walking_path import WalkingPath


def stance_slides(body: BodyModel, q: FloatArray, standing: NDArray[np.bool_]) -> FloatArray:
    """(stances,) largest displacements over the floor in every stance of either foot [m].

    Of postures (n, nq) whose left and right foot stand or not, (2, n). From frame to frame, that of the lower
    end of the sole, heel or ball of the foot, is added up: a foot that rolls over its ends does not slide.
    """
    slides = []
    for points, stands in zip(sole_points(body, q).values(), standing, strict=True):
        ends = np.stack(points, axis=1)
        moved = np.diff(ends[..., :2], axis=0)
        lower = (ends[1:, :, 2] + ends[:-1, :, 2]).argmin(axis=1)
        moved = moved[np.arange(len(lower)), lower]
        for first, last in mask_runs(stands):
            if last - first > 1:
                way = np.cumsum(moved[first : last - 1], axis=0)
                slides.append(float(np.hypot(*way.T).max()))
    return np.array(slides)


FIRST_PHASE = 0.97
"""Phase at which a walk begins: just before the left toe-off."""

ACCELERATION = (2.0, 1.5, 4.0)
"""Largest rates of the velocities, forward, left [m/s^2] and angular [rad/s^2]; our choice, brisk."""

LONGEST_STEP = 0.1
"""Longest time step [s]; the swing of a foot has some frames at least."""

IN_PLACE = 0.005
"""A foot is in place for standing when it is corrected by less than this [m], and ten times this [rad]."""

RISE_TIME = 0.15
"""Time constant of the pelvis' rise after it sank for a leg to reach its foot [s]."""


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
    """A person who walks under directives, from standing.

    The velocities follow the directive with limited accelerations; the phase of the cycle goes on when the
    directive changes, ``p + dt / T`` with the duration T of the new blend ([Truong2010]_ 6.6.2). A directive
    beyond the library is replaced with the nearest velocity it reaches, and the frame says so. Without
    velocity the feet are put side by side by up to two steps, and the body stands.
    """

    def __init__(
        self, body: BodyModel | None = None, library: MotionLibrary | None = None, *,
        place: ArrayLike = (0.0, 0.0, 0.0), acceleration: Sequence[float] = ACCELERATION,
    ) -> None:  # fmt: skip
        """Stand somewhere; InputError if an argument is not usable.

        Args:
            body: A human; that of the library if omitted.
            library: Cycles; those that come with this package if omitted.
            place: (3,) x, y [m], heading [rad].
            acceleration: Limits, forward, left [m/s^2] and angular [rad/s^2].
        """
        self.body = reference_body() if body is None else body
        self._gait = Gait(load_library() if library is None else library, self.body)
        self._legs = Legs(self.body)
        self._place = np.array(frozen_array(place, "walker's place [m, m, rad]", (3,)))
        self._limit = frozen_array(acceleration, "walking acceleration [m/s^2, m/s^2, rad/s^2]", (3,))
        if np.any(self._limit <= 0.0):
            raise InputError(f"walking acceleration is {self._limit.tolist()}; valid: numbers > 0")
        self._velocity, self._phase, self._sink = np.zeros(3), FIRST_PHASE, 0.0
        none, blend = np.zeros(3), self._gait.blend(np.zeros((1, 3)))
        frames = self._gait.frames(blend, np.array([self._phase]), self._place[None])
        self._feet = [FootState(pose, none, none, none) for pose in poses(self._legs.feet(frames))[:, 0]]
        self._asked: tuple[bytes, Blend] | None = None

    def step(self, dt: float, directive: ArrayLike) -> WalkFrame:
        """Walk on for a moment; InputError if an argument is not usable.

        Args:
            dt: Time to go on [s], at most :data:`LONGEST_STEP`.
            directive: (3,) wanted forward, left [m/s] and angular velocity [rad/s].
        """
        dt = finite_number(dt, "walking time step [s]", above=0.0, at_most=LONGEST_STEP)
        wanted = frozen_array(directive, "walking directive [m/s, m/s, rad/s]", (3,))
        blend = asked = self._blend_of(wanted)
        change = asked.velocity[0] - self._velocity
        if np.any(np.abs(change) > dt * self._limit):
            change = np.clip(change, -dt * self._limit, dt * self._limit)
            blend = self._gait.blend((self._velocity + change)[None])
        before, self._velocity = self._velocity, blend.velocity[0]
        moved = travelled(0.5 * (before + self._velocity), np.array(dt))
        self._place = self._place + to_world(self._place[2], moved)
        if not self._rests(asked):
            self._phase = (self._phase + dt / float(self._gait.period(blend)[0])) % 1.0
        return self._frame(blend, dt, _notice(wanted, asked))

    def _blend_of(self, wanted: FloatArray) -> Blend:
        """Blend of the directive, which mostly is that of the step before."""
        key = wanted.tobytes()
        if self._asked is None or self._asked[0] != key:
            self._asked = (key, self._gait.blend(wanted[None]))
        return self._asked[1]

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
        path, shares = poses(wanted)[:, 0], swing[:, 0].tolist()
        for number, (state, share) in enumerate(zip(self._feet, shares, strict=True)):
            if share >= 0.0 and state.standing:
                state.lifted(share, self._next_offset(blend, number, frames.events[0]))
            state.update(path[number], share)
        offset = np.array([[state.offset] for state in self._feet])
        distance = np.array([[np.hypot(*(state.after - state.before)[:2])] for state in self._feet])
        least = self._sink * float(np.exp(-dt / RISE_TIME))
        q, sink = self._legs.reached(frames, corrected(wanted, swing, offset, distance), least)
        self._sink = float(sink[0])
        for array in (q, self._place, self._velocity):
            array.setflags(write=False)
        standing = (shares[0] < 0.0, shares[1] < 0.0)
        return WalkFrame(q[0], self._place, self._velocity, self._phase, standing, notice)

    def _next_offset(self, blend: Blend, foot: int, events: FloatArray) -> FloatArray:
        """Correction at landing that puts the foot at the mean of its poses in the next stance."""
        count, (landing, off, other) = 8, events
        first, last = (landing, 1.0) if foot == 0 else (other + 1.0, off + 1.0)
        ahead = (first - self._phase) % 1.0
        phase = self._phase + np.linspace(ahead, ahead + last - first, count)
        time = (phase - self._phase) * self._gait.period(blend)[0]
        same = np.zeros(count, dtype=np.int64)
        several = Blend(blend.cycles[same], blend.weights[same], blend.velocity[same], blend.outside[same])
        place = self._place + to_world(self._place[2], travelled(several.velocity, time))
        path = poses(self._legs.feet(self._gait.frames(several, phase, place)))[foot]
        return path.mean(axis=0) - path[0]


def _notice(wanted: FloatArray, asked: Blend) -> str | None:
    if not asked.outside[0]:
        return None
    nearest = ", ".join(f"{value:.2f}" for value in asked.velocity[0])
    return (
        f"directive {wanted[0]:.2f} m/s forward, {wanted[1]:.2f} m/s left, {wanted[2]:.2f} rad/s "
        f"is beyond the motion library; nearest: {nearest}"
    )


RATE = 60.0
"""Frames per second [Hz]."""

LONGEST_END, STANDING_TIME = 1.5, 0.2
"""Longest time from the end of the path to the end of the last step, and time of standing then [s]."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A walk of a body, sampled evenly.

    Attributes:
        body: The walking body.
        time: (n,) [s].
        q: (n, nq) postures.
        place: (n, 3) x, y [m], heading [rad] of the path.
        support: (n, 2) whether the left and the right foot stand.
        outside: (n,) whether the path is faster there than any walk of the library: legs move as in
            the nearest one, in time with the path.
        slides_before: (stances,) slides of the feet in the blended cycles [m].
        slides: (stances,) slides with the feet put in place [m].
    """

    body: BodyModel
    time: FloatArray
    q: FloatArray
    place: FloatArray
    support: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    slides_before: FloatArray
    slides: FloatArray

    def __post_init__(self) -> None:
        for name in ("time", "q", "place", "support", "outside", "slides_before", "slides"):
            getattr(self, name).setflags(write=False)

    @property
    def notice(self) -> str | None:
        """Where the path is faster than any walk of the library; None if it nowhere is."""
        if not self.outside.any():
            return None
        share, first = 100 * np.mean(self.outside), self.time[int(np.argmax(self.outside))]
        beyond = f"{share:.0f} % of the path, from {first:.2f} s on, are beyond the motion library"
        return f"{beyond}; legs move there as in the nearest walk"

    @property
    def feet(self) -> tuple[str, ...]:
        """Effectors that walk, in the order of ``support``."""
        return tuple(f"{side}_foot" for side in SIDES)

    def supports(self, foot: int) -> Iterator[LevelSupport]:
        """Supports of one foot, in order."""
        name = self.feet[foot]
        return level_supports(
            self.support[:, foot],
            lambda row: Configuration(self.body, self.q[row]).effector_placement(name),
        )

    @cached_property
    def motion(self) -> Motion:
        """The motion with velocities, CoM and angular momentum; torques, forces and margin are NaN."""
        body, model = self.body, self.body.pinocchio
        n, dt = len(self.time), float(self.time[1] - self.time[0])
        steps = np.array([pin.difference(model, a, b) for a, b in zip(self.q[:-1], self.q[1:], strict=True)])
        v = np.vstack([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]]) / dt
        a = np.gradient(v, dt, axis=0)
        centroidal = centroidal_motion(body, self.q, v, a)
        tau = np.full((n, body.nv), np.nan)
        tau[:, :6] = 0.0
        return Motion(
            time=self.time, q=self.q, v=v, a=a, tau=tau, com=centroidal.com,
            angular_momentum=centroidal.angular_momentum, margin=np.full(n, np.nan), support=self.support,
            contact_force=np.full((n, 2, 6), np.nan), contact_names=self.feet,
            joint_names=body.joint_names,
        )  # fmt: skip


def walk_along(
    path: WalkingPath | WalkRoute, body: BodyModel | None = None, library: MotionLibrary | None = None, *,
    rate: float = RATE, height: float = 0.0,
) -> Walk:  # fmt: skip
    """Walk along a path, from standing to standing.

    The root follows the path exactly, with the swaying of the gait around it; the path's velocities are the
    directives. Feet have one place on the floor in every stance. After the path's end the last step
    is finished and the body stands. InputError if the path is none, failed, or the rate is not usable.

    Args:
        path: A result of :func:`manikin.walking.walking_path` or :func:`manikin.walking.walking_route`.
        body: A human; that of the library if omitted.
        library: Cycles; those that come with this package if omitted.
        rate: Frames per second [Hz], 20 to 1000.
        height: Height of the floor [m].
    """
    if not isinstance(path, WalkingPath | WalkRoute):
        raise InputError(f"path to walk is a {type(path).__name__}; valid: a WalkingPath or a WalkRoute")
    if not path.succeeded:
        raise InputError(f"path to walk is none: {path.failure}; valid: one that succeeded")
    rate = finite_number(rate, "walking rate [Hz]", at_least=20.0, at_most=1000.0)
    body = reference_body() if body is None else body
    gait, legs = Gait(load_library() if library is None else library, body), Legs(body)
    time = np.arange(int((path.duration + LONGEST_END) * rate) + 1) / rate
    within = np.minimum(time, path.duration)
    place, velocity = path.place_at(within), path.motion_at(within)[0]
    velocity[time >= path.duration] = 0.0
    blend = gait.blend(velocity)
    steps = 1.0 / (rate * gait.period(blend))
    phase = FIRST_PHASE + np.concatenate([[0.0], np.cumsum(0.5 * (steps[1:] + steps[:-1]))])
    frames = gait.frames(blend, phase, place)
    swing = frames.swing()
    both = np.flatnonzero((swing < 0.0).all(axis=0) & (time >= path.duration))
    end = int(both[0]) if both.size else len(time) - 1
    swing[:, end:] = -1.0
    q, _ = legs.reached(frames, put_in_place(legs.feet(frames), swing))
    q[:, 2] += finite_number(height, "height of the floor [m]")
    kept = slice(0, min(end + int(STANDING_TIME * rate) + 1, len(time)))
    support = (swing < 0.0)[:, kept]
    return Walk(
        body, time[kept], q[kept], place[kept], support.T, blend.outside[kept],
        stance_slides(body, frames.q[kept], support), stance_slides(body, q[kept], support),
    )  # fmt: skip
