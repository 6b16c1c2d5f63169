"""Objects that a run with operations takes up: where they are at any instant.

The summary says where each is at the end of every operation. While one is on its way it follows the hands, as
it does in the plan: their middle and the line between them, seen from above.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, Configuration
from manikin.body.segments import HANDS
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.pipeline.run_directory import RunRecord
from manikin.scene import Obstacle, Scene
from manikin.scene.scene import FLOOR

LOOKED_AT = 60
"""Number of instants of an operation among which that of setting down is sought."""
STILL = 1.0e-6
"""Change of a place below which an object rests during an operation [m, rad]."""


def object_places(record: RunRecord, motion: Motion, samples: NDArray[np.int64]) -> dict[str, FloatArray]:
    """Position [m] and yaw [rad], (n, 4), of each object that is taken up, by name.

    Args:
        record: Of a run; one without operations has no such objects.
        motion: One of its motions.
        samples: (n,) numbers of samples of the motion.
    """
    body, time = record.body, motion.time[samples]
    found = dict[str, FloatArray]()
    for name, obstacle in _taken(record):
        rows, before = np.empty((len(samples), 4)), _place(obstacle)
        for item in _operations(record):
            there = next((one for one in item["objects"] if one["name"] == name), None)
            after = before if there is None else np.append(there["position"], np.deg2rad(there["yaw_deg"]))
            during = (time >= item["start_s"]) & (time <= item["end_s"])
            rows[during] = after
            if body is not None and np.abs(after - before).max() > STILL:
                held = _held(body, motion, item, before, after, samples[during])
                rows[np.flatnonzero(during)[: len(held)]] = held
            before = after
        rows[time > _operations(record)[-1]["end_s"]] = before
        found[name] = rows
    return found


def scene_at(record: RunRecord, motion: Motion, sample: int) -> Scene | None:
    """The scene with what is taken up where it is at a sample of a motion."""
    places = object_places(record, motion, np.array([sample]))
    if record.scene is None or not places:
        return record.scene
    obstacles = [
        moved(item, places[item.name][0]) if item.name in places else item
        for item in record.scene if item.name != FLOOR
    ]  # fmt: skip
    return Scene(obstacles, floor_height=record.scene.floor_height)


def moved(obstacle: Obstacle, place: FloatArray) -> Obstacle:
    """The obstacle at a position and yaw (4,) [m, rad]."""
    turn = rotation_from_yaw(float(place[3] - _place(obstacle)[3])) @ obstacle.rotation
    return Obstacle(obstacle.name, obstacle.shape, turn, place[:3])


def _operations(record: RunRecord) -> list[Mapping[str, Any]]:
    return (record.summary.get("operations") or {}).get("list", [])


def _taken(record: RunRecord) -> Iterator[tuple[str, Obstacle]]:
    """Objects of a scene that an operation takes up."""
    names = {there["name"] for item in _operations(record) for there in item["objects"]}
    return ((item.name, item) for item in record.scene or () if item.name in names)


def _place(obstacle: Obstacle) -> FloatArray:
    """(4,) position [m] and direction of the obstacle's x axis seen from above [rad]."""
    ahead = obstacle.rotation[:, 0]
    return np.append(obstacle.translation, np.arctan2(ahead[1], ahead[0]))


def _held(
    body: BodyModel, motion: Motion, item: Mapping[str, Any], before: FloatArray, after: FloatArray,
    samples: NDArray[np.int64],
) -> FloatArray:  # fmt: skip
    """Places (k, 4) in the hands at those of the samples before the object is set down."""
    first, last = np.searchsorted(motion.time, (item["start_s"], item["end_s"]))
    grid = np.linspace(first, min(last, len(motion.time) - 1), LOOKED_AT).astype(np.int64)
    # Where the object is in the frame of the hands when they begin to move it.
    begin = _hands(body, motion, grid[:1])[0]
    offset = before - begin
    offset[:3] = rotation_from_yaw(-float(begin[3])) @ offset[:3]
    away = np.linalg.norm((_carried(_hands(body, motion, grid), offset) - after)[:, :3], axis=1)
    until = grid[int(np.argmin(away))]
    return _carried(_hands(body, motion, samples[samples <= until]), offset)


def _carried(hands: FloatArray, offset: FloatArray) -> FloatArray:
    """Places (n, 4) of what is at an offset (4,) in the frame of the hands (n, 4)."""
    cos, sin = np.cos(hands[:, 3]), np.sin(hands[:, 3])
    x, y, z, turn = offset
    same = np.ones(len(hands))
    return hands + np.column_stack([cos * x - sin * y, sin * x + cos * y, z * same, turn * same])


def _hands(body: BodyModel, motion: Motion, samples: NDArray[np.int64]) -> FloatArray:
    """(n, 4) middle of the palms [m] and direction across the line between them [rad]."""
    places = np.empty((len(samples), 2, 3))
    for row, sample in enumerate(samples):
        state = Configuration(body, motion.q[sample])
        for column, hand in enumerate(HANDS):
            places[row, column] = state.effector_placement(hand)[1]
    across = places[:, 0] - places[:, 1]
    return np.column_stack([places.mean(axis=1), np.unwrap(np.arctan2(-across[:, 0], across[:, 1]))])
