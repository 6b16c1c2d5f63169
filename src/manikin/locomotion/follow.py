"""Whole-body walks along paths: a recorded way of walking on a planned way over the floor."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.locomotion.controller import FIRST_PHASE
from manikin.locomotion.gait import Gait
from manikin.locomotion.library import MotionLibrary, reference_body
from manikin.locomotion.library_file import load_library
from manikin.locomotion.path import WalkingPath
from manikin.locomotion.route import WalkRoute
from manikin.locomotion.slide import stance_slides
from manikin.locomotion.stance_foot import Legs, put_in_place
from manikin.mocap.anatomy import SIDES
from manikin.motion import Motion
from manikin.spatial import FloatArray, finite_number

RATE = 60.0
"""Frames per second [Hz]."""

LONGEST_END = 1.5
"""Within which the last step ends [s]."""

STANDING_TIME = 0.2
"""For which the body stands at the end [s]."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A walk of a body, sampled evenly.

    Attributes:
        body: Who walks.
        time: (n,) [s].
        q: (n, nq) postures.
        place: (n, 3) x, y [m], heading [rad] of the path.
        support: (n, 2) whether the left and the right foot stand.
        outside: (n,) whether the path is faster there than any walk of the library: legs move as in
            the nearest one, in time with the path.
        slides_before: Slide of each stance as the blended cycles have it [m].
        slides: The same with the feet put in place [m].
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
        """Says so where the path is faster than any walk of the library; None if it nowhere is."""
        if not self.outside.any():
            return None
        first = self.time[int(np.argmax(self.outside))]
        return (
            f"{100 * np.mean(self.outside):.0f} % of the path, from {first:.2f} s on, are beyond the motion "
            "library; legs move there as in the nearest walk"
        )

    @property
    def feet(self) -> tuple[str, ...]:
        """Effectors that walk, in the order of ``support``."""
        return tuple(f"{side}_foot" for side in SIDES)

    @cached_property
    def motion(self) -> Motion:
        """With velocities, centre of mass and angular momentum; torques, forces and margin are NaN."""
        body, model = self.body, self.body.pinocchio
        n, dt = len(self.time), float(self.time[1] - self.time[0])
        steps = np.array([pin.difference(model, a, b) for a, b in zip(self.q[:-1], self.q[1:], strict=True)])
        v = np.vstack([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]]) / dt
        data = model.createData()
        com, momentum = np.empty((n, 3)), np.empty((n, 3))
        for i, (q, rate) in enumerate(zip(self.q, v, strict=True)):
            pin.computeCentroidalMomentum(model, data, q, rate)
            com[i], momentum[i] = data.com[0], data.hg.angular
        tau = np.full((n, body.nv), np.nan)
        tau[:, :6] = 0.0
        return Motion(
            time=self.time, q=self.q, v=v, a=np.gradient(v, dt, axis=0), tau=tau, com=com,
            angular_momentum=momentum, margin=np.full(n, np.nan), support=self.support,
            contact_force=np.full((n, 2, 6), np.nan), contact_names=self.feet,
            joint_names=body.joint_names,
        )  # fmt: skip


def walk_along(
    path: WalkingPath | WalkRoute,
    body: BodyModel | None = None,
    library: MotionLibrary | None = None,
    *,
    rate: float = RATE,
    height: float = 0.0,
) -> Walk:
    """Walk along a path, from standing to standing.

    The root follows the path exactly, with the swaying of the gait around it; the path's velocities are the
    directives. Feet have one place on the floor in every stance. After the path's end the last step
    is finished and the body stands.

    Args:
        path: A result of :func:`manikin.locomotion.walking_path` or :func:`manikin.locomotion.walking_route`.
        body: A human; that of the library if omitted.
        library: Cycles; those that come with this package if omitted.
        rate: Frames per second [Hz], 20 to 1000.
        height: Of the floor [m].

    Raises:
        InputError: If the path is none, failed, or the rate is not usable.
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
    end = _last_frame(swing, time, path.duration)
    swing[:, end:] = -1.0
    q, _ = legs.reached(frames, put_in_place(legs.feet(frames), swing))
    q[:, 2] += finite_number(height, "height of the floor [m]")
    kept = slice(0, min(end + int(STANDING_TIME * rate) + 1, len(time)))
    support = (swing < 0.0)[:, kept]
    return Walk(
        body, time[kept], q[kept], place[kept], support.T, blend.outside[kept],
        stance_slides(body, frames.q[kept], support), stance_slides(body, q[kept], support),
    )  # fmt: skip


def _last_frame(swing: FloatArray, time: FloatArray, arrival: float) -> int:
    """First frame after the arrival with both feet on the floor."""
    both = np.flatnonzero((swing < 0.0).all(axis=0) & (time >= arrival))
    return int(both[0]) if both.size else len(time) - 1
