"""Footprints of a whole-body walk: where its feet stand, and when."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pinocchio as pin

from manikin.errors import InputError
from manikin.locomotion.follow import Walk
from manikin.locomotion.footprints import Footprint, Footprints
from manikin.locomotion.stepper import SIDE, StepRule, within_reach
from manikin.spatial import FloatArray


def walked_footprints(walk: Walk, rule: StepRule | None = None, *, height: float = 0.0) -> Footprints:
    """Footprints of a walk from the library of recorded ones, to be planned and executed on.

    Each is where the foot is in the middle of its support, relative to how far behind the path both feet
    stand at the start: the path is that of the middle between the feet, as for :func:`place_footprints`.
    Recorded feet turn in and come close to each other in a way that soles and legs of other sizes cannot:
    every footprint is moved to the nearest place that the rule allows beside the other foot. Where one foot
    lands in the frame in which the other one leaves, both stand for one frame.

    Args:
        walk: From standing to standing.
        rule: Of it, where a foot may be set down beside the other one.
        height: Of the floor [m].

    Raises:
        InputError: If the walk has a moment without a foot on the floor, or does not begin and end on both.
    """
    rule = StepRule() if rule is None else rule
    flying = np.flatnonzero(~walk.support.any(axis=1))
    if flying.size:
        raise InputError(
            f"walk has no foot on the floor at {walk.time[flying[0]]:.2f} s; valid here: a slower one"
        )
    held = sorted(
        (one for foot in range(len(walk.feet)) for one in _supports(walk, foot)),
        key=lambda one: (one.lands, one.effector),
    )
    return Footprints(list(_reachable(_overlapping(held, walk), rule, height)))


def _supports(walk: Walk, foot: int) -> Iterator[Footprint]:
    """Of one foot, as the walk has them, shifted so that the walk begins with its feet about its path."""
    behind = np.mean([_sole(walk, each, 0)[:2] for each in range(len(walk.feet))], axis=0) - walk.place[0, :2]
    standing = np.flatnonzero(walk.support[:, foot])
    for rows in np.split(standing, 1 + np.flatnonzero(np.diff(standing) > 1)):
        middle = int(rows[len(rows) // 2])
        x, y, yaw = _sole(walk, foot, middle)
        turn = np.exp(1j * (walk.place[middle, 2] - walk.place[0, 2])) * complex(*behind)
        lands, leaves = walk.time[[rows[0], min(rows[-1] + 1, len(walk.time) - 1)]].tolist()
        yield Footprint(walk.feet[foot], [x - turn.real, y - turn.imag, 0.0], yaw, lands, leaves)


def _sole(walk: Walk, foot: int, row: int) -> tuple[float, float, float]:
    """Middle of a sole, x, y [m], and its yaw [rad] in a frame of the walk."""
    body, name = walk.body, walk.feet[foot]
    data, frame = body.pinocchio.createData(), body.effector_frame(name)
    pin.forwardKinematics(body.pinocchio, data, walk.q[row])
    there = pin.updateFramePlacement(body.pinocchio, data, frame)
    x, y = there.translation[:2].tolist()
    return x, y, math.atan2(there.rotation[1, 0], there.rotation[0, 0])


def _overlapping(held: Sequence[Footprint], walk: Walk) -> Iterator[Footprint]:
    """The same, each foot leaving at least one frame after the next landing of the other one."""
    frame = float(walk.time[1] - walk.time[0])
    for step in held:
        landings = [one.lands for one in held if one.effector != step.effector and one.lands > step.lands]
        leaves = step.leaves
        if landings and abs(landings[0] - leaves) < frame / 2:
            leaves += frame
        yield Footprint(step.effector, step.position, step.yaw, step.lands, leaves)


def _reachable(held: Iterator[Footprint], rule: StepRule, height: float) -> Iterator[Footprint]:
    """The same where the rule allows a foot beside the other one, on the floor."""
    places: dict[str, FloatArray] = {}
    for step in held:
        place = np.append(step.position[:2], step.yaw)
        for other in (places[foot] for foot in SIDE if foot != step.effector and foot in places):
            place = within_reach(place, other, SIDE[step.effector], rule)
        places[step.effector] = place
        yield Footprint(step.effector, [*place[:2], height], float(place[2]), step.lands, step.leaves)
