"""Contact variables: which contacts of a sequence the motion keeps ([Tonneau2015]_ 7.3.1, [Mordatch2012]_).

Each contact has in each phase a variable ``c`` in [0, 1].  Forces are the cheaper the larger it is, and what
its effector lacks of the contact costs the more:

    min_c  mean_s P_s(c) + sum_k c_k E_k,   E_k = mean_s (|e_k|^2 / s_e^2 + |e'_k|^2 / s_v^2) / 2,

with the least value ``P`` of the force program (:mod:`~manikin.planning.whole_body.refine_physics`) and the
distance ``e`` of the effector from its contact and of the contact from the nearest obstacle.  In ITOMP they
are unknowns beside the waypoints.  Here both are found in turn: for a given motion the variables of a phase
are a small problem of their own, and convex, because a force costs ``f^2 / c`` and not ``f^2 / c^2``: the
square over a linear function is convex in both, and stays so after the forces are minimised out.

What is meant to be held is held exactly, so a variable decides: below :data:`RELEASE` the contact is let go
in that phase, but only where the others keep the wanted balance without it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from manikin.body import BodyModel
from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence
from manikin.errors import ContactError
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.refine_measures import room_of
from manikin.planning.whole_body.refine_physics import LEAST_VARIABLE, MarginCost, RefinedForces
from manikin.scene import Scene

RELEASE, LEAST = 0.5, LEAST_VARIABLE**2
"""Variable below which a contact that is not needed is let go, and below which a force gets no costlier."""

Variables = tuple[Mapping[str, float], ...]
"""Contact variable of each effector in contact, for each phase."""


@dataclass(frozen=True, eq=False)
class VariableSamples:
    """A motion as the choice of the variables sees it.

    Attributes:
        time: (n,) [s].
        wrench: (n, 6) that the whole body needs, about the world origin [N, N.m].
        com: (n, 3) centre of mass [m].
        key_time: (m,) times at which the contacts are looked at [s].
        place: By effector, (m, 3) where it is then [m].
        speed: By effector, (m,) how fast [m/s].
    """

    time: FloatArray
    wrench: FloatArray
    com: FloatArray
    key_time: FloatArray
    place: Mapping[str, FloatArray]
    speed: Mapping[str, FloatArray]

    def during(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """(k, 6) wrenches and (k, 3) CoM at the samples of an interval [s]."""
        rows = (self.time >= start) & (self.time <= end)
        return self.wrench[rows], self.com[rows]

    @classmethod
    def of(
        cls, body: BodyModel, names: Sequence[str], time: FloatArray,
        states: tuple[FloatArray, FloatArray, FloatArray],
        keys: tuple[FloatArray, FloatArray, FloatArray] | None = None,
    ) -> "VariableSamples":  # fmt: skip
        """A motion at ``time`` (n,) with configurations, velocities and accelerations.

        Args:
            names: Effectors that are looked at.
            keys: (m,) times, (m, nq) configurations and (m, nv) velocities at which contacts should be held;
                those of the motion when omitted.
        """
        key_time, q, v = keys or (time, *states[:2])
        model, data, axes = body.pinocchio, body.pinocchio.createData(), pin.LOCAL_WORLD_ALIGNED
        frames = {name: body.effector_frame(name) for name in names}
        place = {name: np.empty((len(q), 3)) for name in names}
        speed = {name: np.empty(len(q)) for name in names}
        for k, (state, rate) in enumerate(zip(q, v, strict=True)):
            pin.forwardKinematics(model, data, state, rate)
            for name, frame in frames.items():
                place[name][k] = pin.updateFramePlacement(model, data, frame).translation
                speed[name][k] = np.linalg.norm(pin.getFrameVelocity(model, data, frame, axes).linear)
        found = centroidal_motion(body, *states)
        return cls(time, found.wrench, found.com, key_time, place, speed)


class VariableChoice:
    """Chooses the contact variables of a sequence for given motions.

    Args:
        scales: Those of the refinement: ``missing_wrench``, ``force``, ``approach``, ``slide``, ``margin``.
        tolerance: Distance of an effector from its contact that costs nothing, as the certificate's [m].
        friction_share: Of the friction with which the other contacts have to do.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, scales: RefineScales, tolerance: float, friction_share: float
    ) -> None:
        self._body, self._scene, self._scales = body, scene, scales
        self._tolerance, self._friction_share = tolerance, friction_share
        self._off_surface = cache(self._distance_off)
        self._rooms: dict[frozenset[Contact], MarginCost] = {}

    def choose(
        self, schedule: ContactSchedule, samples: VariableSamples, resting: VariableSamples | None = None
    ) -> tuple[Variables, ContactSchedule]:
        """Variables of every phase, and the contacts without those that are let go.

        Args:
            resting: The input at rest: what the others carry then they need not carry in the motion, which
                may have been bent towards the very contact that cannot be made.
        """
        variables, phases = list[Mapping[str, float]](), list[Phase]()
        for phase, interval in zip(schedule.sequence, pairwise(schedule.instants), strict=True):
            motions = [item.during(*interval) for item in (samples, resting) if item is not None]
            errors = self.errors(phase.stance, samples, interval)
            chosen, kept = self._of_phase(phase.stance, motions, errors)
            variables.append(MappingProxyType(chosen))
            phases.append(replace(phase, stance=kept))
        if all(len(a.stance) == len(b.stance) for a, b in zip(phases, schedule.sequence, strict=True)):
            return tuple(variables), schedule
        return tuple(variables), ContactSchedule(StanceSequence(phases), schedule.instants)

    def errors(
        self, stance: Stance, samples: VariableSamples, interval: tuple[float, float]
    ) -> dict[str, float]:
        """``E`` of each contact of a stance over an interval [s]; none where nothing is looked at in it."""
        rows = (samples.key_time >= interval[0] - 1e-9) & (samples.key_time <= interval[1] + 1e-9)
        found = dict.fromkeys(stance.effectors, 0.0)
        for contact in stance if np.any(rows) else ():
            name = contact.effector
            away = np.linalg.norm(samples.place[name][rows] - contact.position, axis=1)
            away = np.maximum(np.hypot(away, self._off_surface(contact)) - self._tolerance, 0.0)
            cost = (away / self._scales.approach) ** 2
            # Sliding counts where the effector is not where it should be; a held one hardly does.
            cost += np.where(away > 0.0, samples.speed[name][rows] / self._scales.slide, 0.0) ** 2
            found[name] = 0.5 * float(cost.mean())
        return found

    def _of_phase(
        self, stance: Stance, motions: Sequence[tuple[FloatArray, FloatArray]], errors: Mapping[str, float]
    ) -> tuple[dict[str, float], Stance]:
        (wrench, _), kept, needed, chosen = motions[0], stance, set[str](), dict[str, float]()
        while len(kept) and len(wrench):
            free = [name for name in kept.effectors if name not in needed]
            chosen.update(best_variables(kept, wrench, errors, free, self._scales, self._body.mass))
            loose = sorted((name for name in free if chosen[name] < RELEASE), key=lambda name: chosen[name])
            if not loose:
                break
            fewer = kept.with_contacts(contact for contact in kept if contact.effector != loose[0])
            if any(self._carries(fewer, *item) for item in motions):
                kept = fewer
            else:
                needed.add(loose[0])
                chosen[loose[0]] = 1.0
        return {name: chosen.get(name, 1.0) for name in stance.effectors}, kept

    def _carries(self, stance: Stance, wrench: FloatArray, com: FloatArray) -> bool:
        """Whether a stance keeps the wanted balance at all wrenches (n, 6) with CoM (n, 3)."""
        if not len(stance) or not len(wrench):
            return False
        key = frozenset(stance)
        if key not in self._rooms:
            self._rooms[key] = room_of(stance, self._friction_share)
        room, wanted = self._rooms[key], self._scales.margin
        return not room.is_flat and bool(
            room.margin(wrench, com).min() >= room.wanted(wanted, com.mean(axis=0))
        )

    def _distance_off(self, contact: Contact) -> float:
        """Distance of a contact from the nearest obstacle; 0 where it lies on one [m]."""
        touching = 0.02  # distance to a surface up to which a contact counts as lying on it [m]
        try:
            self._scene.touched_obstacles(contact, touching)
        except ContactError:
            near = abs(self._scene.nearest(contact.position)[1]) if self._scene.obstacles else np.inf
            return max(near, touching)
        return 0.0


def best_variables(
    stance: Stance, wrench: FloatArray, errors: Mapping[str, float], free: Sequence[str],
    scales: RefineScales, mass: float,
) -> dict[str, float]:  # fmt: skip
    """Solve the problem of one phase for its variables, all others of the stance being 1.

    Args:
        wrench: (n, 6) needed, about the world origin [N, N.m].
        errors: ``E`` by effector.
        free: Effectors whose variable is sought.
        scales: ``missing_wrench`` and ``force`` count.
        mass: Of the body [kg].
    """
    names = stance.effectors
    columns = np.array([names.index(name) for name in free], dtype=np.int64)
    penalty = np.array([errors[name] for name in free])
    forces, weight, ones = RefinedForces(stance, names), scales.force * mass * 9.81, np.ones(len(names))
    cost = partial(mean_cost, forces, wrench, scales.missing_wrench, weight)
    _, slope = cost(ones)
    if not len(free) or np.all(slope[columns] + penalty <= 0.0):
        return dict.fromkeys(free, 1.0)  # the corner is the minimum of a convex function

    def total(c: FloatArray) -> tuple[float, FloatArray]:
        full = ones.copy()
        full[columns] = c
        value, slope = cost(full)
        return value + float(penalty @ c), slope[columns] + penalty

    found = minimize(total, ones[columns], jac=True, method="L-BFGS-B", bounds=[(LEAST, 1.0)] * len(free))
    return dict(zip(free, found.x.tolist(), strict=True))


def mean_cost(
    forces: RefinedForces, wrench: FloatArray, tolerance: float, force: float, c: FloatArray
) -> tuple[float, FloatArray]:
    """Mean least value of the force program over the samples of a phase, and its derivative (k,).

    Args:
        wrench: (n, 6) needed, about the world origin.
        tolerance: Missing wrench that costs one unit [N].
        force: Force that costs one unit [N].
        c: (k,) contact variables, by which it is differentiated.
    """
    shared = forces.share(wrench, np.tile(np.sqrt(c), (len(wrench), 1)), tolerance=tolerance, force=force)
    by_contact = np.bincount(forces.columns, np.mean(shared.magnitude**2, axis=0) / force**2, len(c))
    return float(shared.cost.value.mean()), -0.5 * by_contact / c**2
