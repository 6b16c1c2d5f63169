"""How long the phases of several motions last."""

from collections.abc import Sequence
from typing import Literal

from manikin.errors import InputError
from manikin.mocap.phase_sequence import PhaseSequence
from manikin.mocap.spread import Spread

By = Literal["number", "kind", "effectors"]
"""``number``: DS-1, SS-1, DS-2, for motions that begin alike; ``kind``: DS, SS; ``effectors``: by name."""

BYS: tuple[By, ...] = ("number", "kind", "effectors")


def phase_durations(
    sequences: Sequence[PhaseSequence], by: By = "number", *, cut: bool = False
) -> dict[str, Spread]:
    """Durations of the phases of the same name over all motions ([Qiu2012]_ Table 3.4, Fig. 3.11) [s].

    Args:
        sequences: Of at least one motion; give those of one group, or of all.
        by: What makes a name.
        cut: Whether phases count that begin or end with the recording.

    Returns:
        Spread of each name, in the order in which they appear.

    Raises:
        InputError: If ``by`` is unknown.
    """
    if by not in BYS:
        raise InputError(f"phases by {by!r}; valid: {', '.join(BYS)}")
    values: dict[str, list[float]] = {}
    for one in sequences:
        for name, phase, whole in zip(names_of(one, by), one.phases, one.whole, strict=True):
            if whole or cut:
                values.setdefault(name, []).append(phase.duration)
    return {name: Spread.of(durations) for name, durations in values.items()}


def names_of(one: PhaseSequence, by: By) -> tuple[str, ...]:
    """Name of each phase of a motion."""
    if by == "number":
        return one.labels
    if by == "kind":
        return one.kinds
    return tuple("+".join(phase.effectors) or "flight" for phase in one.phases)


def by_group(sequences: Sequence[PhaseSequence]) -> dict[str, tuple[PhaseSequence, ...]]:
    """The motions of each group, in the order in which groups appear."""
    groups: dict[str, list[PhaseSequence]] = {}
    for one in sequences:
        groups.setdefault(one.group, []).append(one)
    return {group: tuple(members) for group, members in groups.items()}
