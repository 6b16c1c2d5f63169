"""Postures along the motion that guide the whole-body fit.

At the key instants and every fraction of a second between them the posture generator finds a
collision-free posture on the contacts, the swings and the centre of mass.  Like the key
postures of [Qiu2012]_ 7.2.3 they tell, before the motion is fitted, whether it can be done,
and they are what the fitted motion stays near.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
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
from manikin.wholebody.targets import EffectorTarget, Ignored

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
        com: (k, 3) centre of mass [m].
        ignored: Pairs that may touch, per time.
        reference: (k, nq) preferred postures, the first of which starts the search.
        clearance: Wanted distance to everything [m].
        preferences: What the postures should look like; the generator's own when omitted.
        exact: Joints that keep to the reference whatever the posture before.
    """
    q = reference[0]
    found: list[FloatArray] = []
    failures: list[GuideFailure] = []
    settings = SolverSettings(tolerance=1e-4, clearance_tolerance=2e-3, explain=False)
    for k, instant in enumerate(time):
        contacts, placements = _requirements(schedule, float(instant), effectors, k)
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
        if not result.succeeded:
            failures.append(_failure(schedule, float(instant), result))
        q = result.q
        found.append(q)
    return Guide(np.asarray(time), align_quaternions(np.array(found)), tuple(failures))


def _requirements(
    schedule: ContactSchedule, time: float, effectors: dict[str, EffectorTarget], k: int
) -> tuple[tuple[Contact, ...], dict[str, Placement]]:
    held = {c.effector: c for c in schedule.stance_at(time) if c.part is SolePart.FULL}
    placements = {}
    for name, target in effectors.items():
        if name not in held and target.weight[k] >= LEAST_WEIGHT:
            turn = (
                target.rotation[k]
                if target.rotation is not None and target.rotation_weight[k] > 0.5
                else None
            )
            placements[name] = Placement(target.position[k], turn)
    return tuple(held.values()), placements


def _failure(schedule: ContactSchedule, time: float, result: PostureResult) -> GuideFailure:
    return GuideFailure(time, int(schedule.phase_at(time)), result.failure or "posture not found")
