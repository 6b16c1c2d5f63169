"""The largest impulse from one direction that a standing body recovers from, and postures to be pushed in."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.control import recovery
from manikin.control.recovery import BalanceRecovery, RecoverySettings, joint_groups, sole_at
from manikin.errors import InputError
from manikin.kinematics import Placement, PostureProblem, com_target, generate_posture
from manikin.numerics.spatial import FloatArray, finite_number, rotation_from_yaw
from manikin.scene import Proximity, Scene
from manikin.simulation.push_force import STRONGEST, push_near_com
from manikin.simulation.recover import Feet, RecoveryTask, recover
from manikin.simulation.recovery import Recovery

RAISED = np.array([-0.1, 0.0, 0.12])
"""Displacement of a raised foot from its place on the ground [m]: behind and clear of it."""


def one_foot_posture(body: BodyModel, foot: str) -> FloatArray:
    """(nq,) posture of a body with two legs on one foot, the centre of mass over the middle of its sole.

    The foot stays where it is in the standing posture; no part of the body is in another.

    Raises:
        InputError: If the body has no such foot, or cannot stand like that.
    """
    feet = joint_groups(body).feet
    if foot not in feet:
        raise InputError(f"foot to stand on is {foot!r}; valid: {', '.join(feet)}")
    other = next(name for name in feet if name != foot)
    start = Configuration(body, body.standing_posture())
    contact = sole_at(body, foot, *start.effector_placement(foot), friction=1.0)
    rotation, place = start.effector_placement(other)
    problem = PostureProblem(
        body, (contact,), placements={other: Placement(place + RAISED, rotation)},
        com=com_target(*contact.position[:2]), proximity=Proximity(body, Scene([], floor_height=None)),
    )  # fmt: skip
    return _standing(problem, f"on the {foot!r}")


def feet_apart_posture(body: BodyModel, distance: float) -> FloatArray:
    """(nq,) posture on both feet of a body with two legs, the centre of mass between them.

    The middles of the soles are a distance [m] apart, sideways.

    Raises:
        InputError: If the soles would overlap, or the body cannot stand like that.
    """
    finite_number(distance, "distance between the feet [m]", at_least=0.0)
    start = Configuration(body, body.standing_posture())
    feet = joint_groups(body).feet
    placements = [start.effector_placement(foot) for foot in feet]
    middle = np.mean([place for _, place in placements], axis=0)
    soles = []
    for foot, (rotation, place) in zip(feet, placements, strict=True):
        side = np.array([place[0], middle[1] + 0.5 * distance * np.sign(place[1] - middle[1]), place[2]])
        soles.append(sole_at(body, foot, rotation, side, friction=1.0))
    width = max(float(np.ptp(sole.points_in_world[:, 1])) for sole in soles)
    finite_number(distance, "distance between the feet [m]", at_least=width)
    com = np.mean([sole.position[:2] for sole in soles], axis=0)
    problem = PostureProblem(body, tuple(soles), com=com_target(*com))
    return _standing(problem, f"with the feet {distance:g} m apart")


def _standing(problem: PostureProblem, how: str) -> FloatArray:
    posture = generate_posture(problem)
    if not posture.succeeded:
        raise InputError(f"body {problem.body.name!r} does not stand {how}: {posture.failure}")
    return posture.q


FIRST = 20.0
"""First impulse of a search [N.s]."""

PUSH_BEGINS = 0.2
"""Time at which pushes begin [s], as in the scenarios after the thesis."""

AFTERWARDS = 5.2
"""Time from the end of a push to the end of its run [s], by which a body has recovered or has not."""

AT_REST = 0.5
"""Time at rest after which a trial is taken as held until it is confirmed [s]."""


@dataclass(frozen=True, eq=False)
class PushTrials:
    """One body in one stance, to be pushed again and again from different directions.

    Attributes:
        task: Its stance; the pushes and the duration are those of each trial.
        settings: Settings of the controller.
        push_duration: Duration of every push [s]; its force is the impulse divided by this.
        begins: Beginning of the push [s].
    """

    body: BodyModel
    task: RecoveryTask = field(default_factory=lambda: RecoveryTask(()))
    settings: RecoverySettings = field(default_factory=RecoverySettings)
    push_duration: float = 0.1
    begins: float = PUSH_BEGINS

    def __post_init__(self) -> None:
        finite_number(self.push_duration, "push duration [s]", above=0.0, at_most=60.0)
        finite_number(self.begins, "push start [s]", at_least=0.0)

    @property
    def strongest(self) -> float:
        """Largest impulse that a push may have [N.s]."""
        return STRONGEST * self.push_duration

    def soles(self) -> tuple[FloatArray, ...]:
        """(4, 2) corners of each sole from the centre of mass, x ahead [m]."""
        standing = self._controller().standing
        return tuple(sole.points_in_world[:, :2] - standing.com[:2] for sole in standing.soles)

    def bound(self, directions_deg: Sequence[float]) -> tuple[float, ...] | None:
        """(n,) upper bounds of the impulse held without a step [N.s], by direction as of :meth:`push` [deg].

        Those of :func:`~manikin.control.recovery.edge_limits`; None for feet that are held.
        """
        if self.task.feet is Feet.HELD:
            return None
        limits = recovery.edge_limits(self._controller(), self._posture, self.push_duration)
        return tuple(recovery.held_impulse(limits, math.radians(direction)) for direction in directions_deg)

    @property
    def _posture(self) -> ArrayLike:
        return self.body.standing_posture() if self.task.q is None else self.task.q

    def _controller(self) -> BalanceRecovery:
        support, friction = self.task.support, self.task.friction
        return BalanceRecovery(self.body, self._posture, self.settings, support=support, friction=friction)

    def push(self, direction_deg: float, impulse: float, *, until_at_rest: float | None = None) -> Recovery:
        """Push once.

        Args:
            direction_deg: Direction of the force, counter-clockwise from the body's forward axis [deg].
            impulse: [N.s].
            until_at_rest: End the run early, see :class:`~manikin.simulation.recover.RecoveryTask`.

        Raises:
            InputError: If the push is too strong or the body does not stand.
        """
        axis = rotation_from_yaw(math.radians(direction_deg))[:, 0]
        force = min(impulse / self.push_duration, STRONGEST) * axis
        push = push_near_com(self.body, force, self.begins, self.push_duration, q=self.task.q)
        duration = run_duration(self.push_duration, self.begins)
        task = replace(self.task, pushes=(push,), duration=duration, until_at_rest=until_at_rest)
        return recover(self.body, task, self.settings)


def run_duration(push_duration: float, begins: float = PUSH_BEGINS) -> float:
    """Duration of the run of a push [s]: 5.5 s for one of 0.1 s."""
    return round(begins + push_duration + AFTERWARDS, 9)


@dataclass(frozen=True)
class HeldImpulse:
    """The two impulses between which a body ceases to recover.

    Attributes:
        held: Largest impulse found that it recovers from [N.s]; None where it falls without any push.
        beyond: Smallest impulse found that it does not recover from [N.s]; None where there is none.
        trials: Number of pushes that were simulated.
    """

    held: float | None
    beyond: float | None
    trials: int = 0


def largest_held(
    holds: Callable[[float], bool], *, tolerance: float, strongest: float = math.inf
) -> HeldImpulse:
    """Search the largest impulse that is held, by bisection.

    The first impulse is doubled until one is not held, or halved until one is, and the gap then bisected. A
    body may fall from a push and recover from a harder one, for which it swings its arms in time: the result
    is *one* border between an impulse that was held and a larger one that was not; both were tried.

    Args:
        holds: Whether an impulse [N.s] is held.
        tolerance: Largest gap between the two impulses [N.s].
        strongest: Largest impulse that is tried [N.s].

    Raises:
        InputError: If the tolerance is not positive.
    """
    finite_number(tolerance, "tolerance [N.s]", above=0.0)
    trials: list[float] = []

    def tried(impulse: float) -> bool:
        trials.append(impulse)
        return holds(impulse)

    held, beyond = _bracket(tried, tolerance, strongest)
    while held is not None and beyond is not None and beyond - held > tolerance:
        middle = 0.5 * (held + beyond)
        if tried(middle):
            held = middle
        else:
            beyond = middle
    return HeldImpulse(held, beyond, len(trials))


def _bracket(
    holds: Callable[[float], bool], tolerance: float, strongest: float
) -> tuple[float | None, float | None]:
    """An impulse that is held and one that is not, each None if there is none."""
    impulse = min(FIRST, strongest)
    if holds(impulse):
        while impulse < strongest:
            larger = min(2.0 * impulse, strongest)
            if not holds(larger):
                return impulse, larger
            impulse = larger
        return impulse, None
    while impulse > tolerance:
        if holds(0.5 * impulse):
            return 0.5 * impulse, impulse
        impulse *= 0.5
    return (0.0 if holds(0.0) else None), impulse


@dataclass(frozen=True, eq=False)
class DirectionSearch:
    """Search of the largest impulse held from one direction; it can be sent to another process.

    Attributes:
        trials: The body and its pushes.
        direction_deg: Direction of the force, counter-clockwise from the body's forward axis [deg].
        tolerance: Largest gap between an impulse that is held and one that is not [N.s].
    """

    trials: PushTrials
    direction_deg: float
    tolerance: float = 1.0

    def run(self) -> HeldImpulse:
        """Search.

        Trials end once the body has stood at rest for a while. The final impulse is confirmed by a run to its
        end; if the body falls there, the search is repeated with such runs alone.
        """
        quick = self._search(AT_REST)
        if not quick.held:
            return quick
        if self.trials.push(self.direction_deg, quick.held).recovered:
            return replace(quick, trials=quick.trials + 1)
        whole = self._search(None)
        return replace(whole, trials=whole.trials + quick.trials + 1)

    def _search(self, until_at_rest: float | None) -> HeldImpulse:
        def holds(impulse: float) -> bool:
            return self.trials.push(self.direction_deg, impulse, until_at_rest=until_at_rest).recovered

        return largest_held(holds, tolerance=self.tolerance, strongest=self.trials.strongest)
