"""Joint angles of two runs at the key instants that both have."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.comparison.timing import TimingRow
from manikin.motion import Motion
from manikin.spatial import FloatArray

LARGEST = 5
"""Joints named per key instant."""


@dataclass(frozen=True)
class JointDifference:
    """One joint at one key instant.

    Attributes:
        joint: Name of the hinge.
        first_deg: Angle in the first run [deg].
        second_deg: Angle in the second run [deg].
    """

    joint: str
    first_deg: float
    second_deg: float

    @property
    def difference_deg(self) -> float:
        """Second less first [deg]."""
        return self.second_deg - self.first_deg

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "joint": self.joint, "first_deg": self.first_deg, "second_deg": self.second_deg,
            "difference_deg": self.difference_deg,
        }  # fmt: skip


@dataclass(frozen=True)
class PostureDifference:
    """Two postures at matching key instants.

    Attributes:
        first_s: Key instant of the first run [s].
        second_s: Key instant of the second run [s].
        rms_deg: Root mean square over all common joints [deg].
        largest: The joints that differ most, the largest first.
    """

    first_s: float
    second_s: float
    rms_deg: float
    largest: tuple[JointDifference, ...]

    def as_dict(self) -> dict[str, Any]:
        """One entry of the ``postures`` block of the JSON."""
        return {
            "first_s": self.first_s, "second_s": self.second_s, "rms_deg": self.rms_deg,
            "largest": [joint.as_dict() for joint in self.largest],
        }  # fmt: skip


def key_instants(rows: Sequence[TimingRow]) -> list[tuple[float, float]]:
    """Key instants of both runs [s]: the start of each matched phase, and its end where the next differs."""
    found: list[tuple[float, float]] = []
    for row in rows:
        if row.first is None or row.second is None:
            continue
        start = row.first.start_s, row.second.start_s
        if not found or found[-1] != start:
            found.append(start)
        found.append((row.first.end_s, row.second.end_s))
    return found


def posture_differences(
    rows: Sequence[TimingRow], first: Motion, second: Motion
) -> tuple[PostureDifference, ...]:
    """Compare the angles of the joints that both bodies have, at every matching key instant.

    Args:
        rows: Aligned phases.
        first: Motion of the first run.
        second: Motion of the second run.
    """
    common = [name for name in first.joint_names if name in second.joint_names]
    if not common:
        return ()
    places = [[7 + motion.joint_names.index(name) for name in common] for motion in (first, second)]
    return tuple(
        _difference(common, times, _angles(first, places[0], times[0]), _angles(second, places[1], times[1]))
        for times in key_instants(rows)
    )


def uncommon_joints(first: Motion, second: Motion) -> tuple[str, ...]:
    """Joints that only one of the two bodies has."""
    return tuple(sorted(set(first.joint_names) ^ set(second.joint_names)))


def _angles(motion: Motion, places: list[int], time: float) -> FloatArray:
    """(joints,) angles at the sample nearest to ``time`` [deg]."""
    return np.rad2deg(motion.q[int(np.argmin(np.abs(motion.time - time)))][places])


def _difference(
    names: list[str], times: tuple[float, float], first: FloatArray, second: FloatArray
) -> PostureDifference:
    gap = second - first
    order = np.argsort(-np.abs(gap), kind="stable")[:LARGEST]
    largest = tuple(JointDifference(names[i], float(first[i]), float(second[i])) for i in order)
    return PostureDifference(times[0], times[1], float(np.sqrt(np.mean(gap**2))), largest)
