"""Scores of RULA and REBA over a motion; its joint torques compared with strength, and their effort."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.ergonomics import rula_reba
from manikin.ergonomics.body_parts import Bearing, bearing_of
from manikin.ergonomics.postural_angles import PosturalAngles, postural_angles
from manikin.ergonomics.rula_reba import Circumstances, Scores
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number


@dataclass(frozen=True, eq=False)
class CumulativeEffort:
    """Effort of each joint, (j,) each, from frame to frame with the trapezoidal rule.

    Attributes:
        squared_share: Integral of the square of torque per strength [s].
        positive_work: Integral of the power that the joint gives [J].
        negative_work: Integral of the power that it takes up, negative [J].
        duration: Time over which torques are known [s].
    """

    joint_names: tuple[str, ...]
    squared_share: FloatArray
    positive_work: FloatArray
    negative_work: FloatArray
    duration: float

    @property
    def absolute_work(self) -> FloatArray:
        """(j,) integral of the size of the power [J]."""
        return self.positive_work - self.negative_work

    @property
    def mean_share(self) -> float:
        """Root of the mean square of torque per strength, over all joints and the time."""
        known = self.duration != 0.0
        return float(np.sqrt(self.squared_share.mean() / self.duration)) if known else 0.0


def cumulative_effort(body: BodyModel, motion: Motion) -> CumulativeEffort | None:
    """Add up what the joints do, with the torque limits of the body, in frames with torques.

    None if there are not two of these, or the body has no joint.
    """
    rows = known_torques(motion)
    if not len(body.joint_names) or rows.sum() < 2:
        return None
    weight = durations(motion.time, rows[1:] & rows[:-1])[rows]
    torque = motion.tau[rows, 6:]
    power = torque * motion.v[rows, 6:]
    return CumulativeEffort(
        joint_names=body.joint_names, squared_share=weight @ body.torque_share(torque) ** 2,
        positive_work=weight @ np.maximum(power, 0.0), negative_work=weight @ np.minimum(power, 0.0),
        duration=float(weight.sum()),
    )  # fmt: skip


LOADED = 0.5
"""Share of the strength above which a joint counts as loaded."""

SOURCES = {
    "human": "published isometric strength by joint and direction of a healthy adult of that sex, age and "
    "size (Anderson et al. 2007, Harbo et al. 2012 and others); no dependence on angle or speed",
    "kudoh": "ours, symmetric; the thesis prints none",
}
"""Where the torque limits of a body come from, by its name."""


@dataclass(frozen=True, eq=False)
class JointStrength:
    """Torques of a motion against the torque limits of its body.

    Attributes:
        limit: (j,) size of the torque limit in the direction in which the largest share is reached [N.m].
        share: (n, j) torque over the limit in its direction; NaN where the torque is not known.
        peak, peak_time: (j,) largest share, and when it is reached [s].
        loaded: (j,) share of the time above ``fraction``, from which on a joint counts as loaded.
        known: Share of the frames with torques.
        source: Where the limits come from.
    """

    joint_names: tuple[str, ...]
    limit: FloatArray
    share: FloatArray
    peak: FloatArray
    peak_time: FloatArray
    loaded: FloatArray
    fraction: float
    known: float
    source: str

    @property
    def order(self) -> list[int]:
        """Joints from the largest peak to the smallest."""
        return [int(index) for index in np.argsort(-self.peak, kind="stable")]

    @property
    def largest(self) -> FloatArray:
        """(n,) largest share of any joint; NaN where torques are not known."""
        return self.share.max(axis=1)


def joint_strength(body: BodyModel, motion: Motion, fraction: float = LOADED) -> JointStrength | None:
    """Compare torques with the limits of the body; None without a frame with torques, or without joints.

    Raises:
        InputError: If the fraction is not from 0 to 1.
    """
    finite_number(fraction, "fraction of the strength", at_least=0.0, at_most=1.0)
    rows = known_torques(motion)
    if not len(body.joint_names) or not rows.any():
        return None
    share = np.full((len(motion.time), len(body.joint_names)), np.nan)
    share[rows] = body.torque_share(motion.tau[rows, 6:])
    known = share[rows]
    peak = known.argmax(axis=0)
    pushed = motion.tau[rows, 6:][peak, np.arange(len(peak))] >= 0.0
    weight = durations(motion.time)[rows]
    return JointStrength(
        joint_names=body.joint_names, limit=np.where(pushed, body.torque_upper, -body.torque_lower),
        share=share, peak=known.max(axis=0), peak_time=motion.time[rows][peak],
        loaded=weight @ (known > fraction) / weight.sum(), fraction=fraction, known=float(rows.mean()),
        source=SOURCES.get(body.name, "the torque limits of the body"),
    )  # fmt: skip


def known_torques(motion: Motion) -> np.ndarray:
    """(n,) whether the torques of all joints are known; those of a recording may not be."""
    return np.asarray(np.isfinite(motion.tau).all(axis=1))


def durations(time: FloatArray, counted: NDArray[np.bool_] | bool = True) -> FloatArray:
    """(n,) time that each sample stands for, half of the steps (n - 1,) that count [s]; 1 for one sample."""
    if len(time) == 1:
        return np.ones(1)
    steps = np.diff(time) * counted
    return 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))


LONG = 60.0
"""A posture held for longer than this is static [s] ([McAtamney1993]_, [Hignett2000]_)."""
STILL = np.deg2rad(10.0)
"""A posture is held as long as no angle leaves a band of this width [rad]; ours."""
RATE = 5.0
"""Rate at which postures are compared [Hz]."""


def held(time: FloatArray, angles: FloatArray, duration: float = LONG) -> NDArray[np.bool_] | None:
    """(n,) whether each frame belongs to a posture that is held for long; None of a motion that is too short.

    Args:
        time: (n,) increasing [s].
        angles: (n, k), each of which stays in a band of the width :data:`STILL` [rad].
        duration: Shortest time that counts [s].
    """
    if time[-1] - time[0] < duration:
        return None
    even = np.arange(time[0], time[-1] + 0.5 / RATE, 1.0 / RATE)
    even_angles = np.column_stack([np.interp(even, time, column) for column in angles.T])
    size = round(duration * RATE) + 1  # samples of a window that begins and ends on one
    if size > len(even):
        return None
    middle = slice(size // 2, size // 2 + len(even) - size + 1)
    spread = maximum_filter1d(even_angles, size, axis=0) - minimum_filter1d(even_angles, size, axis=0)
    inside = np.zeros(len(even), dtype=bool)
    for start in np.flatnonzero(np.all(spread[middle] <= STILL, axis=1)):
        inside[start : start + size] = True
    return inside[np.clip(np.rint((time - even[0]) * RATE).astype(int), 0, len(even) - 1)]


@dataclass(frozen=True, eq=False)
class Assessment:
    """One score over time, (n,) [s].

    Attributes:
        method: ``"RULA"`` or ``"REBA"``.
        sides, steps: (n,) scores, and step scores, of the left and the right side.
        levels: Meaning of the action levels, the lowest first.
        level_of: Action level of scores.
        static_known: Whether the motion lasted long enough for a posture held for a minute.
    """

    method: str
    time: FloatArray
    sides: Mapping[str, Scores]
    steps: Mapping[str, Any]
    levels: Mapping[int, str]
    level_of: Callable[[ArrayLike], Scores]
    static_known: bool

    @property
    def score(self) -> Scores:
        """(n,) of the worse side."""
        return np.maximum(self.sides["left"], self.sides["right"])

    @property
    def level(self) -> Scores:
        """(n,) action level of the worse side."""
        return self.level_of(self.score)

    def as_dict(self) -> dict[str, Any]:
        """Plain values: the worst and mean score, the time at each level, and the worst posture's steps."""
        score, levels, weight = self.score, self.level, durations(self.time)
        worst, share = int(score.argmax()), weight / weight.sum()
        side = max(SIDES, key=lambda name: self.sides[name][worst])
        return {
            "max": int(score.max()), "max_at_s": float(self.time[worst]), "max_side": side,
            "max_steps": {name: int(values[worst]) for name, values in vars(self.steps[side]).items()},
            "mean": float(share @ score), "left_max": int(self.sides["left"].max()),
            "right_max": int(self.sides["right"].max()), "action_level": int(levels.max()),
            "action": self.levels[int(levels.max())],
            "share_of_time": {str(level): float(share[levels == level].sum()) for level in self.levels},
            "static_known": self.static_known,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class PosturalAssessment:
    """Assessment of postures alone, by RULA, 1 to 7, and REBA, 1 to 15."""

    angles: PosturalAngles
    bearing: Bearing
    rula: Assessment
    reba: Assessment


def assess_posture(body: BodyModel, motion: Motion, given: Circumstances | None = None) -> PosturalAssessment:
    """Score every frame by RULA and by REBA, both sides of the body.

    Static muscle work is found where the motion lasts longer than a minute: of an arm, and of trunk, neck and
    legs, each by itself. Of a shorter motion :attr:`Circumstances.static` says it.

    Raises:
        BodyError: If the body is no human.
    """
    circumstances = given or Circumstances()
    angles = postural_angles(body, motion.q, np.deg2rad(circumstances.neck_upright_deg))
    bearing = bearing_of(body, motion)
    body_held = held(motion.time, angles.trunk_and_legs())
    arms_held = {side: held(motion.time, angles.arm(side)) for side in SIDES}
    known = body_held is not None
    given_static = np.asarray(circumstances.static)
    judged = angles, bearing, circumstances
    in_rula, in_reba = rula_reba.rula_steps(*judged), rula_reba.reba_steps(*judged)
    load, rula, reba = (circumstances.load_kg, circumstances.load_pattern), {}, {}
    for side in SIDES:
        trunk, arm = (given_static if x is None else x for x in (body_held, arms_held[side]))
        rula[side] = rula_reba.rula_score(
            in_rula[side], muscle_arm=arm | circumstances.repeated,
            muscle_body=trunk | circumstances.repeated, force=rula_reba.rula_force(*load),
        )  # fmt: skip
        reba[side] = rula_reba.reba_score(
            in_reba[side], load=rula_reba.reba_load(*load),
            coupling=rula_reba.COUPLINGS.index(circumstances.coupling),
            activity=(trunk | arm).astype(int) + circumstances.repeated + circumstances.rapid,
        )  # fmt: skip
    rula_levels, reba_levels = rula_reba.rula_action_level, rula_reba.reba_action_level
    return PosturalAssessment(
        angles, bearing,
        Assessment("RULA", motion.time, rula, in_rula, rula_reba.ACTIONS, rula_levels, known),
        Assessment("REBA", motion.time, reba, in_reba, rula_reba.RISKS, reba_levels, known),
    )  # fmt: skip
