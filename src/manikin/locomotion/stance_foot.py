"""Feet that do not slide: where they stand, how they get there, and the legs that follow by inverse kinematics.

The thesis leaves this open (6.8). Blended cycles let the standing foot slide, for their steps do not quite fit
the blended velocity.  Here a foot has one place on the floor from landing to toe-off, over which it rolls
from heel to ball; in the swing the correction goes over, smoothly, from that of one step to that of the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.locomotion.foot_placement import FootPlacement, Sole
from manikin.locomotion.gait import GaitFrames
from manikin.locomotion.leg_kinematics import LegKinematics
from manikin.mocap.anatomy import SIDES
from manikin.spatial import FloatArray

FLAT = np.deg2rad(4.0)
"""A standing foot pitched by less than this is put flat, more or less [rad]."""

EASE = 0.2
"""Share of the swing in which a foot leaves, and in which it reaches, the floor."""

LIFT = 0.15
"""A foot is lifted by at least this share of the distance by which its step is corrected."""


@dataclass(frozen=True, eq=False)
class Footing:
    """The two feet of a gait at n instants.

    Attributes:
        wanted: Of each foot, as the gait has it.
        swing: (2, n) how far they have swung, -1 while they stand.
    """

    wanted: tuple[FootPlacement, FootPlacement]
    swing: FloatArray


def smooth_step(share: FloatArray) -> FloatArray:
    """From 0 to 1 with no slope and no curvature at the ends; outside of them constant."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


class Legs:
    """Both legs of a body: feet from postures, and postures from feet."""

    def __init__(self, body: BodyModel) -> None:
        """Take lengths and soles from a human."""
        self.body = body
        self.legs = tuple(LegKinematics(body, side) for side in SIDES)
        self.soles = tuple(Sole.of_body(body, side) for side in SIDES)
        self.toes = tuple(body.joint_index(f"{side}_toe_extension") for side in SIDES)
        assert body.sole_length is not None
        self.toe_length = self.soles[0].heel + body.sole_length - self.soles[0].ball

    def feet(self, frames: GaitFrames) -> tuple[FootPlacement, FootPlacement]:
        """Where the gait has the left and the right foot."""
        left, right = (
            FootPlacement.of_foot(sole, *leg.foot(frames.pelvis, frames.place, frames.angles[:, leg.slots]))
            for leg, sole in zip(self.legs, self.soles, strict=True)
        )
        return left, right

    def footing(self, frames: GaitFrames) -> Footing:
        """Feet of a gait and whether they stand."""
        return Footing(self.feet(frames), frames.swing())

    def lack(self, frames: GaitFrames, feet: Sequence[FootPlacement]) -> FloatArray:
        """(n,) by how much the pelvis must sink for both legs to reach their feet [m]."""
        needed = np.zeros(len(frames.place))
        for leg, sole, foot in zip(self.legs, self.soles, feet, strict=True):
            hip = frames.place + frames.pelvis @ leg.hip
            ankle = foot.to_foot(sole)[1]
            flat = np.sum((hip - ankle)[:, :2] ** 2, axis=1)
            highest = ankle[:, 2] + np.sqrt(np.maximum(leg.length**2 - flat, 0.0))
            needed = np.maximum(needed, hip[:, 2] - highest)
        return needed

    def reached(
        self, frames: GaitFrames, feet: Sequence[FootPlacement], sink: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Place of the pelvis (n, 3) and angles (n, h) with the feet where they shall be.

        Args:
            frames: Of the gait.
            feet: Where the left and the right foot shall be.
            sink: (n,) how much lower the pelvis is than the gait has it [m].
        """
        place = frames.place - sink[:, None] * [0.0, 0.0, 1.0]
        angles = frames.angles.copy()
        for leg, sole, foot, toe in zip(self.legs, self.soles, feet, self.toes, strict=True):
            turn, ankle = foot.to_foot(sole)
            angles[:, leg.slots] = leg.angles(frames.pelvis, place, turn, ankle, angles[:, leg.slots[4]])
            # Toes stay above the floor while the heel is up.
            free = np.arcsin(np.clip(foot.clearance / self.toe_length, 0.0, 1.0))
            angles[:, toe] = np.clip(foot.pitch - free, 0.0, self.body.upper[toe])
        return place, angles


def corrected(
    wanted: FootPlacement, swing: FloatArray, offset: FloatArray, distance: FloatArray
) -> FootPlacement:
    """A foot moved by its correction, on the floor where it stands.

    Args:
        wanted: (n,) as the gait has it.
        swing: (n,) how far it has swung, -1 while it stands.
        offset: (n, 3) x, y [m] and yaw [rad] to add.
        distance: (n,) by how much the whole step is corrected [m].
    """
    standing = swing < 0.0
    up = np.where(standing, 0.0, smooth_step(swing / EASE) * smooth_step((1.0 - swing) / EASE))
    flat = wanted.pitch - FLAT * np.tanh(wanted.pitch / FLAT)
    return FootPlacement(
        point=wanted.point + offset[:, :2],
        yaw=wanted.yaw + offset[:, 2],
        pitch=up * wanted.pitch + (1.0 - up) * flat,
        roll=up * wanted.roll,
        clearance=up * (np.maximum(wanted.clearance, 0.0) + LIFT * distance),
    )


def pose(foot: FootPlacement) -> FloatArray:
    """(n, 3) x, y [m] and continuous yaw [rad]."""
    return np.column_stack([foot.point, np.unwrap(foot.yaw)])


def put_in_place(wanted: FootPlacement, swing: FloatArray) -> FootPlacement:
    """One foot of a whole walk: in every stance at the mean of where the gait has it.

    In the first stance it is where it was at the start, in the last one where it comes to rest.

    Args:
        wanted: (n,) as the gait has it.
        swing: (n,) how far it has swung, -1 while it stands.
    """
    path, n = pose(wanted), len(swing)
    standing = swing < 0.0
    borders = [0, *(np.flatnonzero(np.diff(standing.astype(np.int8))) + 1).tolist(), n]
    offset, distance = np.zeros((n, 3)), np.zeros(n)
    spans = list(zip(borders[:-1], borders[1:], strict=True))
    for first, last in spans:
        if standing[first]:
            anchor = path[0] if first == 0 else path[-1] if last == n else path[first:last].mean(axis=0)
            offset[first:last] = anchor - path[first:last]
    for first, last in spans:
        if not standing[first]:
            before = offset[first - 1] if first else np.zeros(3)
            after = offset[last] if last < n else np.zeros(3)
            share = smooth_step(swing[first:last])[:, None]
            offset[first:last] = (1.0 - share) * before + share * after
            distance[first:last] = np.hypot(*(after - before)[:2])
    return corrected(wanted, swing, offset, distance)
