"""Postures of a blended gait, before its feet are put on the floor."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.body import BodyModel
from manikin.errors import BodyError
from manikin.locomotion.blend import Blend, ControlSpace, control_space
from manikin.locomotion.fourier import fourier_basis
from manikin.locomotion.library import ROOT, MotionLibrary, leg_length
from manikin.locomotion.turns import quaternions, rotations
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class GaitFrames:
    """n instants of a gait.

    Attributes:
        phase: (n,) share of the cycle, any whole number more counts cycles.
        events: (n, 3) as of :class:`MotionLibrary`.
        pelvis: (n, 3, 3) from the pelvis' axes to the world's.
        turn: (n, 4) the same as xyzw quaternions.
        place: (n, 3) the pelvis' origin [m].
        angles: (n, h) of the hinges [rad].
    """

    phase: FloatArray
    events: FloatArray
    pelvis: FloatArray
    turn: FloatArray
    place: FloatArray
    angles: FloatArray

    @property
    def q(self) -> FloatArray:
        """(n, nq) postures."""
        return np.hstack([self.place, self.turn, self.angles])

    def swing(self) -> FloatArray:
        """(2, n) how far the left and the right foot have swung, 0 to 1; -1 while they stand."""
        phase = self.phase % 1.0
        landing, off, other = self.events.T
        left = phase / np.maximum(landing, 1e-9)
        right = ((phase - off) % 1.0) / np.maximum(other + 1.0 - off, 1e-9)
        both = np.array([left, right])
        return np.where(both < 1.0, both, -1.0)


class Gait:
    """Blends of a library's cycles on a body ([Truong2010]_ 6.6)."""

    def __init__(self, library: MotionLibrary, body: BodyModel) -> None:
        """Prepare a body; places and velocities of the library are scaled with the length of the legs.

        Args:
            library: Cycles.
            body: A human.

        Raises:
            BodyError: If the hinges are not those of the library.
        """
        if body.joint_names != library.joint_names:
            raise BodyError(f"body {body.name!r} has not the hinges of the motion library; valid: a human")
        self.library, self.body = library, body
        self.scale = leg_length(body) / library.leg
        self._to_velocity = np.array([self.scale, self.scale, 1.0])

    @cached_property
    def space(self) -> ControlSpace:
        """Of the library.

        Raises:
            InputError: If the library's velocities span no volume.
        """
        return control_space(self.library)

    def blend(self, velocity: FloatArray) -> Blend:
        """Weights for (n, 3) velocities of this body, forward, left [m/s] and angular [rad/s]."""
        found = self.space.blend(velocity / self._to_velocity)
        return Blend(found.cycles, found.weights, found.velocity * self._to_velocity, found.outside)

    def period(self, blend: Blend) -> FloatArray:
        """(n,) durations of the blended cycles [s], the weighted mean as in the thesis."""
        return np.einsum("nk,nk->n", blend.weights, self.library.periods[blend.cycles])

    def frames(self, blend: Blend, phase: FloatArray, place: FloatArray) -> GaitFrames:
        """Postures at phases, at places of the walker.

        Args:
            blend: Of n instants.
            phase: (n,).
            place: (n, 3) x, y [m], heading [rad] of the line or circle.
        """
        signals = self._signals(blend, phase)
        root = signals[:, : len(ROOT)]
        heading = place[:, 2]
        cosine, sine = np.cos(heading), np.sin(heading)
        ahead, left = self.scale * root[:, 0], self.scale * root[:, 1]
        origin = np.column_stack([
            place[:, 0] + cosine * ahead - sine * left,
            place[:, 1] + sine * ahead + cosine * left,
            self.scale * root[:, 2],
        ])  # fmt: skip
        angles = np.minimum(np.maximum(signals[:, len(ROOT) :], self.body.lower), self.body.upper)
        events = np.einsum("nk,nke->ne", blend.weights, self.library.events[blend.cycles])
        turns = heading + root[:, 5], root[:, 4], root[:, 3]
        return GaitFrames(phase, events, rotations(*turns), quaternions(*turns), origin, angles)

    def _signals(self, blend: Blend, phase: FloatArray) -> FloatArray:
        basis = fourier_basis(phase % 1.0, self.library.harmonics)
        if len(phase) == 1:
            mixed = np.tensordot(blend.weights[0], self.library.coefficients[blend.cycles[0]], axes=1)
            return basis @ mixed
        found = np.zeros((len(phase), self.library.coefficients.shape[2]))
        for cycles, weights in zip(blend.cycles.T, blend.weights.T, strict=True):
            found += weights[:, None] * np.einsum("nk,nks->ns", basis, self.library.coefficients[cycles])
        return found
