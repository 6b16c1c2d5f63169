"""Postures along the motion that guide the whole-body fit.

At the key instants and every fraction of a second between them the posture generator finds a
collision-free posture on the contacts, the swings and the centre of mass.  Like the key
postures of [Qiu2012]_ 7.2.3 they tell, before the motion is fitted, whether it can be done,
and they are what the fitted motion stays near.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from manikin.body import BodyModel
from manikin.body.configuration import Configuration
from manikin.contact import Contact, ContactSchedule, SolePart
from manikin.posture import (
    Placement,
    PostureProblem,
    PostureResult,
    Preferences,
    SolverSettings,
    generate_posture,
)
from manikin.scene import Proximity
from manikin.spatial import FloatArray
from manikin.wholebody.configuration_spline import align_quaternions
from manikin.wholebody.targets import EffectorTarget, Ignored, settled_share

LEAST_WEIGHT = 0.05
"""Targets of less importance than this are left to the fit."""


@dataclass(frozen=True, eq=False)
class GuideFailure:
    """The first guide posture that could not be found.

    Attributes:
        time: [s].
        phase: Index of the phase.
        reason: What it misses, in one line.
    """

    time: float
    phase: int
    reason: str


@dataclass(frozen=True, eq=False)
class Guide:
    """Guide postures.

    Attributes:
        time: (k,) [s].
        configurations: (k, nq), quaternions in one half-space.
        failures: Postures that could not be found exactly; their best attempts are used.
    """

    time: FloatArray
    configurations: FloatArray
    failures: tuple[GuideFailure, ...]

    def at(self, time: FloatArray) -> FloatArray:
        """(n, nq) linear interpolation; quaternions are normalised."""
        rows = np.stack([np.interp(time, self.time, column) for column in self.configurations.T], axis=1)
        rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
        return rows


def guide_times(instants: FloatArray, spacing: float) -> FloatArray:
    """Every key instant, and equal parts of at most ``spacing`` [s] between them."""
    parts = [
        np.linspace(start, end, max(1, int(np.ceil((end - start) / spacing))), endpoint=False)
        for start, end in itertools.pairwise(instants)
    ]
    return np.append(np.concatenate(parts), instants[-1])


def plan_guide(
    body: BodyModel,
    proximity: Proximity,
    schedule: ContactSchedule,
    time: FloatArray,
    effectors: dict[str, EffectorTarget],
    com: FloatArray,
    ignored: tuple[Ignored, ...],
    reference: FloatArray,
    clearance: float,
    preferences: Preferences | None = None,
    exact: Sequence[int] = (),
) -> Guide:
    """Find a posture at each time, each one starting from the one before.

    Args:
        body: The body.
        proximity: Distances of the body to the scene and itself.
        schedule: Contacts in time.
        time: (k,) [s].
        effectors: Targets at these times.
        com: (k, 3) centre of mass [m]; NaN leaves it free.
        ignored: Pairs that may touch, per time.
        reference: (k, nq) preferred postures, the first of which starts the search.
        clearance: Wanted distance to everything [m].
        preferences: What the postures should look like; the generator's own when omitted.
        exact: Joints that keep to the reference whatever the posture before.
    """
    q = reference[0]
    found: list[FloatArray] = []
    failures: list[GuideFailure] = []
    touched: dict[str, FloatArray] = {}
    settings = SolverSettings(tolerance=1e-4, clearance_tolerance=2e-3, explain=False)
    for k, instant in enumerate(time):
        contacts, placements = _requirements(schedule, float(instant), effectors, k)
        placements.update(_settling(body, schedule, float(instant), q, touched))
        # Half way to the posture before: neighbouring postures must not jump.
        wanted = np.array(reference[k])
        if k > 0:
            wanted[7:] = 0.5 * (reference[k][7:] + q[7:])
            wanted[[7 + joint for joint in exact]] = reference[k][[7 + joint for joint in exact]]
        problem = PostureProblem(
            body, contacts, placements, com=com[k], proximity=proximity, clearance=clearance,
            self_clearance=clearance, ignore=ignored[k], reference=wanted,
            preferences=preferences or Preferences(),
        )  # fmt: skip
        result = generate_posture(problem, q, settings=settings)
        flying = [name for name in placements if effectors[name].weight[k] < 1.0]
        if not result.succeeded and flying:
            # In flight an effector need not pass exactly where its curve does.
            loose = {n: _loosened(item) if n in flying else item for n, item in placements.items()}
            retry = generate_posture(replace(problem, placements=loose), q, settings=settings)
            result = retry if retry.succeeded else result
        if not result.succeeded:
            failures.append(_failure(schedule, float(instant), result))
        q = result.q
        found.append(q)
    return Guide(np.asarray(time), align_quaternions(np.array(found)), tuple(failures))


def _requirements(
    schedule: ContactSchedule, time: float, effectors: dict[str, EffectorTarget], k: int
) -> tuple[tuple[Contact, ...], dict[str, Placement]]:
    held = {
        c.effector: c
        for c in schedule.stance_at(time)
        if c.part is SolePart.FULL and not schedule.settling(time, c.effector)[0]
    }
    settling = {name for name in effectors if schedule.settling(time, name)[0]}
    placements = {}
    for name, target in effectors.items():
        if name not in held and name not in settling and target.weight[k] >= LEAST_WEIGHT:
            turn = (
                target.rotation[k]
                if target.rotation is not None and target.rotation_weight[k] > 0.5
                else None
            )
            placements[name] = Placement(target.position[k], turn)
    return tuple(held.values()), placements


def _settling(
    body: BodyModel, schedule: ContactSchedule, time: float, q: FloatArray, touched: dict[str, FloatArray]
) -> dict[str, Placement]:
    """Places of the contacts that are still settling, on their way from where they touched.

    Args:
        body: The body.
        schedule: Contacts in time.
        time: [s].
        q: (nq,) posture before.
        touched: Where each of them touched, kept from posture to posture [m].
    """
    placements = {}
    phase = int(schedule.phase_at(time))
    for contact in schedule.sequence[phase].stance:
        if schedule.settling(time, contact.effector)[0]:
            if contact.effector not in touched:
                _, here = Configuration(body, q).effector_placement(contact.effector)
                touched[contact.effector] = here
            start = touched[contact.effector]
            share = float(settled_share(schedule, phase, contact, np.array([time]))[0])
            placements[contact.effector] = Placement(
                start + share * (contact.position - start),
                contact.rotation_contact_to_world,
                rotation_weight=SETTLING_TURN,
            )
    return placements


LOOSE_FLIGHT = 100.0
"""Weight of the place of a flying effector where it cannot be exact [1/m^2]."""


def _loosened(placement: Placement) -> Placement:
    return replace(placement, position_weight=LOOSE_FLIGHT)


SETTLING_TURN = 10.0
"""Weight of its orientation [1/rad^2]."""


def _failure(schedule: ContactSchedule, time: float, result: PostureResult) -> GuideFailure:
    return GuideFailure(time, int(schedule.phase_at(time)), result.failure or "posture not found")
