"""Gait cycles of a recorded person, normalised to 0 to 100 %, and what a gait laboratory measures of them.

A cycle lasts from one touch-down of a foot to its next. Events are those of force plates where a plate saw
them, else those of the supports found. Curves are interpolated at :data:`PERCENT` of the cycle; cycles of a
side have a mean and a standard deviation at each.

* *Angles* of the hinges of hip, knee and ankle [deg], zero in standing: flexion, abduction and dorsiflexion
  are positive.
* *Moments* are internal, those that muscles and ligaments give, per body mass [N.m/kg]: what extends hip and
  knee, bends the foot down and abducts the hip is positive. In a cycle whose whole stance is on a plate that
  carries nothing else they follow from its forces, else from those that the motion needs.
* *Powers* of the same hinges [W/kg]: positive where muscles give energy.

The *length* of a step is the distance of a foot from the other one at touch-down along the way of the pelvis
between their touch-downs, its *width* the distance to the side. The *symmetry index* of two sides is the
right minus the left per their mean [%] (Robinson, Herzog and Nigg, J. Manipulative Physiol. Ther. 10, 1987).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body.segments import SIDES
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.recordings.supports.body_supports import RecordedSupports, Support
from manikin.recordings.supports.supports import TimingError

PERCENT = np.arange(101.0)
"""Instants of a cycle [%]."""

ANGLES = {
    "hip_flexion_deg": ("hip_flexion", 1.0), "hip_abduction_deg": ("hip_abduction", 1.0),
    "hip_rotation_deg": ("hip_rotation", 1.0), "knee_flexion_deg": ("knee_flexion", 1.0),
    "ankle_dorsiflexion_deg": ("ankle_dorsiflexion", 1.0),
}  # fmt: skip
MOMENTS = {
    "hip_extension_Nm_per_kg": ("hip_flexion", -1.0), "hip_abduction_Nm_per_kg": ("hip_abduction", 1.0),
    "knee_extension_Nm_per_kg": ("knee_flexion", -1.0),
    "ankle_plantarflexion_Nm_per_kg": ("ankle_dorsiflexion", -1.0),
}  # fmt: skip
POWERS = {
    "hip_power_W_per_kg": ("hip_flexion", 1.0), "knee_power_W_per_kg": ("knee_flexion", 1.0),
    "ankle_power_W_per_kg": ("ankle_dorsiflexion", 1.0),
}  # fmt: skip
CURVES = (*ANGLES, *MOMENTS, *POWERS)
"""Curves of a cycle: the hinge behind each, and the sign with which it is shown."""

LONGEST = 3.0
"""Longer times between two touch-downs of a foot are no cycle [s]."""

LEAST_WAY = 0.1
"""Way of the pelvis in a step from which it has a direction [m]."""


@dataclass(frozen=True, eq=False)
class GaitCycle:
    """One cycle of one leg.

    Attributes:
        side: ``"left"`` or ``"right"``; instants are on the recording's clock [s].
        start: Touch-down of the foot; ``end`` is its next one, ``off`` its lift-off between them.
        other_off: Lift-off of the other foot after the start; None where it was not seen.
        other_on: Touch-down of the other foot.
        by_plate: Whether the moments follow from a plate under the foot.
        curves: (101,) values at :data:`PERCENT`, by the names of :data:`CURVES`.
    """

    side: str
    start: float
    end: float
    off: float
    other_off: float | None
    other_on: float
    by_plate: bool
    curves: Mapping[str, FloatArray]

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.start

    @property
    def stance(self) -> float:
        """Share of the cycle in which the foot carries [%]."""
        return 100.0 * (self.off - self.start) / self.duration

    @property
    def double_support(self) -> float | None:
        """Share of the cycle in which both feet carry [%], 0 in a run; None where it is not known."""
        if self.other_off is None:
            return None
        first, second = max(self.other_off - self.start, 0.0), max(self.off - self.other_on, 0.0)
        return 100.0 * (first + second) / self.duration


@dataclass(frozen=True)
class Step:
    """From a touch-down of the other foot to one of this side: duration [s], length and width [m]."""

    side: str
    duration: float
    length: float
    width: float


@dataclass(frozen=True, eq=False)
class GaitReport:
    """Cycles and steps of a recording, in order of time."""

    cycles: tuple[GaitCycle, ...]
    steps: tuple[Step, ...]

    def of(self, side: str) -> tuple[GaitCycle, ...]:
        """Cycles of one leg."""
        return tuple(one for one in self.cycles if one.side == side)

    @cached_property
    def curves(self) -> dict[str, dict[str, tuple[FloatArray, FloatArray | None]]]:
        """(101,) mean and standard deviation by side and curve; the latter is None of a single cycle."""
        found = {}
        for side in SIDES:
            if cycles := self.of(side):
                every = {name: np.array([one.curves[name] for one in cycles]) for name in CURVES}
                found[side] = {
                    name: (values.mean(axis=0), values.std(axis=0, ddof=1) if len(values) > 1 else None)
                    for name, values in every.items()
                }
        return found

    @property
    def cadence(self) -> float | None:
        """Steps per minute; None without a step."""
        return 60.0 / float(np.mean([one.duration for one in self.steps])) if self.steps else None

    @property
    def speed(self) -> float | None:
        """Length of the steps per time [m/s]; None without a step."""
        time = sum(one.duration for one in self.steps)
        return sum(one.length for one in self.steps) / time if self.steps else None

    def measures(self, side: str) -> dict[str, list[float]]:
        """Values of each cycle or step of a side, by name and unit."""
        cycles, steps = self.of(side), [one for one in self.steps if one.side == side]
        double = [one.double_support for one in cycles]
        return {
            "stride_time_s": [one.duration for one in cycles],
            "stance_percent": [one.stance for one in cycles],
            "swing_percent": [100.0 - one.stance for one in cycles],
            "double_support_percent": [one for one in double if one is not None],
            "step_time_s": [one.duration for one in steps], "step_length_m": [one.length for one in steps],
            "step_width_m": [one.width for one in steps],
            "knee_range_deg": [float(np.ptp(one.curves["knee_flexion_deg"])) for one in cycles],
            "hip_range_deg": [float(np.ptp(one.curves["hip_flexion_deg"])) for one in cycles],
            "ankle_range_deg": [float(np.ptp(one.curves["ankle_dorsiflexion_deg"])) for one in cycles],
        }  # fmt: skip

    @property
    def symmetry(self) -> dict[str, float]:
        """Symmetry index of the means of each measure that both sides have [%]."""
        left, right = (self.measures(side) for side in SIDES)
        found = {}
        for name in left:
            if name != "step_width_m" and left[name] and right[name]:
                one, other = float(np.mean(left[name])), float(np.mean(right[name]))
                if one + other > 0.0:
                    found[name] = 200.0 * (other - one) / (one + other)
        return found

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers; curves at 0, 1, ... 100 % of the cycle."""
        return {
            "cadence_per_min": self.cadence, "speed_mps": self.speed, "steps": len(self.steps),
            "cycles": [
                {"side": one.side, "start_s": one.start, "end_s": one.end, "foot_off_percent": one.stance,
                 "moments_by": "plate" if one.by_plate else "motion"}
                for one in self.cycles
            ],
            "sides": {
                side: {name: _spread(values) for name, values in self.measures(side).items() if values}
                for side in SIDES
            },
            "symmetry_percent": self.symmetry,
            "curves": {
                side: {
                    name: {"mean": _rounded(mean), "sd": _rounded(sd)} for name, (mean, sd) in each.items()
                }
                for side, each in self.curves.items()
            },
        }  # fmt: skip


def _spread(values: Sequence[float]) -> dict[str, Any]:
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return {"mean": float(np.mean(values)), "sd": deviation, "count": len(values)}


def _rounded(values: FloatArray | None) -> list[float] | None:
    return None if values is None else np.round(values, 4).tolist()


@dataclass(frozen=True, eq=False)
class LegLoads:
    """Joint torques by force plates.

    Attributes:
        tau: (n, nv) generalised forces with the plates' forces on the feet [N, N.m].
        alone: (n,) by effector, whether it stands on a plate that carries nothing else.
    """

    tau: FloatArray
    alone: Mapping[str, NDArray[np.bool_]]


def gait_report(
    supports: RecordedSupports, motion: Motion, mass: float, timing: Sequence[TimingError] = (),
    loads: LegLoads | None = None,
) -> GaitReport:  # fmt: skip
    """Cut a walk, a run or a climb of stairs into gait cycles.

    Args:
        supports: Those found.
        motion: The motion with its torques, its time 0 at the start of the supports.
        mass: Of the person [kg].
        timing: Events that plates saw, which replace those found.
        loads: Torques by plates, used in cycles whose stance is on a plate of its own; None without plates.
    """
    feet = _by_plates(supports, timing)
    cycles = tuple(sorted(_cycles(feet, supports.start, motion, mass, loads), key=lambda one: one.start))
    return GaitReport(cycles, tuple(_steps(feet, supports.start, motion)))


@dataclass(frozen=True, eq=False)
class _Stance:
    """A support of a foot, with the instants of plates where they saw them."""

    side: str
    start: float
    end: float
    support: Support


def _by_plates(supports: RecordedSupports, timing: Sequence[TimingError]) -> list[_Stance]:
    known = {(one.effector, one.event, round(one.time + one.error, 6)): one.time for one in timing}
    found = []
    for side in SIDES:
        name = f"{side}_foot"
        for one in supports.of(name):
            start = known.get((name, "touch-down", round(one.start, 6)), one.start)
            end = known.get((name, "lift-off", round(one.end, 6)), one.end)
            found.append(_Stance(side, start, end, one))
    return sorted(found, key=lambda one: one.start)


def _cycles(
    feet: Sequence[_Stance], clock: float, motion: Motion, mass: float, loads: LegLoads | None
) -> Iterator[GaitCycle]:
    """Cycles of both sides: one touch-down of the other foot lies in each."""
    for side in SIDES:
        mine, others = ([one for one in feet if (one.side == side) is same] for same in (True, False))
        for first, second in pairwise(mine):
            start, end = first.start, second.start
            whole = first.support.start_seen and first.support.end_seen and second.support.start_seen
            landed = [one for one in others if start < one.start < end and one.support.start_seen]
            if not whole or len(landed) != 1 or not 0.0 < end - start < LONGEST:
                continue
            before = [one.end for one in others if one.start < start and one.support.end_seen]
            off = max(before, default=None)
            frames = (motion.time + clock >= first.start) & (motion.time + clock <= first.end)
            alone = loads is not None and f"{side}_foot" in loads.alone
            by_plate = alone and _mostly(loads.alone[f"{side}_foot"][frames])  # pyright: ignore
            tau = loads.tau if by_plate and loads is not None else motion.tau
            yield GaitCycle(
                side, start, end, first.end, off, landed[0].start, by_plate,
                _curves(side, motion, tau, mass, start - clock, end - clock),
            )  # fmt: skip


STANCE_ON_PLATE = 0.9
"""Share of a stance on a plate from which its forces are the whole load: instants err by some frames."""


def _mostly(values: NDArray[np.bool_]) -> bool:
    return bool(values.size and values.mean() >= STANCE_ON_PLATE)


def _curves(
    side: str, motion: Motion, tau: FloatArray, mass: float, start: float, end: float
) -> dict[str, FloatArray]:
    """(101,) angles [deg], moments [N.m/kg] and powers [W/kg] between two instants of the motion [s]."""
    instants, names = start + 0.01 * PERCENT * (end - start), list(motion.joint_names)

    def at(values: FloatArray, sign: float) -> FloatArray:
        return np.interp(instants, motion.time, sign * values)

    place = {hinge: names.index(f"{side}_{hinge}") for hinge, _ in ANGLES.values()}
    found = {
        name: at(np.degrees(motion.q[:, 7 + place[hinge]]), sign) for name, (hinge, sign) in ANGLES.items()
    }
    for name, (hinge, sign) in MOMENTS.items():
        found[name] = at(tau[:, 6 + place[hinge]] / mass, sign)
    for name, (hinge, sign) in POWERS.items():
        column = 6 + place[hinge]
        found[name] = at(tau[:, column] * motion.v[:, column] / mass, sign)
    return found


def _steps(feet: Sequence[_Stance], clock: float, motion: Motion) -> Iterator[Step]:
    """Steps between touch-downs of both feet that are seen, while the pelvis moves on."""
    for before, after in pairwise(feet):
        seen = before.support.start_seen and after.support.start_seen
        if before.side == after.side or not seen or not after.start > before.start:
            continue
        instants = np.array([before.start, after.start]) - clock
        way = np.diff([np.interp(instants, motion.time, motion.q[:, axis]) for axis in range(2)], axis=1)[
            :, 0
        ]
        if (size := float(np.linalg.norm(way))) < LEAST_WAY:
            continue
        ahead = way / size
        apart = (after.support.place - before.support.place)[:2]
        left = float(ahead[0] * apart[1] - ahead[1] * apart[0])
        width = left if after.side == "left" else -left
        yield Step(after.side, after.start - before.start, float(apart @ ahead), width)
