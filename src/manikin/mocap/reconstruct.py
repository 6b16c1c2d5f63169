"""A recorded skeleton's motion as a motion of our human, scaled to the person."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.mocap.closed_form import closed_form
from manikin.mocap.guides import guides, trunk_turns
from manikin.mocap.inverse_kinematics import InverseKinematics
from manikin.mocap.joint_centres import CENTRES, joint_centres
from manikin.mocap.proportions import human_of
from manikin.mocap.recording import Recording
from manikin.mocap.targets import Targets, origin_targets
from manikin.spatial import FloatArray, frozen_array

FEWEST_FRAMES = 2

POOR = 0.05
"""A frame with a joint farther away than this [m] is searched from the closed form, too."""


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Postures of a body that follow recorded points.

    Attributes:
        body: The body used, with the person's lengths.
        time: (n,) instants, 0 at the first [s].
        q: (n, nq) postures, every hinge within its limits.
        joints: (j,) names of the joint centres, those of the segments that begin there.
        residual: (n, j) distance of each from where it was recorded [m].
    """

    body: BodyModel
    time: FloatArray
    q: FloatArray
    joints: tuple[str, ...]
    residual: FloatArray

    def __post_init__(self) -> None:
        n = len(self.time)
        for name, shape in (("time", (n,)), ("q", (n, self.body.nq)), ("residual", (n, len(self.joints)))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"reconstruction {name}", shape))

    @cached_property
    def median(self) -> float:
        """Of all residuals [m]."""
        return float(np.median(self.residual))

    @cached_property
    def worst(self) -> float:
        """The largest residual [m]."""
        return float(self.residual.max())


def reconstruct(
    recording: Recording, body: BodyModel | None = None, *, sex: str = "male", mass: float | None = None
) -> Reconstruction:
    """Motion of our human that follows a recorded skeleton, by inverse kinematics within joint limits.

    Hips, knees, ankles, shoulders, elbows and wrists are followed (:mod:`manikin.mocap.joint_centres`);
    the turns of pelvis, thorax, head, feet and hands count less (:mod:`manikin.mocap.guides`). The
    first frame starts from the closed form (:mod:`manikin.mocap.closed_form`), every other one from
    the frame before. Our shoulders are fixed in the thorax: movements of a recorded shoulder girdle
    remain as residuals.

    Args:
        recording: Motion of a skeleton, at least two frames.
        body: Our human; None for one with the lengths of the recorded person. Where other clips of the
            person exist, take the body of one in which the person stands or walks: the trunk's length
            is told by extended postures only.
        sex: Table of segment masses where ``body`` is None.
        mass: Body mass where ``body`` is None [kg]; None for a usual one.

    Raises:
        InputError: If the recording has one frame only or lacks a joint.
        BodyError: If the person's lengths are not those of an adult.
    """
    if not isinstance(recording, Recording):
        raise InputError(f"reconstruction of a {type(recording).__name__}; valid: a Recording of a skeleton")
    if len(recording) < FEWEST_FRAMES:
        raise InputError(
            f"recording {recording.name!r} has {len(recording)} frame; valid: at least {FEWEST_FRAMES}"
        )
    centres = joint_centres(recording)
    measured = human_of(centres, sex, mass)
    person = measured if body is None else body
    pelvis, thorax = (trunk_turns(recording, centres, name) for name in ("pelvis", "thorax"))
    wanted = origin_targets(centres, CENTRES)
    followed = wanted.and_these(guides(recording, person, centres, pelvis, thorax))
    q, residual = follow(person, followed, closed_form(person, centres, pelvis, thorax))
    return Reconstruction(person, recording.time, q, wanted.names, residual[:, : len(wanted.names)])


def follow(body: BodyModel, targets: Targets, starts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Postures that follow targets, each searched from the one before.

    Args:
        body: The body that carries the targets' points.
        targets: Of n instants.
        starts: (n, nq) postures within the limits; the first is where the search begins, the others
            are tried where the search from the frame before leaves a point farther than :data:`POOR`.

    Returns:
        (n, nq) postures and (n, k) distances of the points from their targets [m].
    """
    solver = InverseKinematics(body, targets)
    q, residual = np.empty((len(targets), body.nq)), np.empty((len(targets), len(targets.names)))
    start = starts[0]
    for frame, wanted in enumerate(targets.positions):
        start, cost = solver.solve(start, wanted)
        away = _distances(solver, start, wanted)
        if frame and away[targets.weights >= 1.0].max(initial=0.0) > POOR:
            other, other_cost = solver.solve(starts[frame], wanted)
            if other_cost < 0.9 * cost:
                start, away = other, _distances(solver, other, wanted)
        q[frame], residual[frame] = start, away
    return q, residual


def _distances(solver: InverseKinematics, q: FloatArray, wanted: FloatArray) -> FloatArray:
    return np.linalg.norm(solver.places(q) - wanted, axis=1)
