"""The outcome of a push: whether the body stands, and by which strategies it stayed on its feet."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import Configuration
from manikin.contact import Contact
from manikin.control.recovery import BalanceRecovery, JointGroups, Strategy, capture_point
from manikin.control.stepping import StepTaken
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import Displayed
from manikin.runtime.requirement import Requirement, RequirementTable
from manikin.simulation.carrying import Touch
from manikin.simulation.push_force import Push, push_impulse
from manikin.simulation.recovery_record import RecoveryTrace

STANDS_HEIGHT = 0.95
"""Least height of the CoM of a standing body, as a share of its first one [-]; kneeling has some 0.7."""

STANDS_LEAN = 0.3
"""Largest lean of the trunk of a standing body [rad]."""

STANDS_SPEED = 0.1
"""Largest speed of the centre of mass of a standing body [m/s]."""

FOOT_MOVED = 0.02
"""Largest motion of a foot without a step [m]."""

FOOT_SLID = 0.1
"""Largest slide of a foot after a step [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Recovery(Displayed):
    """Outcome of a push.

    Attributes:
        trace: Every control step.
        feet: ``"held"`` or ``"free"``.
        failure: Why it is no recovery, in one line; empty for one.
        direction: (2,) unit direction of the first push; zero without one.
        impulse: Of all pushes, a sine's without regard to its sign [N.s].
        zmp_excess: Farthest that the ZMP was outside the soles once the control acted [m].
        time_to_rest: From the first push until the body stands at rest to the end [s]; None if it does not.
        final_height: Of the centre of mass above the ground at the end [m].
        capture_point: Farthest reach of the capture point over the support area; 1 is its edge.
        foot_motion: Farthest that a foot is, in the end, from where it was put down [m].
        control_from: When the control acted first after the first push began [s].
        soles: Contacts of the feet that carry in the end.
        steps: Steps that were taken.
        wall: Wall time [s].
        requirements: Requirements on a body that stands in the end.
    """

    trace: RecoveryTrace
    feet: str
    failure: str
    direction: FloatArray
    impulse: float
    zmp_excess: float
    time_to_rest: float | None
    final_height: float
    capture_point: float
    foot_motion: float
    control_from: float
    soles: tuple[Contact, ...]
    steps: tuple[StepTaken, ...]
    wall: float
    requirements: RequirementTable

    @property
    def recovered(self) -> bool:
        """Whether the body stands at the end, at rest and upright, on its feet where they were."""
        return not self.failure

    def strategy_share(self, strategy: Strategy) -> float:
        """Share of the time, from the first reaction on, in which a strategy decided."""
        chosen = self.trace.strategies[self._reacting]
        return float(np.mean(chosen == str(strategy))) if len(chosen) else 0.0

    def turned(self, group: str) -> FloatArray:
        """(n,) angular momentum of a group [kg.m^2/s] about the axis of a fall the way of the push."""
        x, y = self.direction
        return self.trace.momentum[group] @ np.array([-y, x, 0.0])

    def momentum_shares(self) -> dict[str, float]:
        """Share of each group in the largest angular momentum after the first reaction; their sum is 1."""
        groups = {group: self.turned(group)[self._reacting] for group in self.trace.momentum}
        total = sum(groups.values(), np.zeros(int(self._reacting.sum())))
        if not np.any(total):
            return dict.fromkeys(groups, 0.0)
        peak = int(np.argmax(np.abs(total)))
        return {group: float(values[peak] / total[peak]) for group, values in groups.items()}

    @property
    def _reacting(self) -> np.ndarray:
        return self.trace.motion.time >= self.control_from - 1e-9

    def summary(self) -> dict[str, Any]:
        """The ``push`` block of a run's summary."""
        trace = self.trace
        peak = {group: float(np.abs(self.turned(group)).max()) for group in trace.momentum}
        return {
            "recovered": self.recovered, "steps": len(self.steps), "feet": self.feet,
            "impulse_Ns": self.impulse, "direction_deg": float(np.degrees(np.arctan2(*self.direction[::-1]))),
            "max_zmp_excess_m": self.zmp_excess, "final_com_height_m": self.final_height,
            "time_to_rest_s": self.time_to_rest, "max_capture_point_reach": self.capture_point,
            "max_foot_motion_m": self.foot_motion, "steps_taken": [step.summary() for step in self.steps],
            "posture_share": self.strategy_share(Strategy.POSTURE),
            "program_share": self.strategy_share(Strategy.PROGRAM),
            "angular_momentum_share": self.momentum_shares(), "peak_angular_momentum_Nms": peak,
            "work_J": {group: sum(trace.work(group)) for group in trace.power},
            "min_margin": float(trace.motion.margin.min()),
            "fallbacks": len(trace.fallbacks), "control_step_ms": trace.control_ms, "wall_s": self.wall,
        }  # fmt: skip


def judge(
    controller: BalanceRecovery, trace: RecoveryTrace, pushes: Sequence[Push], feet: str, fallen: str,
    touches: Sequence[Touch], wall: float, steps: tuple[StepTaken, ...] = (), refused: str = "",
) -> Recovery:  # fmt: skip
    """Outcome of a push.

    Args:
        feet: How its feet were on the ground.
        fallen: Why the run was ended before its time; empty when it was not.
        touches: Unplanned touches; those of the body with itself, as hand and thigh, are no support.
        wall: Wall time [s].
        refused: Why a step that was needed was not taken.
    """
    motion, standing = trace.motion, controller.standing
    ahead = capture_point(motion.com, trace.com_velocity, standing.height)
    start = min((push.start for push in pushes), default=0.0)
    control_from = start + controller.settings.delay
    level = [push.force[:2] for push in pushes if np.linalg.norm(push.force[:2]) > 0.0]
    rests_from = _rests_from(controller, trace)
    excess = -trace.zmp_inside
    counted = (motion.time >= control_from - 1e-9) & np.isfinite(excess)
    moved, most = _foot_motion(controller, motion, steps), FOOT_SLID if steps else FOOT_MOVED
    segments = {segment.name for segment in controller.body.segments}
    propped = [touch for touch in touches if touch.other not in segments]
    fault = fallen
    if not fault and propped:
        fault = f"does not stand on its feet alone: {propped[0]}"
    elif not fault and rests_from is None:
        fault = "does not stand at rest and upright at the end"
    elif not fault and moved > most:
        fault = f"a foot has moved by {moved:.3f} m"
    return Recovery(
        trace, feet, failure=_explained(fault, controller, trace, control_from, refused),
        direction=level[0] / float(np.linalg.norm(level[0])) if level else np.zeros(2),
        impulse=float(sum(push_impulse(push) for push in pushes)),
        zmp_excess=float(np.max(excess[counted], initial=0.0)),
        time_to_rest=None if rests_from is None else max(0.0, rests_from - start),
        final_height=float(motion.com[-1, 2] - standing.area.height),
        capture_point=max(s.area.reach(point) for s, point in zip(trace.standings, ahead, strict=True)),
        foot_motion=moved, control_from=control_from, soles=standing.soles, steps=steps, wall=wall,
        requirements=_requirements(motion, fallen, propped, rests_from, moved, most),
    )  # fmt: skip


def _requirements(
    motion: Motion, fallen: str, propped: Sequence[Touch], rests_from: float | None, moved: float, most: float
) -> RequirementTable:
    end, first = float(motion.time[-1]), propped[0] if propped else None
    at, where = (None, "") if first is None else (first.time, f"{first.segment} on {first.other}")
    return RequirementTable((
        Requirement("fell", "falls", "", float(bool(fallen)), "<=", 0.0, end if fallen else None),
        Requirement("unplanned_touches", "unplanned touches", "", float(len(propped)), "<=", 0.0, at, where),
        Requirement("at_rest", "stands at rest and upright at the end", "", float(rests_from is not None),
                    ">=", 1.0, end),
        Requirement("max_foot_motion_m", "a foot has moved by", "m", moved, "<=", most, end),
    ))  # fmt: skip


def trunk_lean(state: Configuration, groups: JointGroups) -> float:
    """Largest angle of a segment of the trunk, but the head, to the vertical [rad]."""
    names = [name for name in groups.segments["trunk"] if name not in ("head", "neck")]
    upright = min(float(state.segment_placement(name)[0][2, 2]) for name in names)
    return float(np.arccos(np.clip(upright, -1.0, 1.0)))


def at_rest(
    state: Configuration, controller: BalanceRecovery, q: FloatArray, com: FloatArray, velocity: FloatArray
) -> bool:
    """Whether a body stands at rest at ``q`` (nq,), where ``com`` (3,) [m] and its velocity (3,) [m/s] are.

    It is high, upright and slow, its centre of mass over its soles; ``state`` is moved to measure the trunk.
    """
    standing = controller.standing
    return bool(
        com[2] - standing.area.height >= STANDS_HEIGHT * standing.height
        and np.linalg.norm(velocity) <= STANDS_SPEED
        and standing.area.inside(com[:2]) > 0.0
        and trunk_lean(state.update(q), controller.groups) <= STANDS_LEAN
    )


def _rests_from(controller: BalanceRecovery, trace: RecoveryTrace) -> float | None:
    """Time from which the body stands at rest to the end [s]; None if it does not."""
    samples = zip(trace.motion.time, trace.motion.q, trace.motion.com, trace.com_velocity, strict=True)
    state, since = Configuration(controller.body), None
    for time, *sample in reversed(list(samples)):
        if not at_rest(state, controller, *sample):
            break
        since = float(time)
    return since


def _explained(
    fault: str, controller: BalanceRecovery, trace: RecoveryTrace, control_from: float, refused: str
) -> str:
    """The fault with the place of the capture point when the control began, if that was outside."""
    if not fault:
        return ""
    if refused:
        fault = f"{fault}; no step: {refused}"
    first = min(int(np.searchsorted(trace.motion.time, control_from - 1e-9)), len(trace.motion.time) - 1)
    point = capture_point(trace.motion.com[first], trace.com_velocity[first], controller.standing.height)
    outside = -float(trace.standings[0].area.inside(point))
    told = f"; the capture point was {outside:.3f} m beyond the soles when the control began"
    return fault + told * (outside > 0.0)


def _foot_motion(controller: BalanceRecovery, motion: Motion, steps: Sequence[StepTaken]) -> float:
    """Farthest that a foot is in the end from where it was put down, or where it was in the beginning [m]."""
    first, last = (Configuration(controller.body, motion.q[row]) for row in (0, -1))
    places = {sole.effector: first.effector_placement(sole.effector)[1] for sole in controller.standing.soles}
    places |= {step.foot: step.position for step in steps}
    moved = (last.effector_placement(name)[1] - place for name, place in places.items())
    return max(float(np.linalg.norm(way)) for way in moved)
