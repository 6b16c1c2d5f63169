"""Where points of a body's segments were recorded, instant by instant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False)
class Targets:
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
        k, places = len(self.names), np.array(self.positions, dtype=np.float64)
        if k == 0 or len(self.segments) != k:
            raise InputError(f"{k} targets on {len(self.segments)} segments; valid: a segment for each")
        if places.ndim != 3 or places.shape[1:] != (k, 3) or np.any(np.isinf(places)):
            raise InputError(f"target positions have shape {places.shape}; valid: (n, {k}, 3), not infinite")
        places[np.any(np.isnan(places), axis=2)] = np.nan
        never = np.flatnonzero(np.all(np.isnan(places[..., 0]), axis=0))
        if never.size:
            raise InputError(f"target {self.names[never[0]]!r} is never seen; valid: in at least one frame")
        places.setflags(write=False)
        object.__setattr__(self, "points", frozen_array(self.points, "target points", (k, 3)))
        object.__setattr__(self, "positions", places)
        object.__setattr__(self, "weights", frozen_array(self.weights, "target weights", (k,)))
        if np.any(self.weights <= 0.0):
            raise InputError("a target weighs nothing or less; valid: above 0")

    def __len__(self) -> int:
        """Number of instants."""
        return len(self.positions)

    def and_these(self, other: "Targets") -> "Targets":
        """These targets and others of the same instants."""
        return Targets(
            self.names + other.names, self.segments + other.segments,
            np.concatenate([self.points, other.points]),
            np.concatenate([self.positions, other.positions], axis=1),
            np.concatenate([self.weights, other.weights]),
        )  # fmt: skip


def origin_targets(centres: Mapping[str, FloatArray], segments: Sequence[str]) -> Targets:
    """Targets of the origins of segments, each of weight 1.

    Args:
        centres: (n, 3) recorded joint centres [m] by the segment that begins there.
        segments: Which of them.
    """
    names = tuple(segments)
    positions = np.stack([centres[name] for name in names], axis=1)
    return Targets(names, names, np.zeros((len(names), 3)), positions, np.ones(len(names)))
