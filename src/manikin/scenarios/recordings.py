"""Recorded motions that a scenario names."""

from pathlib import Path

import numpy as np

from manikin.centroidal import Recording
from manikin.contact import ContactSchedule, StanceSequence
from manikin.errors import InputError
from manikin.motion.derived import phases_of
from manikin.motion.file import MotionFile, read_motions
from manikin.scenarios.heights import SupportLevel
from manikin.spatial import IDENTITY, FloatArray, PlanarTransform

SAME_PLACE = 0.01
"""Distance up to which a recorded contact is that of the scenario [m]."""


def load_recording(
    path: Path,
    sequence: StanceSequence,
    stature: float,
    level: SupportLevel,
    transform_recording_to_world: PlanarTransform = IDENTITY,
) -> Recording:
    """Read the CoM of a motion file and lay its timing over the stances of a scenario.

    The executed motion is taken, or else the planned one. Its phases are those of the file's
    schedule, or else of its support table. For a body of another stature the heights above the
    supports are scaled, see :mod:`manikin.scenarios.heights`.

    Args:
        path: Run directory or motion file.
        sequence: The scenario's stances.
        stature: Of the scenario's body [m].
        level: Height of the supports below the CoM.
        transform_recording_to_world: From the file's coordinates to the scenario's.

    Raises:
        MotionFileError: If the file cannot be read.
        InputError: If the motion was recorded on other supports, or is not usable.
    """
    content = read_motions(path)
    motion = next(reversed(content.motions.values()))
    table = phases_of(motion, content.schedule)
    wanted = [sorted(phase.stance.effectors) for phase in sequence]
    found = [sorted(names) for names in table.supports]
    if found != wanted:
        raise InputError(f"{path}: {_difference(found, wanted)}; valid: a motion on the scenario's supports")
    if content.schedule is not None:
        _check_places(path, content.schedule, sequence, transform_recording_to_world)
    com = _scaled(transform_recording_to_world.points(motion.com), content, stature, level)
    return Recording(motion.time, com, sequence, table.instants)


def _difference(found: list[list[str]], wanted: list[list[str]]) -> str:
    """Say the first phase whose contacts are others than the scenario's."""
    if not any(found):
        return "was recorded without any support"
    if len(found) != len(wanted):
        return f"was recorded with {len(found)} phases, the scenario has {len(wanted)}"
    number = next(i for i, pair in enumerate(zip(found, wanted, strict=True)) if pair[0] != pair[1])
    names, others = (", ".join(contacts[number]) or "nothing" for contacts in (found, wanted))
    return f"was recorded on {names} in phase {number}, the scenario stands on {others}"


def _check_places(
    path: Path, schedule: ContactSchedule, sequence: StanceSequence, transform: PlanarTransform
) -> None:
    for number, (recorded, phase) in enumerate(zip(schedule.sequence, sequence, strict=True)):
        for contact in phase.stance:
            place = transform.points(recorded.stance[contact.effector].position)
            if np.linalg.norm(place - contact.position) > SAME_PLACE:
                raise InputError(
                    f"{path}: {contact.effector} was recorded at {np.round(place, 3).tolist()} in phase "
                    f"{number}, the scenario has it at {np.round(contact.position, 3).tolist()}; "
                    "valid: a motion on the scenario's supports"
                )


def _scaled(com: FloatArray, content: MotionFile, stature: float, level: SupportLevel) -> FloatArray:
    recorded = None if content.body is None else content.body.stature
    if recorded is None or recorded == stature:
        return com
    base = level(com[:, 0], com[:, 1])
    return np.column_stack([com[:, :2], base + stature / recorded * (com[:, 2] - base)])
