"""Records every control step of an execution and turns them into a motion and its measures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.balance.contact_forces import FrictionUse, friction_share
from manikin.balance.motion_margin import MotionMargin
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart, Stance
from manikin.control import ControlOutput, SupportMode
from manikin.control.dynamics import DynamicsState
from manikin.control.supports import SupportInterval, SupportState, support_intervals
from manikin.motion import Motion
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, cross
from manikin.simulation.carrying import (
    PRESSES,
    CarriedPoints,
    CarryingContacts,
    EngineStep,
    carried_margin,
)
from manikin.simulation.world import World

ROUNDING = 1e-9
"""Of times [s]."""

SWITCHING = 0.1
"""A support may touch its surface this long before and after its planned interval [s]."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One control step as it happened.

    Attributes:
        output: Decision of the controller there.
        planned: Contact that each effector has, or in flight the one to come or else the last.
        steps: Its engine steps, the first of which tells contact forces and accelerations at its beginning.
    """

    output: ControlOutput
    planned: Mapping[str, Contact]
    steps: tuple[EngineStep, ...]

    @property
    def time(self) -> float:
        """When it begins [s]."""
        return self.steps[0].time

    @property
    def plan_time(self) -> float:
        """Time of the plan [s], which may have waited for the body."""
        return self.time - self.output.waited


class Recorder:
    """Keeps every control step of an execution."""

    def __init__(self, schedule: ContactSchedule, segments: dict[str, tuple[str, ...]]) -> None:
        """Start empty, with the names of the segments with which each effector of the schedule touches."""
        self._schedule = schedule
        self._segments = segments
        self.effectors = schedule.sequence.effectors
        self.samples: list[Sample] = []
        self._intervals = {name: support_intervals(schedule, name, SWITCHING) for name in self.effectors}

    def record(self, output: ControlOutput, steps: tuple[EngineStep, ...]) -> None:
        """Add one control step: its decision and its engine steps."""
        time = steps[0].time - output.waited
        planned = {name: self._nearest_contact(name, time) for name in self.effectors}
        self.samples.append(Sample(output, planned, steps))

    def _nearest_contact(self, name: str, time: float) -> Contact:
        """Contact of an effector at ``time``; in flight, the one to come or else the last."""
        for interval in self._intervals[name]:
            if time < interval.end or near(interval, time):
                return interval.contact
        return self._intervals[name][-1].contact

    def max_slip(self) -> float:
        """Farthest that an effector moved along its surface while it was held there [m].

        Those that roll, slide to their places or begin to carry are not held.
        """
        times, most = np.array([sample.plan_time for sample in self.samples]), 0.0
        for name in self.effectors:
            supports = [sample.output.supports[name] for sample in self.samples]
            contacts = [one.contact if _holds(one) else None for one in supports]
            held = np.array([contact is not None for contact in contacts])
            held &= ~self._schedule.settling(times, name)
            for first, stop in mask_runs(held):
                moved = self._positions(name, first, stop)
                moved -= moved[0]
                normals = np.array(
                    [contact.normal for contact in contacts[first:stop] if contact is not None]
                )
                moved -= np.sum(moved * normals, axis=1)[:, None] * normals
                most = max(most, float(np.linalg.norm(moved, axis=1).max()))
        return most

    def _positions(self, name: str, first: int = 0, stop: int | None = None) -> FloatArray:
        """(n, 3) origin of an effector in some samples [m]."""
        return np.array([s.output.state.frames[name].position for s in self.samples[first:stop]])

    def friction_use(self) -> FrictionUse:
        """Largest use of friction by the forces that control counted on, in the model of the plan.

        Contacts that slide to their places are left out: kinetic friction is on the friction cone.
        """
        model = self._schedule.sequence[0].stance.friction_model
        loads: dict[Contact, list[tuple[int, str, FloatArray]]] = {}
        for number, sample in enumerate(self.samples):
            for name, wrench in sample.output.wrenches.items():
                support = sample.output.supports[name]
                contact = support.contact
                if contact is not None and not support.settling and contact.kind is not ContactKind.GRASP:
                    loads.setdefault(contact, []).append((number, name, wrench[:3]))
        most = FrictionUse(model, 0.0, 0.0, "")
        for contact, pressed in loads.items():
            shares = friction_share(contact, np.array([force for *_, force in pressed]), model)
            if shares.max() > most.share:
                number, name, _ = pressed[int(np.argmax(shares))]
                most = FrictionUse(model, float(shares.max()), self.samples[number].time, name)
        return most

    def com_errors(self) -> FloatArray:
        """(n,) distance of the CoM from its plan [m]."""
        return _lengths([s.output.state.com - s.output.reference.com for s in self.samples])

    def bound_samples(self) -> int:
        """Number of samples before the body sits down, after which its CoM need not follow a plan."""
        times = np.array([s.plan_time for s in self.samples])
        seated = [i.start for items in self._intervals.values() for i in items if i.contact.settle > 0.0]
        return int(np.sum(times < min(seated, default=np.inf)))

    def worst_effector(self) -> tuple[float, str, float]:
        """Largest distance of an effector's origin from its plan [m], its name and the time [s].

        Effectors that slide to their places on a seat do not count.
        """
        firm, errors = self._effector_errors(self.samples)
        if not len(errors):
            return 0.0, "", 0.0
        row, column = divmod(int(np.argmax(errors)), len(firm))
        return float(errors.max()), firm[column], self.samples[row].time

    def last_effector_error(self) -> float:
        """Largest distance of an effector's origin from its plan in the last step [m]; counted as above."""
        return float(self._effector_errors(self.samples[-1:])[1].max(initial=0.0))

    def _effector_errors(self, samples: Sequence[Sample]) -> tuple[list[str], FloatArray]:
        """Effectors none of whose contacts slide to their places, and their distances from the plan [m]."""
        sliding = {name for name, items in self._intervals.items() for item in items if item.contact.settle}
        firm = [name for name in self.effectors if name not in sliding]
        return firm, _lengths([
            s.output.state.frames[name].position - s.output.reference.effectors[name].position
            for s in samples for name in firm
        ])  # fmt: skip

    def delayed_schedule(self) -> ContactSchedule | None:
        """When the planned contacts were due; None where the plan never waited."""
        if not self.samples or self.samples[-1].output.waited == 0.0:
            return None
        waited, planned = np.array([(s.output.waited, s.plan_time) for s in self.samples]).T
        instants = self._schedule.instants
        late = waited[np.minimum(np.searchsorted(planned, instants), len(waited) - 1)]
        return ContactSchedule(self._schedule.sequence, instants + late)

    def margins(self, mass: float, world: World) -> MotionMargin:
        """Margins of the mean measured wrenches about the centre of mass, in the stances that really carry.

        See :mod:`manikin.simulation.carrying`: a late foot does not count, and one that is early does. The
        mass [kg] closes the polytope of a stance without force limits; the world is that of the steps.
        """
        carrying = CarryingContacts(self._segments, mass)
        wrenches, carried = world.loads([sample.steps for sample in self.samples])
        pairs = zip(self.samples, carried, strict=True)
        stances = [self._carrying_stance(carrying, *pair) for pair in pairs]
        return carried_margin(stances, wrenches, np.array([s.output.state.com for s in self.samples]))

    def _carrying_stance(self, carrying: CarryingContacts, sample: Sample, points: CarriedPoints) -> Stance:
        frames = sample.output.state.frames
        return carrying.stance(
            points, lambda name: (frames[name].position, frames[name].rotation), sample.planned,
            [name for name in self.effectors if name in sample.steps[0].grips],
            self._schedule.stance_at(sample.plan_time).model,
        )  # fmt: skip

    def _wrenches(self, world: World) -> FloatArray:
        """(n, effectors, 6) measured force and moment on each effector about its planned contact's origin."""
        first = [sample.steps[0] for sample in self.samples]
        owner, segments, places, forces = world.scene_forces(first)
        wrenches = np.zeros((len(first), len(self.effectors), 6))
        for column, name in enumerate(self.effectors):
            planned = [sample.planned[name] for sample in self.samples]
            about = np.array([contact.position for contact in planned])
            chosen = np.flatnonzero(np.isin(segments, self._segments[name]))
            rows, force = owner[chosen], forces[chosen]
            moment = cross(places[chosen] - about[rows], force)
            np.add.at(wrenches[:, column], rows, np.hstack([force, moment]))
            for row, contact in enumerate(planned):
                if contact.kind is ContactKind.GRASP:
                    force, place = first[row].grips.get(name, np.zeros((2, 3)))
                    moment = cross(place - contact.position, force)
                    wrenches[row, column] = np.concatenate((force, moment))
        return wrenches

    def motion(self, joint_names: Sequence[str], margin: FloatArray, world: World) -> Motion:
        """Turn the samples of a world into a motion with its margin (n,) [N.m]."""
        return executed_motion(
            np.round([s.time for s in self.samples], 9) + 0.0,  # the engine adds up its steps
            [s.output.state for s in self.samples], a=world.accelerations([s.steps[0] for s in self.samples]),
            tau=np.array([s.output.tau for s in self.samples]), margin=margin,
            contact_force=self._wrenches(world),
            contact_names=tuple(self.effectors), joint_names=tuple(joint_names),
        )  # fmt: skip


def executed_motion(
    time: FloatArray, states: Sequence[DynamicsState], *, tau: FloatArray, contact_force: FloatArray,
    **series: Any,
) -> Motion:  # fmt: skip
    """Motion of n states, (n, nv - 6) joint torques [N.m] and (n, contacts, 6) wrenches [N, N.m].

    A contact supports where it presses by more than :data:`PRESSES` times the mass; ``series`` are the other
    fields.
    """
    return Motion(
        time, q=np.array([state.q for state in states]), v=np.array([state.v for state in states]),
        tau=np.concatenate((np.zeros((len(tau), 6)), tau), axis=1),
        com=np.array([state.com for state in states]),
        angular_momentum=np.array([state.momentum[3:] for state in states]),
        support=np.linalg.norm(contact_force[..., :3], axis=-1) > PRESSES * states[0].mass,
        contact_force=contact_force,
        **series,
    )  # fmt: skip


def _holds(support: SupportState) -> bool:
    """Whether an effector carries fully with what does not roll."""
    part = None if support.contact is None else support.contact.part
    return support.mode is SupportMode.STANCE and support.load_share >= 1 and part is SolePart.FULL


def _lengths(vectors: list[FloatArray]) -> FloatArray:
    return np.sqrt(np.sum(np.square(np.array(vectors).reshape(-1, 3)), axis=1))


def near(interval: SupportInterval, time: float) -> bool:
    """Whether a support is planned at ``time`` [s] or has just been, or is about to be."""
    return interval.early - ROUNDING <= time <= interval.late + ROUNDING
