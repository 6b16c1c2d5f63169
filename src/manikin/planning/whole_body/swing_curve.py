"""A smooth flight of an effector between two poses, in closed form.

Positions are a clamped B-spline of degree 5 on uniform knots, rotations the cumulative B-spline of the same
degree on SO(3) ([Kim1995]_: products of exponentials, so a turn about one axis is exactly the shortest one).
The first four and the last four control poses are equal, so velocity, acceleration and jerk vanish at both
ends; the fifth one from either end lies on the surface normal, along which the curve leaves and arrives.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, axes_of_normal, finite_number, frozen_array
from manikin.planning.whole_body.swing_path import EffectorPath, Pose

DEGREE = 5
"""Degree of the curves: four continuous derivatives."""

RESTING = 4
"""Equal control poses at each end."""

MIN_CONTROLS = 2 * RESTING + 2
"""Fewest control poses: the resting ones and one normal lift at each end."""


@dataclass(frozen=True, eq=False)
class SwingState:
    """An effector's motion at some instants, in the world frame.

    Attributes:
        time: (k,) [s].
        position: (k, 3) [m].
        rotation: (k, 3, 3) effector-to-world.
        velocity: (k, 3) [m/s].
        angular_velocity: (k, 3) [rad/s].
        acceleration: (k, 3) [m/s^2].
    """

    time: FloatArray
    position: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class SwingCurve:
    """A flight from rest to rest, C4 in time.

    Use :meth:`lift` or :meth:`along` to make one.

    Attributes:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        control_position: (n, 3) control points [m].
        control_rotation: (n, 3, 3) control rotations, effector-to-world.
    """

    start_time: float
    end_time: float
    control_position: FloatArray
    control_rotation: FloatArray

    def __post_init__(self) -> None:
        start = finite_number(self.start_time, "swing start_time [s]")
        finite_number(self.end_time, "swing end_time [s]", above=start)
        positions = frozen_array(self.control_position, "swing control_position [m]", (None, 3))
        n = len(positions)
        _check_controls(n)
        object.__setattr__(self, "control_position", positions)
        rotations = frozen_array(self.control_rotation, "swing control_rotation", (n, 3, 3))
        object.__setattr__(self, "control_rotation", rotations)

    @classmethod
    def lift(
        cls, start: Pose, goal: Pose, start_time: float, end_time: float, *, height: float = 0.08,
        lateral: float = 0.0, apex: float = 0.5, start_normal: ArrayLike = (0.0, 0.0, 1.0),
        end_normal: ArrayLike = (0.0, 0.0, 1.0), pitch: float = 0.0, controls: int = 20,
    ) -> "SwingCurve":  # fmt: skip
        """Smoothest curve (least integral of squared jerk) over one apex.

        The rotation follows the shortest turn with the timing of a straight flight.

        Args:
            start_time: Lift-off [s].
            end_time: Touch-down [s].
            height: Of the apex above the higher end, along the mean normal [m].
            lateral: Offset of the apex to the left of the travel, seen from above [m].
            apex: Share of the duration at which the apex is passed.
            start_normal: (3,) surface normal along which the curve leaves.
            end_normal: (3,) surface normal along which it arrives, reversed.
            pitch: Extra turn about the effector's own y axis in early flight, toes down when positive [rad].
        """
        up, left = _flight_axes(start.position, goal.position, np.add(start_normal, end_normal))
        share = 0.5 + 0.6 * (apex - 0.5)  # where along the way: close to the middle even for early apexes
        middle = (1.0 - share) * start.position + share * goal.position
        top = max(float(up @ start.position), float(up @ goal.position)) + height
        point = middle + (top - float(up @ middle)) * up + lateral * left
        gain = _least_jerk(controls, apex, _unit(start_normal).tobytes(), _unit(end_normal).tobytes())
        positions = (gain @ np.concatenate([start.position, goal.position, point])).reshape(controls, 3)
        turns = _turning(start.rotation.tobytes(), goal.rotation.tobytes(), pitch, controls)
        return cls(start_time, end_time, positions, turns)

    @classmethod
    def along(cls, path: EffectorPath, controls: int = 20, sharpening: int = 0) -> "SwingCurve":
        """Curve that follows a polyline of timed poses, rounding its corners.

        The control poses are taken from the path (Schoenberg's variation-diminishing approximation): the
        curve has no more wiggles than the path, stays in the convex hull of any few neighbouring control
        points and converges to the path as ``controls`` grows.

        Args:
            path: Timed poses, as found by the Bi-RRT.
            controls: Number of control poses; fewer are smoother, more are closer.
            sharpening: How often the remaining offset from the path is added to the control points; the
                curve then swings around the corners on the outside rather than cutting them.
        """
        _check_controls(controls)
        places = _greville(controls)
        first, last = places[RESTING - 1], places[-RESTING]
        shares = np.clip((places - first) / (last - first), 0.0, 1.0)
        target, rotation = path.sample(path.time[0] + shares * path.duration)
        inner, weights = slice(RESTING, controls - RESTING), basis(places, controls)
        position = target.copy()
        for _ in range(sharpening):
            position[inner] += (target - weights @ position)[inner]
        return cls(float(path.time[0]), float(path.time[-1]), position, rotation)

    @property
    def duration(self) -> float:
        """Time of flight [s]."""
        return self.end_time - self.start_time

    @property
    def start(self) -> Pose:
        """Pose at lift-off."""
        return Pose(self.control_position[0], self.control_rotation[0])

    @property
    def end(self) -> Pose:
        """Pose at touch-down."""
        return Pose(self.control_position[-1], self.control_rotation[-1])

    def evaluate(self, time: ArrayLike) -> SwingState:
        """Pose, velocity and acceleration at the given times; at rest before and after the flight.

        Args:
            time: Scalar or (k,) [s].
        """
        times = np.atleast_1d(np.asarray(time, dtype=np.float64))
        share = np.clip((times - self.start_time) / self.duration, 0.0, 1.0)
        rate = 1.0 / self.duration
        weights = [basis(share, len(self.control_position), order) * rate**order for order in range(3)]
        rotation, angular_velocity = _turned(self.control_rotation.tobytes(), share.tobytes(), rate)
        position, velocity, acceleration = (weight @ self.control_position for weight in weights)
        return SwingState(times, position, rotation, velocity, angular_velocity, acceleration)

    def at(self, time: float) -> Pose:
        """Pose at one time [s]."""
        state = self.evaluate(time)
        return Pose(state.position[0], state.rotation[0])

    @cached_property
    def peak_speed(self) -> float:
        """Largest linear speed [m/s], sampled at 1 % of the flight."""
        return float(np.linalg.norm(self._dense.velocity, axis=1).max())

    @cached_property
    def peak_angular_speed(self) -> float:
        """Largest angular speed [rad/s], sampled at 1 % of the flight."""
        return float(np.linalg.norm(self._dense.angular_velocity, axis=1).max())

    def haste(self, speed: float, angular_speed: float) -> str | None:
        """Reason why a peak speed is above its limit [m/s, rad/s], or None."""
        if self.peak_speed > speed:
            return f"speed reaches {self.peak_speed:.2f} m/s; limit {speed:.2f} m/s"
        peak = self.peak_angular_speed
        fast = peak > angular_speed
        return f"angular speed reaches {peak:.2f} rad/s; limit {angular_speed:.2f} rad/s" if fast else None

    @cached_property
    def effort(self) -> float:
        """Root mean square of the linear acceleration over the flight [m/s^2]."""
        return float(np.sqrt(np.mean(np.sum(self._dense.acceleration**2, axis=1))))

    @cached_property
    def _dense(self) -> SwingState:
        return self.evaluate(np.linspace(self.start_time, self.end_time, 101))


@lru_cache(maxsize=64)
def _turned(control_rotation: bytes, shares: bytes, rate: float) -> tuple[FloatArray, FloatArray]:
    """Rotations (k, 3, 3) and angular velocities (k, 3) in the world, the same for all curves of a family.

    Args:
        control_rotation: (n, 3, 3) as bytes.
        shares: (k,) of the duration, as bytes.
        rate: One over the duration [1/s].
    """
    controls, share = np.frombuffer(control_rotation).reshape(-1, 3, 3), np.frombuffer(shares)
    weights = [basis(share, len(controls), order) * rate**order for order in range(2)]
    rotation = np.broadcast_to(controls[0], (len(share), 3, 3)).copy()
    velocity = np.zeros((len(share), 3))  # in the turning frame
    turns = Rotation.from_matrix(np.swapaxes(controls[:-1], 1, 2) @ controls[1:]).as_rotvec()
    turning = np.flatnonzero(np.any(np.abs(turns) > 1e-14, axis=1))
    # Cumulative basis: the sum of the basis functions from this control pose on.
    cumulative = [[w[:, index + 1 :].sum(axis=1)[:, None] for w in weights] for index in turning]
    angles = np.array([b * turns[index] for index, (b, _) in zip(turning, cumulative, strict=True)])
    steps = Rotation.from_rotvec(angles.reshape(-1, 3)).as_matrix().reshape(-1, len(share), 3, 3)
    for index, step, (_, slope) in zip(turning, steps, cumulative, strict=True):
        velocity = np.einsum("kji,kj->ki", step, velocity) + slope * turns[index]
        rotation = rotation @ step
    found = rotation, np.einsum("kij,kj->ki", rotation, velocity)
    for array in found:
        array.setflags(write=False)
    return found


def _check_controls(count: int) -> None:
    if count < MIN_CONTROLS:
        raise InputError(f"swing has {count} control poses; valid: at least {MIN_CONTROLS}")


def basis(share: FloatArray, controls: int, derivative: int = 0) -> FloatArray:
    """(k, controls) B-spline basis on [0, 1], or its derivative by the share of the duration."""
    return _spline(controls, derivative)(share) if len(share) else np.zeros((0, controls))


@lru_cache(maxsize=256)
def _spline(controls: int, derivative: int) -> BSpline:
    spline = BSpline(_knots(controls), np.eye(controls), DEGREE)
    return spline.derivative(derivative) if derivative else spline


def _knots(controls: int) -> FloatArray:
    return np.pad(np.linspace(0.0, 1.0, controls - DEGREE + 1), DEGREE, mode="edge")


def _greville(controls: int) -> FloatArray:
    """Share at which each control point acts: averages of DEGREE neighbouring knots."""
    knots = _knots(controls)
    return np.array([knots[i + 1 : i + DEGREE + 1].mean() for i in range(controls)])


@lru_cache(maxsize=64)
def jerk_energy(controls: int) -> FloatArray:
    """(controls, controls) matrix of the integral of squared jerk over a unit duration."""
    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact: the squared jerk has degree 4
    edges = np.linspace(0.0, 1.0, controls - DEGREE + 1)
    middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
    share = (middle[:, None] + half[:, None] * nodes).ravel()
    rows = basis(share, controls, 3)
    energy = rows.T @ ((half[:, None] * weights).ravel()[:, None] * rows)
    energy.setflags(write=False)
    return energy


def block_rows(weights: FloatArray) -> FloatArray:
    """(3k, 3n) weights for control points flattened row by row, from (k, n) weights of one coordinate."""
    return np.asarray(np.kron(weights, np.eye(3)), dtype=np.float64)


def _unit(normal: ArrayLike) -> FloatArray:
    """(3,) direction of a normal."""
    n = frozen_array(normal, "surface normal", (3,))
    length = float(np.linalg.norm(n))
    if length < 1e-12:
        raise InputError(f"surface normal is {n.tolist()}; valid: a direction that is not zero")
    return n / length


@lru_cache(maxsize=64)
def _least_jerk(controls: int, apex: float, leaving: bytes, reaching: bytes) -> FloatArray:
    """(3n, 9) map from the places of both ends and of the apex to the control points of least jerk.

    The first and the last rest at their ends, their neighbours are on the normals there.

    Args:
        apex: Share of the duration at which the apex is passed.
        leaving: (3,) unit normal at the start, as bytes.
        reaching: The same at the end.
    """
    across = [axes_of_normal(np.frombuffer(normal))[:, :2].T for normal in (leaving, reaching)]
    # Control points with the end, 0 or 1, that they share coordinates with.
    shared = [(index, np.eye(3), 0) for index in range(RESTING)]
    shared += [(index, np.eye(3), 1) for index in range(controls - RESTING, controls)]
    shared += [(RESTING, across[0], 0), (controls - RESTING - 1, across[1], 1)]
    rows = [np.kron(np.eye(controls)[[index]], block) for index, block, _ in shared]
    places = [np.kron(np.eye(3)[[end]], block) for _, block, end in shared]
    matrix = np.vstack([*rows, block_rows(basis(np.array([apex]), controls))])
    target = np.vstack([*places, np.eye(9)[6:]])
    energy, m = jerk_energy(controls), len(matrix)
    hessian = block_rows(energy / np.trace(energy)) + 1e-12 * np.eye(3 * controls)
    system = np.block([[hessian, matrix.T], [matrix, np.zeros((m, m))]])
    targets = np.vstack([np.zeros((3 * controls, 9)), target])
    return np.asarray(np.linalg.solve(system, targets)[: 3 * controls], dtype=np.float64)


@lru_cache(maxsize=64)
def _turning(leaving: bytes, reaching: bytes, pitch: float, controls: int) -> FloatArray:
    """Control rotations of the shortest turn, timed like a straight flight, and the extra pitch.

    Args:
        leaving: (3, 3) rotation at the start, as bytes.
        reaching: The same at the end.
    """
    start, goal = (np.frombuffer(turn).reshape(3, 3) for turn in (leaving, reaching))
    share = _straight_shares(controls)
    turn = Rotation.from_matrix(start.T @ goal).as_rotvec()
    decline = 2.0  # time in which the extra pitch fades relative to that in which it grows
    peak = 1.0 / (1.0 + decline)
    bell = share * (1.0 - share) ** decline / (peak * (1.0 - peak) ** decline)
    straight = Rotation.from_rotvec(share[:, None] * turn)
    nod = Rotation.from_rotvec(bell[:, None] * np.array([0.0, pitch, 0.0]))
    rotations = start @ (straight * nod).as_matrix()
    rotations[: RESTING + 1], rotations[-RESTING - 1 :] = start, goal
    return rotations


@lru_cache(maxsize=64)
def _straight_shares(controls: int) -> FloatArray:
    """(controls,) control values of the smoothest flight from 0 to 1, with one more resting at each end."""
    resting = RESTING + 1
    matrix = np.eye(controls)[[*range(resting), *range(controls - resting, controls)]]
    target, energy = np.repeat([0.0, 1.0], resting), jerk_energy(controls)
    system = np.block([[energy / np.trace(energy), matrix.T], [matrix, np.zeros((len(target), len(target)))]])
    solution = np.linalg.lstsq(system, np.concatenate([np.zeros(controls), target]), rcond=None)[0]
    shares = np.asarray(np.clip(solution[:controls], 0.0, 1.0), dtype=np.float64)
    shares.setflags(write=False)
    return shares


def _flight_axes(start: FloatArray, goal: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors up, along the sum of the normals, and left of the travel."""
    length = float(np.linalg.norm(up))
    up = up / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    left = np.cross(up, goal - start)
    size = float(np.linalg.norm(left))
    return up, left / size if size > 1e-9 else -axes_of_normal(up)[:, 0]
