"""Pitch of a foot from the rise of its heel to its next flat landing.

The foot tilts about the hinge of its toes, which stay flat, until it leaves the ground; flies; lands on the
edge of its heel, or deep below on its flat toes, and tilts down onto its sole. One pitch, twice continuously
differentiable, covers all of it, so that the foot does not stop at lift-off or landing. Where the foot is
follows from the point about which it tilts: the hinge before lift-off, the heel's edge or the hinge after
landing, and in flight a point that moves from one to the other along the swing's curve. The angles and their
timing are our own choice.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BPoly

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import toe_hinge
from manikin.contact import ContactSchedule, SolePart, Swing
from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.swing_path import Pose

PUSH_OFF_PITCH, HEEL_STRIKE_PITCH = float(np.deg2rad(24.0)), float(np.deg2rad(10.0))
"""Pitch at lift-off on the level, heel up, and at landing on the heel, toes up [rad]."""

BALL_PITCH = float(np.deg2rad(20.0))
"""Pitch at landing on the ball of the foot, heel up [rad]."""

HIGHEST_PITCH, HIGH_STEP = float(np.deg2rad(48.0)), 0.22
"""Pitch at lift-off [rad] of a foot that is left behind on a step of this height over the stature, or below
one: with the heel down no leg bends far enough for the body to be over the lower foot, and none is long
enough for it to be over the higher one."""

LEAST_PITCH = 1.0e-3
"""Least pitch of a foot on its toes [rad]."""

MOST_EXTENSION = float(np.deg2rad(64.0))
"""Extension of the toes in flight, their range being 70 degrees [rad]."""

PIVOT_SHIFT = (0.2, 0.85)
"""Shares of the flight between which the point that the curve describes moves from hinge to heel: while
the heel is up the toes are the lowest, while the toes are up the heel is."""


@dataclass(frozen=True, eq=False)
class FootRoll:
    """Pitch of one foot about one flight.

    Attributes:
        instants: (4,) heel up, lift-off, landing, sole flat [s].
        start: Pose of the sole before, lying flat.
        end: Pose of the sole afterwards, lying flat.
        hinge: (3,) hinge of the toes in the sole's frame [m].
        heel: (3,) middle of the heel's edge in the sole's frame [m].
        push_off: Pitch at lift-off, heel up [rad].
        touch: Pitch at landing, on the toes when positive, on the heel when negative [rad].
        toes_back: Share of the flight after which the toes are straight again.
        landing_rate: Pitch rate at landing, as a share of the mean one until the sole lies flat.
    """

    instants: FloatArray
    start: Pose
    end: Pose
    hinge: FloatArray
    heel: FloatArray
    push_off: float = PUSH_OFF_PITCH
    touch: float = -HEEL_STRIKE_PITCH
    toes_back: float = 0.6
    landing_rate: float = 1.0

    @property
    def pivots(self) -> tuple[Pose, Pose]:
        """Poses of the points about which the foot tilts before the flight and after it."""
        return (
            Pose(self.start.position + self.start.rotation @ self.hinge, self.start.rotation),
            Pose(self.end.position + self.end.rotation @ self._last_pivot, self.end.rotation),
        )

    @property
    def _last_pivot(self) -> FloatArray:
        return self.hinge if self.touch > 0.0 else self.heel

    def pitch(self, time: FloatArray) -> FloatArray:
        """(n,) turn of the foot about its own y axis, heel up when positive [rad]."""
        return _held(self._pitch, self.instants[[0, 3]], time)

    def toe_extension(self, time: FloatArray) -> FloatArray:
        """(n,) angle of the toes that keeps them flat where they touch, back to 0 in flight [rad]."""
        curve = self._toe_return
        flat = (time < curve.x[0]) | ((time > curve.x[-1]) & (self.touch > 0.0))
        return np.where(flat, self.pitch(time), _held(curve, curve.x[[0, -1]], time))

    def pose(
        self, position: FloatArray, rotation: FloatArray, time: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3) and rotations (n, 3, 3) of the sole's frame.

        Args:
            position: (n, 3) of the pivot in the world [m].
            rotation: (n, 3, 3) of the sole without its pitch.
            time: (n,) [s].
        """
        turn, offset = self.tilt(time)
        return position - np.einsum("nij,nj->ni", rotation, offset), rotation @ turn

    def tilt(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Turns (n, 3, 3) by the pitch, and the pivot (n, 3) seen from the sole's origin before them [m]."""
        angle = self.pitch(time)
        turn = np.zeros((len(time), 3, 3))
        turn[:, 0, 0] = turn[:, 2, 2] = np.cos(angle)
        turn[:, 0, 2], turn[:, 2, 0] = np.sin(angle), -np.sin(angle)
        turn[:, 1, 1] = 1.0
        _, off, land, _ = self.instants
        first, last = PIVOT_SHIFT
        share = np.clip(((time - off) / (land - off) - first) / (last - first), 0.0, 1.0)[:, None]
        blend = least_jerk(share)[0]
        pivot = (1.0 - blend) * self.hinge + blend * self._last_pivot
        return turn, np.einsum("nij,nj->ni", turn, pivot)

    @property
    def _at_lift_off(self) -> list[float]:
        up, off, land, _ = self.instants
        angle = self.push_off if off > up else 0.0
        # The pitch rate at lift-off is 1.2 times the mean since the heel rose; less where toes would extend
        # beyond their range as the pitch goes on to rise, by 0.085 rad per rad of rate times flight.
        rate = min(1.2 * angle / max(off - up, 1e-9), (MOST_EXTENSION - angle) / (0.085 * (land - off)))
        return [angle, rate, 0.0]

    @cached_property
    def _toe_return(self) -> BPoly:
        _, off, land, flat = self.instants
        back = off + self.toes_back * (land - off)
        knots = {off: self._at_lift_off, back: [0.0] * 3}
        if flat > land and self.touch > 0.0:
            knots[land] = self._at_landing
        return BPoly.from_derivatives(list(knots), list(knots.values()))

    @property
    def _at_landing(self) -> list[float]:
        """Pitch at landing, and its rate."""
        _, _, land, flat = self.instants
        angle = self.touch if flat > land else 0.0
        return [angle, -self.landing_rate * angle / max(flat - land, 1e-9), 0.0]

    @cached_property
    def _pitch(self) -> BPoly:
        up, off, land, flat = self.instants
        knots = {up: [0.0] * 3, off: self._at_lift_off, land: self._at_landing, flat: [0.0] * 3}
        return BPoly.from_derivatives(list(knots), list(knots.values()))


Rolls = Sequence[tuple[str, FootRoll]]
"""Effector and roll of flights of feet that do not leave and land flat."""


def foot_roll(body: BodyModel, schedule: ContactSchedule, swing: Swing) -> FootRoll | None:
    """Roll of a flight between two soles, or None when the foot leaves and lands flat."""
    start, end = swing.start, swing.end
    if start is None or end is None or {start.part, end.part} == {SolePart.FULL}:
        return None
    toes = toe_hinge(body, swing.effector)
    off, land = schedule.swing_interval(swing)
    up = schedule.instants[swing.first_phase - 1] if start.part is SolePart.TOES else off
    flat = land if end.part is SolePart.FULL else schedule.instants[swing.last_phase + 2]
    others = schedule.sequence[swing.first_phase].stance
    other = max((float(contact.position[2]) for contact in others), default=float(end.position[2]))
    step = abs(float(start.position[2]) - other) / (HIGH_STEP * (body.stature or 1.75))
    return FootRoll(
        np.array([up, off, land, flat]), Pose.of(start), Pose.of(end), np.zeros(3) if toes is None else toes,
        np.array([-0.5 * (body.sole_length or start.length), 0.0, 0.0]),
        PUSH_OFF_PITCH + min(step, 1.0) * (HIGHEST_PITCH - PUSH_OFF_PITCH),
        BALL_PITCH if end.part is SolePart.TOES else -HEEL_STRIKE_PITCH,
    )  # fmt: skip


def rolls_through(
    body: BodyModel, schedule: ContactSchedule, postures: Callable[[float], FloatArray]
) -> Rolls:
    """Rolls of all flights of a schedule; feet leave and land on their toes with the pitch of a posture.

    Args:
        postures: (nq,) configuration at a time [s].
    """
    found = list[tuple[str, FootRoll]]()
    for swing in schedule.sequence.swings():
        roll = foot_roll(body, schedule, swing)
        if roll is None:
            continue
        up, off, land, flat = roll.instants.tolist()
        for key, time, pose, tilts in (
            ("push_off", off, roll.start, off > up), ("touch", land, roll.end, flat > land)
        ):  # fmt: skip
            if tilts:
                turned, _ = Configuration(body, postures(time)).effector_placement(swing.effector)
                turn = pose.rotation.T @ turned
                pitch = max(LEAST_PITCH, float(np.arctan2(turn[0, 2], turn[0, 0])))
                roll = replace(roll, **{key: pitch})
        found.append((swing.effector, roll))
    return found


def _held(curve: BPoly, ends: FloatArray, time: FloatArray) -> FloatArray:
    """Value of a curve, held beyond its ends."""
    return np.asarray(curve(np.clip(time, ends[0], ends[1])), dtype=np.float64)
