"""Which cycles make up a walk of given velocities, with what weights, before feet are put on the floor.

A walker's root follows a line or circle over one cycle, with a periodic error around it.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import Delaunay, QhullError
from trimesh.triangles import closest_point, points_to_barycentric

from manikin.body import BodyModel
from manikin.errors import BodyError, InputError
from manikin.numerics.signals import fourier_basis
from manikin.numerics.spatial import FloatArray, quaternions, rotation_from_yaw, rotations
from manikin.walking.gait.motion_library import MIRRORED, ROOT, MotionLibrary, leg_length


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """Constant velocity of a root and the periodic error around it.

    Attributes:
        velocity: (3,) forward, left [m/s], angular [rad/s].
        start: (3,) x, y [m], heading [rad] at the cycle's begin.
        error: (n, 3) ahead, to the left [m] and in yaw [rad], in the axes of the moving heading; of zero
            mean, and equal at both ends of the cycle.
    """

    velocity: FloatArray
    start: FloatArray
    error: FloatArray


def travelled(velocity: FloatArray, time: FloatArray) -> FloatArray:
    """(..., 3) x, y, heading reached from the origin with velocities (..., 3) after times (...) [s]."""
    turn = velocity[..., 2] * time
    # sin(a)/a and (1 - cos a)/a, as series where a is small and the circle a line.
    small = np.abs(turn) < 1e-6
    safe = np.where(small, 1.0, turn)
    along = np.where(small, 1.0 - turn**2 / 6.0, np.sin(turn) / safe)
    aside = np.where(small, 0.5 * turn, (1.0 - np.cos(turn)) / safe)
    forward, left = velocity[..., 0] * time, velocity[..., 1] * time
    return np.stack([along * forward - aside * left, aside * forward + along * left, turn], axis=-1)


def steady_motion(place: FloatArray, period: float) -> SteadyMotion:
    """Line or circle of one cycle ([Truong2010]_ 6.4.3) together with the periodic error around it (6.4.4).

    Least squares on the place alone would take a part of the oscillation for velocity: a sine of
    amplitude A over one period T has the slope ``6 A / (pi T)``, some 3 % of a walk's speed. Asked instead is
    that the error have no mean and be the same at both ends: four linear equations for start and velocity.

    Args:
        place: (n, 3) x, y [m], heading [rad] at even instants from begin to end of the cycle, both included.
        period: Duration of the cycle [s].
    """
    share = np.linspace(0.0, 1.0, len(place))
    mean = np.full(len(place), 1.0 / (len(place) - 1))
    mean[[0, -1]] *= 0.5
    turn = place[-1, 2] - place[0, 2]
    start = float(mean @ (place[:, 2] - turn * share))
    heading = start + turn * share
    back = rotation_from_yaw(0.0)[None, :2, :2] * np.cos(heading)[:, None, None]
    back = back + np.array([[0.0, 1.0], [-1.0, 0.0]]) * np.sin(heading)[:, None, None]
    # Places reached per unit of forward and of left velocity, from the start and its heading.
    units = [np.array([*unit, turn / period]) for unit in ((1.0, 0.0), (0.0, 1.0))]
    reached = np.stack([travelled(unit, period * share)[:, :2] for unit in units], axis=-1)
    reached = rotation_from_yaw(start)[:2, :2] @ reached
    local = np.einsum("nij,nj->ni", back, place[:, :2])
    moved = back @ reached
    system = np.block([
        [np.einsum("n,nij->ij", mean, back), np.einsum("n,nij->ij", mean, moved)],
        [back[-1] - back[0], moved[-1] - moved[0]],
    ])  # fmt: skip
    solution = np.linalg.solve(system, np.concatenate([mean @ local, local[-1] - local[0]]))
    error = local - back @ solution[:2] - moved @ solution[2:]
    return SteadyMotion(
        np.append(solution[2:], turn / period), np.append(solution[:2], start),
        np.column_stack([error, place[:, 2] - heading]),
    )  # fmt: skip


TURN_RADIUS = 0.5
"""In the control space an angular velocity counts as the speed at this distance [m]."""

_REFLECTED = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Blend:
    """Weights of cycles at n instants.

    Attributes:
        cycles: (n, k) indices of the cycles in the library.
        weights: (n, k) weights with the sum 1.
        velocity: (n, 3) forward, left [m/s], angular [rad/s] of the blend.
        outside: (n,) whether other velocities were asked for, beyond those of the library.
    """

    cycles: NDArray[np.int64]
    weights: FloatArray
    velocity: FloatArray
    outside: NDArray[np.bool_]


class ControlSpace:
    """Cycles by velocity, as vertices of tetrahedra ([Truong2010]_ 6.5, eq. 6.2).

    The coordinates are the forward, left and angular velocities. The thesis' first one is the total speed,
    of which the lateral velocity is a component: points with it larger do not exist, and walking backward
    and forward are the same. The forward velocity has neither fault, and blends of velocities are then
    exactly those of the blended motion.

    Tetrahedra of a library that contains mirror images need not be mirror images. The weights are therefore
    the mean of those found for the velocity and those found for its reflection, reflected: a directive
    straight ahead gives a symmetric walk.
    """

    def __init__(self, library: MotionLibrary) -> None:
        """Build the tetrahedra; InputError if the velocities of the library span no volume."""
        self.library = library
        self.scale = np.array([1.0, 1.0, TURN_RADIUS])
        self._points = library.velocities * self.scale
        try:
            self._cells = Delaunay(self._points)
        except (QhullError, ValueError):
            raise InputError(
                f"the {len(library)} velocities of the motion library span no volume; "
                "valid: at least 4 cycles, forward, sideways and turning"
            ) from None
        self._partners = _partners(library)

    @cached_property
    def on_hull(self) -> NDArray[np.bool_]:
        """(c,) whether a cycle is at the border of what the library reaches."""
        return np.isin(np.arange(len(self.library)), self._cells.convex_hull)

    def blend(self, velocity: ArrayLike) -> Blend:
        """Weights for (n, 3) velocities; beyond the library, for the nearest ones that it reaches."""
        wanted = np.asarray(velocity, dtype=np.float64) * self.scale
        if self._partners is None:
            found = self._located(wanted)
            return replace(found, velocity=found.velocity / self.scale)
        n, both = len(wanted), self._located(np.concatenate([wanted, wanted * _REFLECTED]))
        cycles, weights, reached = both.cycles, both.weights, both.velocity
        return Blend(
            np.hstack([cycles[:n], self._partners[cycles[n:]]]), 0.5 * np.hstack([weights[:n], weights[n:]]),
            0.5 * (reached[:n] + reached[n:] * _REFLECTED) / self.scale, both.outside[:n],
        )  # fmt: skip

    def _located(self, points: FloatArray) -> Blend:
        """Vertices (n, 4) with the points, or the nearest ones, as (n, 3) scaled velocities."""
        cell = self._cells.find_simplex(points)
        transform = self._cells.transform[cell]
        first = np.einsum("nij,nj->ni", transform[:, :3], points - transform[:, 3])
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)])
        cycles = self._cells.simplices[cell].astype(np.int64)
        missed = (cell < 0) | ~np.isfinite(weights).all(axis=1)
        outside, reached = missed.copy(), points.copy()
        if missed.any():
            corners, shares = self._on_faces(points[missed])
            cycles[missed], weights[missed] = corners, shares
            reached[missed] = np.einsum("nk,nki->ni", shares, self._points[corners])
            outside[missed] = np.linalg.norm(reached[missed] - points[missed], axis=1) > 1e-9
        weights = np.clip(weights, 0.0, 1.0)
        return Blend(cycles, weights / weights.sum(axis=1, keepdims=True), reached, outside)

    def _on_faces(self, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Corners (n, 4) and weights (n, 4) of the nearest points on the triangles of the hull."""
        faces, n = self._cells.convex_hull, len(points)
        triangles = np.tile(self._points[faces], (n, 1, 1))
        places = closest_point(triangles, np.repeat(points, len(faces), axis=0)).reshape(n, -1, 3)
        best = np.linalg.norm(places - points[:, None], axis=2).argmin(axis=1)
        corners = faces[best].astype(np.int64)
        shares = points_to_barycentric(self._points[corners], places[np.arange(n), best])
        return corners[:, [0, 1, 2, 2]], np.hstack([shares, np.zeros((n, 1))])


_control_space = lru_cache(maxsize=4)(ControlSpace)


def _partners(library: MotionLibrary) -> NDArray[np.int64] | None:
    """(c,) index of each cycle's mirror image, its own for a symmetric one; None if one has none."""
    numbers = {name: number for number, name in enumerate(library.names)}
    partners = np.empty(len(library), dtype=np.int64)
    for name, number in numbers.items():
        other = name.removesuffix(MIRRORED) if name.endswith(MIRRORED) else name + MIRRORED
        partners[number] = numbers.get(other, number)
    reflected = library.velocities[partners] * _REFLECTED
    return partners if np.allclose(reflected, library.velocities, rtol=0.0, atol=1e-9) else None


@dataclass(frozen=True, eq=False)
class GaitFrames:
    """n instants of a gait.

    Attributes:
        phase: (n,) share of the cycle [-]; whole numbers count cycles.
        events: (n, 3) as of :class:`MotionLibrary`.
        pelvis: (n, 3, 3) rotations from the pelvis to the world.
        turn: (n, 4) the same as xyzw quaternions.
        place: (n, 3) origin of the pelvis [m].
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
        """(2, n) share of the swing of the left and the right foot, 0 to 1; -1 while they stand."""
        phase, (landing, off, other) = self.phase % 1.0, self.events.T
        right = ((phase - off) % 1.0) / np.maximum(other + 1.0 - off, 1e-9)
        both = np.array([phase / np.maximum(landing, 1e-9), right])
        return np.where(both < 1.0, both, -1.0)


class Gait:
    """Blends of a library's cycles on a body ([Truong2010]_ 6.6)."""

    def __init__(self, library: MotionLibrary, body: BodyModel) -> None:
        """Take a human with the library's hinges; places and velocities scale with the length of the legs."""
        if body.joint_names != library.joint_names:
            raise BodyError(f"body {body.name!r} has not the hinges of the motion library; valid: a human")
        self.library, self.body = library, body
        self.scale = leg_length(body) / library.leg
        self._to_velocity = np.array([self.scale, self.scale, 1.0])

    def blend(self, velocity: FloatArray) -> Blend:
        """Weights for (n, 3) velocities of this body, forward, left [m/s] and angular [rad/s]."""
        blend = _control_space(self.library).blend(velocity / self._to_velocity)
        return replace(blend, velocity=blend.velocity * self._to_velocity)

    def period(self, blend: Blend) -> FloatArray:
        """(n,) durations of the blended cycles [s], the weighted mean as in the thesis."""
        return np.einsum("nk,nk->n", blend.weights, self.library.periods[blend.cycles])

    def frames(self, blend: Blend, phase: FloatArray, place: FloatArray) -> GaitFrames:
        """Postures of a blend at n shares of the cycle (n,) and places (n, 3) of the line or circle."""
        signals = self._signals(blend, phase)
        root, heading = signals[:, : len(ROOT)], place[:, 2]
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
            return basis @ np.tensordot(blend.weights[0], self.library.coefficients[blend.cycles[0]], axes=1)
        signals = np.zeros((len(phase), self.library.coefficients.shape[2]))
        for cycles, weights in zip(blend.cycles.T, blend.weights.T, strict=True):
            signals += weights[:, None] * np.einsum("nk,nks->ns", basis, self.library.coefficients[cycles])
        return signals
