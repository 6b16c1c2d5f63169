"""Recorded positions of points of a body, and the cost of postures with its normal equations, many at once.

A point at ``x`` from the root moves with ``v + w x x`` when the joints' velocities add up to ``v`` and ``w``
there. The matrix of the weighted squares is therefore the inertia matrix of a body whose only masses are the
weights at the points, and is put together as that one is: from mass, first and second moments of what each
joint carries (Featherstone, "Rigid Body Dynamics Algorithms", 2008, 6.2).

Instants are the last axis of every array here, so that one call of numpy runs over all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, frozen_array, skew


@dataclass(frozen=True, eq=False)
class Placements:
    """Placements of s segments at n instants, in the axes of the world.

    Attributes:
        roots: (3, n) origins of the root [m].
        turns: (s, 3, 3, n) from the axes of each segment to the world's.
        shifts: (s, 3, n) origins of the segments, from that of the root [m].
        columns: (nv, 6, n) linear velocity at the root's origin and angular velocity per joint speed.
    """

    roots: FloatArray
    turns: FloatArray
    shifts: FloatArray
    columns: FloatArray


class SegmentPlacements:
    """Forward kinematics of some segments of a body."""

    def __init__(self, body: BodyModel, segments: Sequence[str]) -> None:
        """Prepare a body and the names of its segments."""
        self._model = body.pinocchio
        self._data = self._model.createData()
        data: Any = self._data
        frames = [data.oMf[body.segment_frame(name)] for name in segments]
        # Views of Pinocchio's memory: they follow whatever is computed in these data.
        self._turns, self._shifts = [each.rotation for each in frames], [each.translation for each in frames]

    def of(self, q: FloatArray) -> Placements:
        """Placements of (n, nq) postures."""
        n, count, model, data = len(q), len(self._turns), self._model, self._data
        turns, shifts = np.empty((n, count, 3, 3)), np.empty((n, count, 3))
        columns = np.empty((n, model.nv, 6))
        centred = np.array(q)
        centred[:, :3] = 0.0
        for frame, posture in enumerate(centred):
            caused: Any = pin.computeJointJacobians(model, data, posture)
            pin.updateFramePlacements(model, data)
            turns[frame], shifts[frame], columns[frame] = self._turns, self._shifts, caused.T
        moved = (np.ascontiguousarray(np.moveaxis(each, 0, -1)) for each in (turns, shifts, columns))
        return Placements(q[:, :3].T, *moved)


@dataclass(frozen=True, eq=False)
class PointTargets:
    """Points fixed to segments, and where they were recorded.

    A joint centre is the origin of its segment; a marker is any other point of one.

    Attributes:
        names: (k,) names of the points, for messages and reports.
        segments: (k,) the body's segment that carries each point.
        points: (k, 3) the points in the frames of their segments [m].
        positions: (n, k, 3) where they were recorded, in the world [m]; NaN where one was not seen.
        weights: (k,) how much each counts in the sum of squares.
    """

    names: tuple[str, ...]
    segments: tuple[str, ...]
    points: FloatArray
    positions: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        k, seen = len(self.names), np.array(self.positions, dtype=np.float64)
        if k == 0 or len(self.segments) != k:
            raise InputError(f"{k} targets on {len(self.segments)} segments; valid: a segment for each")
        if seen.ndim != 3 or seen.shape[1:] != (k, 3) or np.any(np.isinf(seen)):
            raise InputError(f"target positions have shape {seen.shape}; valid: (n, {k}, 3), not infinite")
        seen[np.any(np.isnan(seen), axis=2)] = np.nan
        never = np.flatnonzero(np.all(np.isnan(seen[..., 0]), axis=0))
        if never.size:
            raise InputError(f"target {self.names[never[0]]!r} is never seen; valid: in at least one frame")
        seen.setflags(write=False)
        object.__setattr__(self, "positions", seen)
        object.__setattr__(self, "points", frozen_array(self.points, "target points", (k, 3)))
        object.__setattr__(self, "weights", frozen_array(self.weights, "target weights", (k,)))
        if np.any(self.weights <= 0.0):
            raise InputError("a target weighs nothing or less; valid: above 0")

    def __len__(self) -> int:
        """Number of instants."""
        return len(self.positions)

    def and_these(self, other: "PointTargets") -> "PointTargets":
        """These targets and others of the same instants."""
        positions = np.concatenate([self.positions, other.positions], axis=1)
        points, weights = np.vstack([self.points, other.points]), np.append(self.weights, other.weights)
        return PointTargets(
            self.names + other.names, self.segments + other.segments, points, positions, weights
        )


def origin_targets(centres: Mapping[str, FloatArray], segments: Sequence[str]) -> PointTargets:
    """Targets of weight 1 of the origins of segments, at recorded joint centres (n, 3) [m] by segment."""
    names = tuple(segments)
    positions = np.stack([centres[name] for name in names], axis=1)
    return PointTargets(names, names, np.zeros((len(names), 3)), positions, np.ones(len(names)))


REST, STEADY = 1e-3, 3e-3
"""Distances [m] that weigh as much as one radian away from the resting posture, and from the one before."""

HOLD = REST**2 + STEADY**2


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Cost of n postures and what it follows from.

    Attributes:
        q: (n, nq) the postures.
        held: (n, h) angles that the hinges are drawn to [rad].
        columns: (nv, 6, n), see :class:`Placements`.
        points: (k, 3, n) from the root [m].
        error: (k, 3, n) of the points from their targets [m]; 0 where one is not seen, as its weight is.
        weights: (k, n).
        cost: (n,) [m^2].
    """

    q: FloatArray
    held: FloatArray
    columns: FloatArray
    points: FloatArray
    error: FloatArray
    weights: FloatArray
    cost: FloatArray

    def only(self, chosen: NDArray[np.bool_]) -> "Evaluation":
        """That of some of the postures, chosen by (n,)."""
        if chosen.all():
            return self
        each = (self.columns, self.points, self.error, self.weights, self.cost)
        return Evaluation(self.q[chosen], self.held[chosen], *(values[..., chosen] for values in each))


class PostureCost:
    """Weighted squares of distances and of angles, with their normal equations.

    The cost is the weighted sum of squared distances of points from their targets plus
    ``(REST * (angle - rest))^2 + (STEADY * (angle - before))^2`` of every hinge, which settles what the
    points leave open without leaps from one instant to the next. The resting posture is the standing one.

    Attributes:
        slots: (d,) numbers of the velocities that move a point: the root's and those of some hinges.
    """

    def __init__(self, body: BodyModel, targets: PointTargets) -> None:
        """Prepare a body and the points of its segments."""
        self._body = body
        self._rest = body.standing_posture()[7:]
        marked = tuple(dict.fromkeys(targets.segments))
        self._placements = SegmentPlacements(body, marked)
        self._carriers = np.array([marked.index(name) for name in targets.segments])
        self._local, self._weights = np.array(targets.points), np.array(targets.weights)
        names = [segment.name for segment in body.segments]
        below = np.eye(len(names), dtype=bool)
        for number in range(len(names) - 1, 0, -1):
            below[names.index(body.segments[number].parent or "")] |= below[number]
        carried = below[:, [names.index(name) for name in targets.segments]]
        owners = np.repeat(np.arange(len(names)), [len(segment.hinges) for segment in body.segments])
        moving = np.flatnonzero(carried[owners].any(axis=1))
        moved = np.concatenate([np.zeros(6, dtype=np.int64), owners[moving]])
        loaded, self._load = np.unique(moved, return_inverse=True)
        self._carried = carried[loaded].astype(np.float64)
        self._coupled = np.tril(below[moved[None], moved[:, None]])
        self._table = _table()
        self._still = np.setdiff1d(np.arange(len(self._rest)), moving)
        self.slots = np.concatenate([np.arange(6), 6 + moving])
        self._angles = 7 + moving
        self._lower, self._upper = body.lower[moving], body.upper[moving]

    def drawn_to(self, before: FloatArray) -> FloatArray:
        """(n, h) angles of least cost without points, after (n, nq) postures [rad]."""
        return (REST**2 * self._rest + STEADY**2 * before[:, 7:]) / HOLD

    def settled(self, q: FloatArray, held: FloatArray) -> FloatArray:
        """(n, nq) postures of which the hinges that move no point are as drawn to."""
        settled = np.array(q)
        settled[:, 7 + self._still] = held[:, self._still]
        return settled

    def later(self, before: FloatArray, instants: int) -> FloatArray:
        """(nq,) a posture whose hinges are drawn to rest for some instants, without points."""
        later = np.array(before)
        later[7:] = self._rest + (STEADY**2 / HOLD) ** instants * (before[7:] - self._rest)
        return later

    def distances(self, q: FloatArray, wanted: FloatArray) -> FloatArray:
        """(n, k) distances of the points from their targets (n, k, 3) [m], NaN where one is not seen."""
        return np.linalg.norm(self.points(q) - wanted, axis=2)

    def points(self, q: FloatArray) -> FloatArray:
        """(n, k, 3) the points in the world in (n, nq) postures [m]."""
        return q[:, None, :3] + self._placed(q)[1].transpose(2, 0, 1)

    def at(self, q: FloatArray, held: FloatArray, wanted: FloatArray) -> Evaluation:
        """The cost of (n, nq) postures drawn to angles ``held``, with targets (n, k, 3) [m]."""
        placed, points = self._placed(q)
        error = points + (placed.roots - wanted.transpose(1, 2, 0))
        weights = self._weights[:, None] * ~np.isnan(error[:, 0])
        error[np.isnan(error)] = 0.0
        away = q[:, 7:] - held
        cost = np.einsum("kn,kin,kin->n", weights, error, error) + HOLD * np.einsum("nh,nh->n", away, away)
        return Evaluation(q, held, placed.columns, points, error, weights, cost)

    def equations(self, here: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Half the gradient (n, d) by :attr:`slots`, and the lower Gauss-Newton matrix (n, d, d)."""
        x, w, columns = here.points, here.weights[:, None], here.columns[self.slots]
        wx, force = w * x, w * here.error
        squares, turning = ((item[:, :, None] * x[:, None]).reshape(len(x), 9, -1) for item in (wx, force))
        moments = np.concatenate([w, wx, squares, force, turning], axis=1)
        sums = (self._carried @ moments.reshape(len(x), -1)).reshape(-1, *moments.shape[1:])
        loads = (self._table @ sums).reshape(len(sums), 7, 6, -1)[self._load]
        gradient = np.einsum("din,din->nd", columns, loads[:, 6])
        pushed = np.einsum("dijn,djn->nid", loads[:, :6], columns).transpose(0, 2, 1)
        matrix = (pushed @ np.ascontiguousarray(columns.transpose(2, 1, 0))) * self._coupled
        gradient[:, 6:] += HOLD * (here.q[:, self._angles] - here.held[:, self._angles - 7])
        hinges = np.arange(6, len(self.slots))
        matrix[:, hinges, hinges] += HOLD
        return gradient, matrix

    def room(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest steps (n, d) that leave the hinges of (n, nq) postures in their ranges."""
        angles, free = q[:, self._angles], np.full((len(q), 6), np.inf)
        return np.hstack([-free, self._lower - angles]), np.hstack([free, self._upper - angles])

    def moved(self, q: FloatArray, steps: FloatArray) -> FloatArray:
        """Postures after steps (n, d), hinges within their ranges; no step turns by more than 1 rad."""
        largest = np.abs(steps[:, 3:]).max(axis=1)
        velocities = np.zeros((len(q), self._body.nv))
        velocities[:, self.slots] = steps / np.maximum(largest, 1.0)[:, None]
        model = self._body.pinocchio
        moved = np.array([pin.integrate(model, *pair) for pair in zip(q, velocities, strict=True)])
        moved[:, 7:] = np.clip(moved[:, 7:], self._body.lower, self._body.upper)
        return moved

    def _placed(self, q: FloatArray) -> tuple[Placements, FloatArray]:
        """The segments with points in (n, nq) postures, and the points (k, 3, n) from the root [m]."""
        placed = self._placements.of(q)
        turned = np.einsum("kijn,kj->kin", placed.turns[self._carriers], self._local)
        return placed, placed.shifts[self._carriers] + turned


def _table() -> FloatArray:
    """(42, 25) from ``w, w x, w x x^T, f, f x^T`` of a point to its inertia (6, 6), force and moment."""
    axes, inertia, force = np.eye(3), np.zeros((6, 6, 25)), np.zeros((6, 25))
    inertia[:3, :3, 0] = np.eye(3)
    for a in range(3):
        inertia[3:, :3, 1 + a], inertia[:3, 3:, 1 + a] = skew(axes[a]), -skew(axes[a])
        force[a, 13 + a] = 1.0
    for place, (a, b) in enumerate(product(range(3), range(3))):
        inertia[3:, 3:, 4 + place] = -skew(axes[a]) @ skew(axes[b])
        force[3:, 16 + place] = np.cross(axes[b], axes[a])
    return np.concatenate([inertia.reshape(36, 25), force])
