"""What Qiu measured of one person who passed under a beam, as numbers ([Qiu2012]_ chapter 3).

The file holds the numbers of Tables 3.2, 3.4 and 3.5 and those quoted in the text, nothing else. Table 3.4
gives the phases between changes of the feet up to the last landing; the last double support is not in it.
A motion with three steps is the left foot's first, one with four the right foot's first: Table 3.2 says so
of 01_TR_H1C1L_1, and for 01_TR_H2C3L_1, which is not in that table, it is inferred.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import accumulate, pairwise
from types import MappingProxyType
from typing import Any

from manikin.mocap.phase_sequence import PhaseSequence
from manikin.mocap.recorded_supports import SupportPhase
from manikin.mocap.sequence_consistency import SequenceConsistency
from manikin.mocap.spread import Spread

SHIPPED = "qiu_2012_chapter_3.json"
MOTIONS = 30
"""All that were made by the person, and all that Table 3.5 is about."""

_BOTH = ("left_foot", "right_foot")
_FEET = {"LR": _BOTH, "L": _BOTH[:1], "R": _BOTH[1:]}


@dataclass(frozen=True)
class PublishedHeights:
    """Heights quoted in [Qiu2012]_ 3.2.3 ("about"), by beam H1, H2 and H3 [m].

    Attributes:
        standing: Of the centre of mass before the motion.
        lowest: Of the centre of mass under each beam.
        beams: Of the beams.
    """

    standing: float
    lowest: Mapping[str, float]
    beams: Mapping[str, float]


def published_phases(first_step: str | None = None) -> tuple[PhaseSequence, ...]:
    """The 30 motions of Table 3.4, grouped by beam and configuration such as H1C1.

    Times are those of the thesis: frames begin at 1 and a hundred of them are a second.

    Args:
        first_step: ``left_foot`` or ``right_foot`` for the motions that begin with it; None for all. The
            means quoted in the thesis are those of ``left_foot`` in C1 and C2.
    """
    found = (_sequence(name, frames) for name, frames, *_ in _published()["table_3_4"])
    return tuple(one for one in found if first_step is None or one.first_step == first_step)


def published_grasps() -> dict[str, float]:
    """Instant at which the left hand grasped, by motion; in all others it did not [s]."""
    data = _published()
    return {name: rest[0] * data["frame_s"] for name, _, *rest in data["table_3_4"] if rest}


def published_consistency() -> SequenceConsistency:
    """Table 3.2: 24 motions of three people with free strategy in C1 and C2."""
    counts, steps = {}, {}
    for row in _published()["table_3_2"]:
        sequence = tuple(frozenset(_FEET[feet]) for feet in row["phases"])
        counts[sequence] = row["motions"]
        (first,) = sequence[0] - sequence[1]
        steps[first] = row["motions"]
    return SequenceConsistency(counts, steps)


def published_distances() -> dict[str, Spread]:
    """Table 3.5: largest distance from the centre of mass to each foot's contact in a motion [m]."""
    return {
        foot: Spread(MOTIONS, row["mean"], row["deviation"], row["min"], row["max"])
        for foot, row in _published()["table_3_5"].items()
    }


def published_heights() -> PublishedHeights:
    """Heights of the centre of mass and of the beams."""
    data = _published()
    return PublishedHeights(
        data["com_m"]["standing"],
        MappingProxyType(data["com_m"]["lowest"]),
        MappingProxyType(data["beam_heights_m"]),
    )


@cache
def _published() -> dict[str, Any]:
    file = resources.files("manikin.mocap") / "data" / SHIPPED
    return json.loads(file.read_text(encoding="utf-8"))


def _sequence(name: str, frames: Sequence[int]) -> PhaseSequence:
    data = _published()
    ends = [*accumulate(frames, initial=1)]
    last = data["end_frames"].get(name)
    if last is not None:
        ends.append(last)
    longer = max(data["table_3_2"], key=lambda row: len(row["phases"]))
    shorter = min(data["table_3_2"], key=lambda row: len(row["phases"]))
    feet = (shorter if len(frames) < len(shorter["phases"]) else longer)["phases"]
    phases = tuple(
        SupportPhase(start * data["frame_s"], end * data["frame_s"], _FEET[one])
        for (start, end), one in zip(pairwise(ends), feet, strict=False)
    )
    group = name.removeprefix("01_TR_")[:4]
    return PhaseSequence(name, group, phases, end_seen=last is None)
