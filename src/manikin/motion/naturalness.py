"""Naturalness: how many postures of a motion are as near to recorded ones as those of other people are.

A posture is the directions of trunk, shoulders, hips, thighs, legs, upper arms and forearms, seen in the
heading of the hips.  Its distance to another one is the root mean square over the eleven directions of their
differences, about the angles between them.  The package has the middles of groups of postures of recorded
people who stand, walk, turn, climb over and duck under things, sit, crouch, crawl and lift, each one mirrored
as well.  A posture is natural if the nearest of them is no farther than it is for 95 % of the postures of
recordings of which none was used.  Made by ``docs/naturalness.py``; the measure is our own.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, unit

FILE = Path(__file__).with_name("human_postures.npz")
"""File of the shipped postures."""

RATE = 50.0
"""Postures of a motion that are looked at [Hz]."""

PARTS = (
    "trunk", "shoulders", "hips", "left_thigh", "right_thigh", "left_leg", "right_leg", "left_upper_arm",
    "right_upper_arm", "left_forearm", "right_forearm",
)  # fmt: skip
"""Parts of which a posture has the directions."""

_ENDS = {
    "thigh": ("thigh", "leg"), "leg": ("leg", "foot"), "upper_arm": ("upper_arm", "forearm"),
    "forearm": ("forearm", "hand"),
}  # fmt: skip
"""Segments from whose origin to whose a part points."""


@dataclass(frozen=True)
class Naturalness:
    """Share of the postures of a motion that are near those of recorded people.

    Attributes:
        share: Of the postures at :data:`RATE`.
        limit: Distance up to which a posture is near them [rad].
        median: Of the distances; of recordings of which no posture was used it is about 0.11 [rad].
        worst: Largest distance of a posture [rad].
        worst_at: When [s].
        worst_part: Part that differs most there from the nearest recorded posture.
    """

    share: float
    limit: float
    median: float
    worst: float
    worst_at: float
    worst_part: str

    def summary(self) -> dict[str, float | str]:
        """Its block of a run's summary."""
        return {
            "share": self.share, "limit_rad": self.limit, "median_rad": self.median, "worst_rad": self.worst,
            "worst_at_s": self.worst_at, "worst_part": self.worst_part,
        }  # fmt: skip


def measure_naturalness(body: BodyModel, motion: Motion) -> Naturalness | None:
    """Naturalness of a motion of a person, planned or executed; None of other bodies."""
    if body.stature is None:
        return None
    time = np.arange(motion.time[0], motion.time[-1], 1.0 / RATE)
    rows = np.minimum(np.searchsorted(motion.time, time), len(motion.time) - 1)
    return naturalness_of(body, motion.time[rows], motion.q[rows])


def naturalness_of(body: BodyModel, time: FloatArray, postures: FloatArray) -> Naturalness:
    """Naturalness of a person's postures (n, nq) at times (n,) [s]."""
    directions = part_directions(body, postures)
    known, limit = recorded_postures()
    away, nearest = known.query(directions.reshape(len(postures), -1))
    off, worst = away / np.sqrt(len(PARTS)), int(np.argmax(away))
    apart = np.linalg.norm(known.data[nearest[worst]].reshape(-1, 3) - directions[worst], axis=1)
    return Naturalness(
        float(np.mean(off <= limit)), limit, float(np.median(off)), float(off[worst]), float(time[worst]),
        PARTS[int(np.argmax(apart))],
    )  # fmt: skip


@cache
def recorded_postures() -> tuple[cKDTree, float]:
    """Middles of groups of recorded postures, (k, 33) directions of :data:`PARTS`, and the limit [rad]."""
    with np.load(FILE, allow_pickle=False) as archive:
        middles, limit = archive["middles"].astype(np.float64), float(archive["limit"])
    return cKDTree(np.concatenate([middles, mirrored(middles)])), limit


def part_directions(body: BodyModel, postures: FloatArray) -> FloatArray:
    """(n, 11, 3) unit directions of :data:`PARTS` of postures (n, nq), in the heading of the hips.

    The trunk's points up, from the middle of the hips to that of the shoulders; those of shoulders and hips
    point to the left, the others to the far end.
    """
    data, model = body.pinocchio.createData(), body.pinocchio
    ends = [name for pair in _ENDS.values() for name in pair]
    names = [f"{side}_{name}" for side in ("left", "right") for name in dict.fromkeys(ends)]
    frames = [body.segment_frame(name) for name in names]
    places = np.empty((len(postures), len(names), 3))
    for row, q in zip(places, postures, strict=True):
        pin.framesForwardKinematics(model, data, q)
        row[:] = [data.oMf[frame].translation for frame in frames]
    return directions_of({name: places[:, k] for k, name in enumerate(names)})


def directions_of(origins: dict[str, FloatArray]) -> FloatArray:
    """(n, 11, 3) directions from origins (n, 3) of thighs, legs, feet, upper arms, forearms, hands [m]."""
    hips, shoulders = ((origins[f"left_{name}"], origins[f"right_{name}"]) for name in ("thigh", "upper_arm"))
    found = [
        unit(0.5 * (shoulders[0] + shoulders[1]) - 0.5 * (hips[0] + hips[1])),
        unit(shoulders[0] - shoulders[1]), unit(hips[0] - hips[1]),
    ]  # fmt: skip
    found += [
        unit(origins[f"{side}_{last}"] - origins[f"{side}_{first}"])
        for first, last in _ENDS.values() for side in ("left", "right")
    ]  # fmt: skip
    left = unit(found[2][:, :2])
    turn = np.zeros((len(left), 3, 3))  # rows: ahead, left, up
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, :2], turn[:, 2, 2] = left[:, 1], -left[:, 0], left, 1.0
    return np.einsum("nij,npj->npi", turn, np.stack(found, axis=1))


def mirrored(postures: FloatArray) -> FloatArray:
    """(k, 33) postures with left and right exchanged."""
    rows = postures.reshape(len(postures), len(PARTS), 3) * [1.0, -1.0, 1.0]
    order = [0, 1, 2] + [k + (1 if k % 2 else -1) for k in range(3, len(PARTS))]
    rows = rows[:, order]
    rows[:, 1:3] *= -1.0  # still to the left
    return rows.reshape(len(postures), -1)
