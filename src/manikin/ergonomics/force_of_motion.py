"""What the hands of a motion push or pull, for the force limits.

Phases of the planned contacts say that the hands act on an object and which way, as those of a scenario's
act and of the operations push and pull do; other supports of the hands, on a rail or a rung, are no such
actions. The force is what the hands exert that way, planned or measured in the engine.

How long it is exerted is in the motion, and that the object stays where it is; how often it is done, for how
long at a stretch and for what use is said in the circumstances. What is not said is taken at its most
favourable, and told.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body.segments import HANDS
from manikin.contact import ContactSchedule
from manikin.ergonomics.assessment import durations
from manikin.ergonomics.force_limits import DURATIONS, FREQUENCIES, ForceLimit, force_limit, force_multipliers
from manikin.ergonomics.rula_reba import Circumstances
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray

EXERTED = 0.5
"""Share of its largest force from which on an action lasts; ours."""


@dataclass(frozen=True, eq=False)
class ExertedOverTime:
    """Pushing or pulling of a motion against its limit.

    Attributes:
        force: (n,) on the object the way that is wanted [N]; NaN where the hands act on nothing.
        time: When it is largest [s].
        action_time: How long it is exerted [s].
        limit: The largest force against its limit.
        assumed: Circumstances that were not said: ``"frequency"``, ``"duration"``.
    """

    force: FloatArray
    time: float
    action_time: float
    limit: ForceLimit
    assumed: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        seen = {"at_s": self.time, "action_time_s": self.action_time, "assumed": list(self.assumed)}
        return self.limit.as_dict() | seen


def exerted_by(
    motion: Motion, schedule: ContactSchedule | None, given: Circumstances
) -> ExertedOverTime | None:
    """What a standing body pushes or pulls with its hands; None of a motion that does not.

    Args:
        motion: Planned or executed.
        schedule: Its contacts, whose phases say where the hands act.
        given: How often (``cycles_per_minute``), for how long (``job_hours``), and for what use
            (``domestic``).

    Raises:
        InputError: If the forces of the hands are not known, or the action cannot be done that often.
    """
    acting = [] if schedule is None else [
        (number, phase.exerts) for number, phase in enumerate(schedule.sequence) if phase.exerts is not None
    ]  # fmt: skip
    if schedule is None or not acting:
        return None
    hands = [column for column, name in enumerate(motion.contact_names) if name in HANDS]
    phases, force = schedule.phase_at(motion.time), np.full(len(motion.time), np.nan)
    planned = motion.time <= schedule.instants[-1] + 1e-9  # what follows in the engine is to settle
    for number, exerted in acting:
        rows = (phases == number) & planned
        on_object = -motion.contact_force[rows][:, hands, :3].sum(axis=1)
        force[rows] = on_object @ exerted.direction
    if not np.isfinite(force).any():
        raise InputError("the forces of the hands are not known; valid: a motion with them")
    frame = int(np.nanargmax(force))
    largest, kind = max(float(force[frame]), 0.0), dict(acting)[int(phases[frame])].kind
    lasting = float(durations(motion.time)[force >= EXERTED * largest].sum()) if largest > 0.0 else 0.0
    often, hours = given.cycles_per_minute, given.job_hours
    multipliers = force_multipliers(
        moving=False, action_time=lasting, per_minute=FREQUENCIES[0] if often is None else often,
        hours=DURATIONS[0][0] if hours is None else hours,
    )  # fmt: skip
    assumed = [name for name, value in (("frequency", often), ("duration", hours)) if value is None]
    limit = force_limit(largest, f"body_{kind}", domestic=given.domestic, multipliers=multipliers)
    return ExertedOverTime(force, float(motion.time[frame]), lasting, limit, tuple(assumed))
