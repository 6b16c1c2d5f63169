"""Collects what happens during an execution and turns it into a motion and its measures."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from manikin.balance import wrench_polytope
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart, Stance
from manikin.control import ControlOutput, SupportMode
from manikin.control.supports import SupportInterval, support_intervals
from manikin.motion import Motion
from manikin.simulation.world import Sensed
from manikin.spatial import FloatArray

SWITCHING = 0.1
"""A support may touch its surface this long before and after its planned interval [s]."""

EARLY_SEAT = 0.03
"""What is made at speed may press this long before its time: a soft seat gives way, and its surface is
met where it is [s]."""

_PRESSES = 1.0
"""Force from which an effector counts as a support of the executed motion [N]."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One control step as it happened.

    Attributes:
        sensed: Contact forces and acceleration at the beginning of the step.
        output: What the controller decided there.
        wrenches: (effectors, 6) measured force and moment about the planned contact's origin.
        total: (6,) mean over the step of the wrench of all contacts about the world origin.
    """

    sensed: Sensed
    output: ControlOutput
    wrenches: FloatArray
    total: FloatArray

    @property
    def plan_time(self) -> float:
        """Time of the plan [s], which may have waited for the body."""
        return self.sensed.time - self.output.waited


class Recorder:
    """Keeps every control step of an execution."""

    def __init__(self, schedule: ContactSchedule, segments: dict[str, tuple[str, ...]]) -> None:
        """Start empty.

        Args:
            schedule: Planned contacts.
            segments: Names of the segments with which each effector of the schedule touches.
        """
        self._schedule = schedule
        self._segments = segments
        self.effectors = schedule.sequence.effectors
        self.samples: list[Sample] = []
        self.fallbacks: list[tuple[float, str]] = []
        self._intervals = {name: support_intervals(schedule, name, SWITCHING) for name in self.effectors}
        self._landings: dict[str, FloatArray | None] = dict.fromkeys(self.effectors)
        self.max_slip = 0.0

    def record(self, sensed: Sensed, output: ControlOutput, total: FloatArray) -> None:
        """Add one control step.

        Args:
            sensed: What was felt in its first engine step.
            output: What the controller decided.
            total: (6,) mean wrench of all contacts over the whole step.
        """
        plan_time = sensed.time - output.waited
        wrenches = np.array([self._wrench(name, sensed, plan_time) for name in self.effectors])
        self.samples.append(Sample(sensed, output, wrenches, total))
        if output.fallback:
            self.fallbacks.append((sensed.time, output.fallback))
        for name in self.effectors:
            self._measure_slip(name, output, plan_time)

    def _wrench(self, name: str, sensed: Sensed, plan_time: float) -> FloatArray:
        contact = self._nearest_contact(name, plan_time)
        if contact.kind is ContactKind.GRASP:
            return sensed.grip_wrench(name, contact.position)
        return sensed.wrench(contact.position, self._segments[name])

    def _nearest_contact(self, name: str, time: float) -> Contact:
        """Contact of an effector at ``time``; in flight, the one to come or else the last."""
        for interval in self._intervals[name]:
            if time < interval.end or near(interval, time):
                return interval.contact
        return self._intervals[name][-1].contact

    def _measure_slip(self, name: str, output: ControlOutput, time: float) -> None:
        support, position = output.supports[name], output.state.frames[name].position
        held = support.mode is SupportMode.STANCE and support.load_share >= 1
        rolls = support.contact is not None and support.contact.part is not SolePart.FULL
        if not held or support.contact is None or rolls or self._schedule.settling(time, name)[0]:
            self._landings[name] = None
            return
        landing = self._landings[name]
        if landing is None:
            self._landings[name] = position
            return
        moved = position - landing
        along = moved - (moved @ support.contact.normal) * support.contact.normal
        self.max_slip = max(self.max_slip, float(np.linalg.norm(along)))

    # --- measures --------------------------------------------------------------------------

    def com_errors(self) -> FloatArray:
        """(n,) distance of the CoM from its plan [m]."""
        return _lengths([s.output.state.com - s.output.reference.com for s in self.samples])

    def bound_samples(self) -> int:
        """Number of samples before the body sits down, after which its CoM need not follow a plan."""
        times = np.array([s.plan_time for s in self.samples])
        seated = [
            item.start for found in self._intervals.values() for item in found if item.contact.settle > 0.0
        ]
        return int(np.sum(times < min(seated, default=np.inf)))

    def worst_effector(self) -> tuple[float, str, float]:
        """Largest distance of an effector's origin from its plan [m], its name and the time [s].

        What slides to its place on a seat does not count.
        """
        firm = self._firm()
        errors = _lengths(
            [
                s.output.state.frames[name].position - s.output.reference.effectors[name].position
                for s in self.samples
                for name in firm
            ]
        )
        if not len(errors):
            return 0.0, "", 0.0
        row, column = divmod(int(np.argmax(errors)), len(firm))
        return float(errors.max()), firm[column], self.samples[row].sensed.time

    def last_effector_error(self) -> float:
        """Largest distance of an effector's origin from its plan in the last step [m]; counted as above."""
        last = self.samples[-1].output
        planned = last.reference.effectors
        errors = [last.state.frames[name].position - planned[name].position for name in self._firm()]
        return float(_lengths(errors).max(initial=0.0))

    def delayed_schedule(self) -> ContactSchedule | None:
        """When the planned contacts were due; None where the plan never waited."""
        if not self.samples or self.samples[-1].output.waited == 0.0:
            return None
        waited = np.array([sample.output.waited for sample in self.samples])
        planned = np.array([sample.plan_time for sample in self.samples])
        instants = self._schedule.instants
        late = waited[np.minimum(np.searchsorted(planned, instants), len(waited) - 1)]
        return ContactSchedule(self._schedule.sequence, instants + late)

    def _firm(self) -> list[str]:
        """Effectors none of whose contacts slide to their places."""
        return [
            name
            for name in self.effectors
            if all(item.contact.settle == 0.0 for item in self._intervals[name])
        ]

    def margins(self, mass: float) -> FloatArray:
        """(n,) wrench margin of the mean measured wrenches [N.m].

        The stance is the one planned for the beginning of the step, at its planned placements; what
        slides to its place on a seat is taken where it is, and from when it presses, up to
        ``EARLY_SEAT`` before it should. A foot that presses before its time or after it is no support.

        Args:
            mass: Mass of the body [kg]; closes the polytope of a stance without force limits.
        """
        totals = np.array([sample.total for sample in self.samples])
        phases = self._schedule.phase_at([sample.plan_time for sample in self.samples])
        margins = np.empty(len(self.samples))
        settling = self._settling_rows()
        early = self._early_seats()
        settling[list(early)] = True
        for index, phase in enumerate(self._schedule.sequence):
            rows = (phases == index) & ~settling
            if np.any(rows):
                margins[rows] = wrench_polytope(phase.stance.bounded(mass)).margin(totals[rows])
        for row in (int(number) for number in np.flatnonzero(settling)):
            stance = self._schedule.sequence[int(phases[row])].stance
            if row in early:
                stance = stance.with_contacts((*stance, *early[row]))
            stance = self._as_measured(stance, self.samples[row])
            margins[row] = wrench_polytope(stance.bounded(mass)).margin(totals[row])
        return margins

    def _settling_rows(self) -> NDArray[np.bool_]:
        """(n,) whether a contact is still on its way to its place."""
        times = np.array([sample.plan_time for sample in self.samples])
        rows = np.zeros(len(times), dtype=bool)
        for name in self.effectors:
            rows |= self._schedule.settling(times, name)
        return rows

    def _early_seats(self) -> dict[int, list[Contact]]:
        """Contacts made at speed that press a little before their time, by sample."""
        found: dict[int, list[Contact]] = {}
        for column, name in enumerate(self.effectors):
            for interval in self._intervals[name]:
                if interval.contact.settle == 0.0:
                    continue
                for row, (sample, after) in enumerate(itertools.pairwise(self.samples)):
                    force = np.maximum(*(np.abs(s.wrenches[column, :3]).max() for s in (sample, after)))
                    if 0.0 < interval.start - sample.plan_time <= EARLY_SEAT and force > _PRESSES:
                        found.setdefault(row, []).append(interval.contact)
        return found

    def _as_measured(self, stance: Stance, sample: Sample) -> Stance:
        """The stance with what is settling where it is now."""
        contacts = []
        for contact in stance:
            early = contact.effector not in self._schedule.stance_at(sample.plan_time)
            if early or self._schedule.settling(sample.plan_time, contact.effector)[0]:
                here = sample.output.state.frames[contact.effector].position
                contact = replace(contact, position=here)
            contacts.append(contact)
        return stance.with_contacts(contacts)

    def motion(self, joint_names: Sequence[str], mass: float) -> Motion:
        """Turn the samples into a motion."""
        states = [s.output.state for s in self.samples]
        wrenches = np.array([s.wrenches for s in self.samples])
        tau = np.array([s.output.tau for s in self.samples])
        return Motion(
            time=np.round([s.sensed.time for s in self.samples], 9) + 0.0,  # the engine adds up its steps
            q=np.array([state.q for state in states]),
            v=np.array([state.v for state in states]),
            a=np.array([s.sensed.a for s in self.samples]),
            tau=np.concatenate((np.zeros((len(tau), 6)), tau), axis=1),
            com=np.array([state.com for state in states]),
            angular_momentum=np.array([state.momentum[3:] for state in states]),
            margin=self.margins(mass),
            support=np.linalg.norm(wrenches[..., :3], axis=-1) > _PRESSES,
            contact_force=wrenches,
            contact_names=tuple(self.effectors),
            joint_names=tuple(joint_names),
        )


def _lengths(vectors: list[FloatArray]) -> FloatArray:
    return np.sqrt(np.sum(np.square(np.array(vectors).reshape(-1, 3)), axis=1))


def near(interval: SupportInterval, time: float) -> bool:
    """Whether a support is planned at ``time`` [s] or has just been, or is about to be."""
    return interval.early - 1e-9 <= time <= interval.late + 1e-9
