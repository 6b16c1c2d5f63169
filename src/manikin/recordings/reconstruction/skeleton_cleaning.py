"""Joints of a recorded skeleton that jump away and back: single wrong cells, and runs of them.

A skeleton has no other markers by which to judge a joint. What it has is a path: the step of a joint from one
frame to the next is near those before and after, but where limbs hit something. A step is a jump where it is
off its neighbours by many times what is usual for this joint in this recording. Frames between two jumps are
wrong if the steps around them lead across, and are filled; so are some between a jump and an end. A jump from
which the joint does not come back within a gap that is filled stays as recorded, and is told if it moves what
the joint carries.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.markers import LONGEST_GAP
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.cleaning import Repair

SMALLEST_TURN, SMALLEST_MOVE = 0.08, 0.02
"""Least part of a step of a joint [rad] and of the root [m] that is a jump."""

TURNING, MOVING = 500.0, 150.0
"""Accelerations of a joint [rad/s^2] and of the root [m/s^2] up to which nothing is a jump; our choice."""

USUAL_QUANTILE, TIMES_USUAL = 0.9, 8.0
"""Quantile of a joint's deviations from the steps around that is usual, and multiple that is a jump."""

AROUND = 3
"""Steps on either side of one that it is compared with."""

ACROSS, BACK = 0.5, 0.5
"""Share of a jump that steps across the frames left out may be off, and that has to lead back."""

FAR = 0.45
"""Jump [rad], [m] from which on frames at an end are filled, with what is next to it."""

MOVED = 0.1
"""Jump of the farthest joint that one carries from which on it is told where it stays as recorded [m]."""


def without_joint_jumps(recording: Recording) -> tuple[Recording, tuple[Repair, ...]]:
    """The recording with frames filled in which a joint or the root is elsewhere, and what was found."""
    if len(recording) <= 2 * AROUND:
        return recording, ()
    rotations, places = np.array(recording.rotations), np.array(recording.root_positions)
    found = list[Repair]()
    for joint, (name, levers) in enumerate(zip(recording.joint_names, _levers(recording), strict=True)):
        path = _JointPath(rotations[:, joint], levers)
        found += _cleaned(path, name, recording.rate)
        rotations[:, joint] = path.values
    found += _cleaned(_RootPath(places), recording.joint_names[0], recording.rate)
    if not found:
        return recording, ()
    ordered = tuple(sorted(found, key=lambda one: (one.first, one.stop)))
    return replace(recording, rotations=rotations, root_positions=places), ordered


def _levers(recording: Recording) -> list[FloatArray]:
    """(n,) distance of each joint from the farthest one that it carries [m]."""
    places, carried = recording.positions, [list[int]() for _ in recording.joint_names]
    for joint in range(len(carried) - 1, 0, -1):
        carried[recording.parents[joint]] += [joint, *carried[joint]]
    return [
        np.linalg.norm(places[:, below] - places[:, [joint]], axis=2).max(axis=1, initial=0.0)
        for joint, below in enumerate(carried)
    ]


class _JointPath:
    """(n, 3, 3) rotations of a joint, whose steps are rotation vectors in its own frame [rad]."""

    smallest, fastest = SMALLEST_TURN, TURNING

    def __init__(self, values: FloatArray, levers: FloatArray) -> None:
        self.values, self.levers = values, levers

    def steps(self, first: NDArray[np.int64], second: NDArray[np.int64]) -> FloatArray:
        """(k, 3) steps from frames to others."""
        before, after = Rotation.from_matrix(self.values[first]), Rotation.from_matrix(self.values[second])
        return (before.inv() * after).as_rotvec()

    def fill(self, first: int, stop: int) -> None:
        """Fill frames from those on either side of them."""
        sides = Rotation.from_matrix(self.values[[first - 1, stop]])
        self.values[first:stop] = Slerp([first - 1, stop], sides)(np.arange(first, stop)).as_matrix()


class _RootPath:
    """(n, 3) places of the root, whose steps are vectors [m]."""

    smallest, fastest = SMALLEST_MOVE, MOVING

    def __init__(self, values: FloatArray) -> None:
        self.values, self.levers = values, np.ones(len(values))

    def steps(self, first: NDArray[np.int64], second: NDArray[np.int64]) -> FloatArray:
        """(k, 3) steps from frames to others."""
        return self.values[second] - self.values[first]

    def fill(self, first: int, stop: int) -> None:
        """Fill frames from those on either side of them."""
        share = (np.arange(first, stop) - first + 1.0)[:, None] / (stop - first + 1.0)
        self.values[first:stop] = (1.0 - share) * self.values[first - 1] + share * self.values[stop]


def _cleaned(path: _JointPath | _RootPath, name: str, rate: float) -> list[Repair]:
    """Fill runs of a path's frames that lie between jumps, in place."""
    count, longest = len(path.values), max(int(LONGEST_GAP * rate), 1)
    every = np.arange(count)
    steps = path.steps(every[:-1], every[1:])
    usual = _usual_steps(steps)
    beyond = steps - usual
    off = np.linalg.norm(beyond, axis=1)
    usually = float(np.quantile(off, USUAL_QUANTILE))
    least = max(path.smallest, path.fastest / rate**2, TIMES_USUAL * usually)
    jumps, found = list(map(int, np.flatnonzero(off > least))), list[Repair]()
    while jumps:
        first = jumps.pop(0)
        stop = next(
            (last for last in jumps if _leads_across(path, usual, beyond, first, last, longest)), None
        )
        size = float(off[first])
        moved = size * float(path.levers[first])
        edge = longest if size > FAR else 0
        if stop is not None:  # frames between the two steps
            path.fill(first + 1, stop + 1)
            jumps = [one for one in jumps if one > stop]
            wrong = (first + 1, stop + 1)
        elif first < edge:
            path.values[: first + 1] = path.values[first + 1]
            wrong = (0, first + 1)
        elif count - 1 - first <= edge:
            path.values[first + 1 :] = path.values[first]
            jumps, wrong = [], (first + 1, count)
        elif moved > MOVED:
            found.append(Repair(name, "jump", first, first + 2, moved, "as recorded"))
            continue
        else:
            continue
        found.append(Repair(name, "spike", *wrong, moved, "filled"))
    return found


def _usual_steps(steps: FloatArray) -> FloatArray:
    """(n, 3) medians of the steps around each one."""
    padded = np.pad(steps, ((AROUND, AROUND), (0, 0)), constant_values=np.nan)
    near = [padded[k : k + len(steps)] for k in range(2 * AROUND + 1) if k != AROUND]
    return np.nanmedian(near, axis=0)


def _leads_across(
    path: _JointPath | _RootPath, usual: FloatArray, beyond: FloatArray, first: int, last: int, longest: int
) -> bool:
    """Whether the frames between two steps, there and back, may be left out."""
    size = min(float(np.linalg.norm(beyond[step])) for step in (first, last))
    if last - first > longest or float(beyond[first] @ beyond[last]) > -BACK * size**2:
        return False
    across = path.steps(np.array([first]), np.array([last + 1]))[0]
    expected = 0.5 * (last + 1 - first) * (usual[first] + usual[last])
    return float(np.linalg.norm(across - expected)) < ACROSS * size
