"""Where a motion comes nearest to losing its balance, and which contact ends it there."""

from dataclasses import dataclass, replace

import numpy as np

from manikin.balance import WrenchPolytope, stability_margins, wrench_polytopes
from manikin.balance.limiting import LimitingConstraint
from manikin.balance.zmp_path import contact_wrench
from manikin.body import BodyModel, Configuration
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import Contact, ContactSchedule, Stance, default_normal_force_cap, point, sole
from manikin.motion import Motion
from manikin.motion.dynamics import centroidal_motion
from manikin.spatial import FloatArray, finite_number, wrench_about

FRICTION = 0.8
"""Coefficient of friction of contacts that only the motion tells of."""

AGREES = 0.5
"""Difference up to which a margin counts as reproduced [N.m]."""


@dataclass(frozen=True, eq=False)
class LowestMargin:
    """Smallest margin of a motion.

    Attributes:
        value: In ``unit``.
        unit: ``"N.m"``, or ``"N"`` of a point mass planned in the force space.
        time: When [s].
        supports: Effectors in contact then.
        limiting: Nearest face of the wrench polytope then, in words; None with its reason in ``unknown``.
        again: Margin that the stance found gives, to hold against ``value`` [N.m]; None without a stance.
        stance: ``"planned contacts"`` or ``"effectors in contact"``: from what the stance was rebuilt.
        unknown: Why there is no limiting contact.
    """

    value: float
    unit: str
    time: float
    supports: tuple[str, ...]
    limiting: LimitingConstraint | None = None
    again: float | None = None
    stance: str | None = None
    unknown: str | None = None

    @property
    def reproduced(self) -> bool:
        """Whether the stance found gives the margin of the motion, within :data:`AGREES` or 1 %."""
        return self.again is not None and abs(self.again - self.value) <= max(AGREES, 0.01 * abs(self.value))


def lowest_margin(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None, *, friction: float = FRICTION
) -> LowestMargin | None:
    """Find the smallest margin and its limiting contact.

    With the planned contacts the stance is the one among the phase of that instant and its neighbours (an
    executed motion may be late) that gives the margin of the motion best. Without them it is rebuilt from the
    effectors in contact: soles as large as the body's, points at the hands, the patch of the buttocks.

    Args:
        body: Who moves.
        motion: Its motion; instants whose margin is NaN are passed over.
        schedule: The planned contacts.
        friction: Coefficient of contacts that the schedule does not tell of.

    Returns:
        None if the margin is not known at any instant.

    Raises:
        InputError: If the friction is not above 0.
    """
    finite_number(friction, "friction", above=0.0)
    if not np.isfinite(motion.margin).any():
        return None
    row = int(np.nanargmin(motion.margin))
    on = tuple(name for name, held in zip(motion.contact_names, motion.support[row], strict=True) if held)
    found = LowestMargin(float(motion.margin[row]), motion.margin_unit, float(motion.time[row]), on)
    if motion.margin_unit != "N.m" or body.is_point_mass:
        return replace(found, unknown="the margin of a point mass in the force space has no stance")
    if schedule is not None:
        return _of_schedule(found, body, motion, schedule, row)
    stance = rebuilt_stance(body, motion, row, friction)
    if not len(stance):
        return replace(found, unknown="nothing is in contact at that instant")
    (W,) = wrench_polytopes([stance])
    com, wrench = _dynamic_wrench(body, motion, row)
    return replace(
        found,
        limiting=W.limiting(wrench_about(wrench, W.reference), com),
        again=_margin(W, wrench, com),
        stance="effectors in contact",
    )


def rebuilt_stance(body: BodyModel, motion: Motion, row: int, friction: float = FRICTION) -> Stance:
    """Contacts of one frame at the poses of the effectors; effectors that can make none are left out.

    Args:
        body: Who moves.
        motion: Its motion.
        row: The frame.
        friction: Of every contact.
    """
    configuration = Configuration(body, motion.q[row])
    contacts = []
    for name, held in zip(motion.contact_names, motion.support[row], strict=True):
        if held and name in body.effectors:
            contacts.append(_contact(body, configuration, name, friction))
    return Stance(contacts, default_normal_force_cap(body.mass))


def _contact(body: BodyModel, configuration: Configuration, name: str, friction: float) -> Contact:
    """A sole of a foot, the patch of the buttocks, else a point."""
    rotation, place = configuration.effector_placement(name)
    size = None
    if name.endswith("foot") and body.sole_length is not None and body.sole_width is not None:
        size = body.sole_length, body.sole_width
    if name == "buttocks" and body.stature is not None:
        size = SEAT_LENGTH * body.stature, SEAT_WIDTH * body.stature
    if size is None:
        return point(name, place, rotation=rotation, friction=friction)
    return sole(name, place, rotation=rotation, length=size[0], width=size[1], friction=friction)


def _of_schedule(
    found: LowestMargin, body: BodyModel, motion: Motion, schedule: ContactSchedule, row: int
) -> LowestMargin:
    com, wrench = _dynamic_wrench(body, motion, row)
    wrenches = [wrench]
    measured = contact_wrench(_one_frame(motion, row), schedule)[0]
    if np.isfinite(measured).all() and measured.any():
        wrenches.insert(0, measured)
    phase = int(schedule.phase_at(found.time))
    near = [phase, phase - 1, phase + 1]
    polytopes = wrench_polytopes([
        schedule.sequence[number].stance.bounded(body.mass)
        for number in near
        if 0 <= number < len(schedule.sequence) and len(schedule.sequence[number].stance)
    ])  # fmt: skip
    if not polytopes:
        return replace(found, unknown="nothing is planned to be in contact at that instant")
    pairs: list[tuple[WrenchPolytope, FloatArray]] = [(W, wrench) for W in polytopes for wrench in wrenches]
    W, wrench = min(pairs, key=lambda pair: abs(_margin(*pair, com) - found.value))
    return replace(
        found,
        limiting=W.limiting(wrench_about(wrench, W.reference), com),
        again=_margin(W, wrench, com),
        stance="planned contacts",
    )


def _one_frame(motion: Motion, row: int) -> Motion:
    return replace(motion, **{name: array[row : row + 1] for name, array in motion.arrays().items()})


def _margin(W: WrenchPolytope, wrench: FloatArray, com: FloatArray) -> float:
    """Margin about the CoM of a wrench (6,) about the world's origin [N.m]."""
    return float(stability_margins(W, wrench_about(wrench, W.reference), com).wrench_about_com)


def _dynamic_wrench(body: BodyModel, motion: Motion, row: int) -> tuple[FloatArray, FloatArray]:
    """CoM (3,) and (6,) wrench about the world's origin that the motion needs of its contacts [N, N.m]."""
    rows = slice(row, row + 1)
    found = centroidal_motion(body, motion.q[rows], motion.v[rows], motion.a[rows])
    return found.com[0], found.wrench[0]
