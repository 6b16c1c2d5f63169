"""The act itself: the force rises and is held in the posture with which the motion ended."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.balance import motion_margin
from manikin.body.segments import HANDS
from manikin.contact import ContactKind, ContactSchedule, ExertedForce, Stance, StanceSequence
from manikin.control import ForceWish
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.planning.push_pull.act import Act, ActKind, BracedForces

SAMPLING = 1.0e-3
"""Time between two samples of the held posture [s]."""

SETTLED = 0.3
"""Time after the force has risen from which on it counts as held [s]."""


@dataclass(frozen=True)
class Timing:
    """When the force of an act begins to rise, how long it rises and how long it is held then [s]."""

    start: float
    ramp: float
    hold: float

    @property
    def end(self) -> float:
        """End of the hold [s]."""
        return self.start + self.ramp + self.hold


@dataclass(frozen=True, eq=False)
class PlannedAct:
    """A motion that ends with an act, and what each hand should feel."""

    motion: Motion
    schedule: ContactSchedule
    timing: Timing
    wishes: tuple[ForceWish, ...]


def plan_act(
    motion: Motion, schedule: ContactSchedule, act: Act, forces: BracedForces, ramp: float, hold: float
) -> PlannedAct:
    """Append an act to a motion that ends at rest with its hands on the object.

    The last stance of the schedule has feet and hands, and the forces are those of the last posture with the
    act's force, contacts in that order. They rise for ``ramp`` and are held for ``hold`` [s]. The last phase
    says what the hands exert.
    """
    timing = Timing(float(motion.time[-1]), ramp, hold)
    stance = schedule.sequence[-1].stance
    wishes = tuple(
        ForceWish(contact.effector, forces.contact_force[k, :3], timing.start, ramp)
        for k, contact in enumerate(stance)
        if contact.effector in HANDS
    )
    *before, last = schedule.sequence
    acting = replace(last, exerts=ExertedForce(str(act.kind), act.direction))
    prolonged = ContactSchedule(StanceSequence([*before, acting]), [*schedule.instants[:-1], timing.end])
    return PlannedAct(_held(motion, stance, forces, timing), prolonged, timing, wishes)


def _held(motion: Motion, stance: Stance, forces: BracedForces, timing: Timing) -> Motion:
    """The motion with its last posture held, torques and forces rising to those of the act."""
    time = timing.start + np.arange(1, round((timing.ramp + timing.hold) / SAMPLING) + 1) * SAMPLING
    share = np.clip((time - timing.start) / timing.ramp, 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    tau, force = np.zeros(motion.tau.shape[1]), np.zeros(motion.contact_force.shape[1:])
    tau[6:] = forces.tau
    for k, contact in enumerate(stance):
        force[motion.contact_names.index(contact.effector)] = forces.contact_force[k]
    arrays = motion.arrays()
    added: dict[str, Any] = {name: np.repeat(rows[-1:], len(time), axis=0) for name, rows in arrays.items()}
    for name in ("v", "a", "angular_momentum"):
        added[name] = np.zeros((len(time), *arrays[name].shape[1:]))
    last = motion.contact_force[-1]
    added |= {"time": time, "tau": motion.tau[-1] + share[:, None] * (tau - motion.tau[-1])}
    added["contact_force"] = last + share[:, None, None] * (force - last)
    return replace(motion, **{name: np.concatenate([arrays[name], rows]) for name, rows in added.items()})


@dataclass(frozen=True)
class MeasuredAct:
    """Forces and margin of an executed act while its force was held.

    Attributes:
        mean_force: On the object along the act's direction [N].
        least_force: Least force on the object along that direction [N].
        sideways: Largest force on the object across that direction [N].
        palm_friction: Largest share of their friction that pressing palms needed; 0 for a pull.
        least_feet_margin: Least margin of the measured forces of the feet in what the feet alone can
            give [N.m], from the beginning of the act on.
        hold: For how long the force was held [s].
    """

    mean_force: float
    least_force: float
    sideways: float
    palm_friction: float
    least_feet_margin: float
    hold: float

    def summary(self) -> dict[str, float]:
        """Plain values for the run's summary."""
        return {
            "mean_force_N": self.mean_force, "least_force_N": self.least_force,
            "sideways_force_N": self.sideways, "palm_friction_share": self.palm_friction,
            "min_feet_margin": self.least_feet_margin, "held_s": self.hold,
        }  # fmt: skip


def measure_act(
    motion: Motion, schedule: ContactSchedule, act: Act, timing: Timing, mass: float, friction: float
) -> MeasuredAct | None:
    """Measure an executed act, or None where the motion ended before its force was held.

    The mass is that of the body [kg], the friction the Coulomb coefficient of pressing palms.
    """
    acting = motion.time >= timing.start
    held = (motion.time >= timing.start + timing.ramp + SETTLED) & (motion.time <= timing.end + 1e-9)
    if not held.any():
        return None
    stance = schedule.sequence[-1].stance
    hands = [k for k, name in enumerate(motion.contact_names) if name in HANDS and name in stance]
    forces = motion.contact_force[held][:, hands, :3]
    on_object = -forces.sum(axis=1)
    along = on_object @ act.direction
    across = np.linalg.norm(on_object - along[:, None] * act.direction, axis=1)
    return MeasuredAct(
        float(along.mean()), float(along.min()), float(across.max()),
        _palm_friction(forces, stance, [motion.contact_names[k] for k in hands], friction)
        if act.kind is ActKind.PUSH else 0.0,
        float(_feet_margin(motion, stance, acting, mass).min()),
        float(motion.time[held][-1] - timing.start - timing.ramp),
    )  # fmt: skip


def _palm_friction(forces: FloatArray, stance: Stance, hands: list[str], friction: float) -> float:
    """Largest tangential force over the friction limit of palms that press."""
    shares = []
    for column, hand in enumerate(hands):
        normal = stance[hand].normal
        pressing = forces[:, column] @ normal
        tangential = np.linalg.norm(forces[:, column] - pressing[:, None] * normal, axis=1)
        shares.append(float((tangential / np.maximum(friction * pressing, 1e-6)).max()))
    return max(shares)


def _feet_margin(motion: Motion, stance: Stance, rows: NDArray[np.bool_], mass: float) -> FloatArray:
    """(n,) margin about the CoM of the wrenches of the feet in the polytope of the feet alone [N.m]."""
    feet = [contact for contact in stance if contact.kind is ContactKind.SOLE]
    total = np.zeros((int(np.sum(rows)), 6))
    for contact in feet:
        wrench = motion.contact_force[rows][:, motion.contact_names.index(contact.effector)]
        total += wrench
        total[:, 3:] += np.cross(contact.position, wrench[:, :3])
    held = stance.with_contacts(feet).bounded(mass)
    return motion_margin([held], np.zeros(len(total)), total, motion.com[rows]).margin
