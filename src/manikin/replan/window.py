"""A part of a recording, in time."""

from dataclasses import replace

import numpy as np

from manikin.errors import InputError
from manikin.mocap import Reconstruction, RecordedSupports, Support, Targets

LEAST_FRAMES = 4
"""Frames of a part, at least: of fewer there are no accelerations."""


def window(
    found: Reconstruction, supports: RecordedSupports, start: float, end: float
) -> tuple[Reconstruction, RecordedSupports]:
    """Cut a reconstruction and its supports, so that the first instant left is 0 on both clocks.

    Args:
        found: The postures.
        supports: Found from all of them.
        start: On the clock of the supports [s].
        end: The last instant left [s].

    Raises:
        InputError: If fewer than four frames are left.
    """
    time = supports.start + found.time
    rows = np.flatnonzero((time >= start - 1e-9) & (time <= end + 1e-9))
    if len(rows) < LEAST_FRAMES:
        raise InputError(
            f"window from {start:g} to {end:g} s leaves {len(rows)} frames; valid: at least {LEAST_FRAMES} "
            f"between {time[0]:g} and {time[-1]:g} s"
        )
    begin, last, told = float(time[rows[0]]), float(time[rows[-1]]), found.targets
    seen = np.flatnonzero(np.any(np.isfinite(told.positions[rows, :, 0]), axis=0))
    targets = Targets(
        tuple(told.names[k] for k in seen), tuple(told.segments[k] for k in seen), told.points[seen],
        told.positions[np.ix_(rows, seen)], told.weights[seen],
    )  # fmt: skip
    part = replace(
        found, time=found.time[rows] - found.time[rows[0]], q=found.q[rows], targets=targets,
        residual=found.residual[np.ix_(rows, seen)], first_frame=found.first_frame + int(rows[0]),
    )  # fmt: skip
    held = tuple(
        _cut(support, begin, last)
        for support in supports.supports
        if support.start < last and support.end > begin
    )
    return part, RecordedSupports(held, 0.0, last - begin, supports.surfaces)


def _cut(support: Support, begin: float, last: float) -> Support:
    return replace(
        support, start=max(support.start - begin, 0.0), end=min(support.end, last) - begin,
        start_seen=support.start_seen and support.start >= begin,
        end_seen=support.end_seen and support.end <= last,
    )  # fmt: skip
