"""Everything that [Qiu2012]_ chapter 3 measures of recorded motions, over groups of them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from manikin.errors import InputError
from manikin.motion.passage import Passage
from manikin.numerics.signals import Spread
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.passages import (
    LIMIT,
    Origin,
    Overhead,
    SupportPlacement,
    com_extreme,
    first_stance,
    largest_distances,
    passages,
    shares_within,
    support_distances,
    support_placements,
    whole_passage,
)
from manikin.recordings.statistics.phases import (
    BYS,
    By,
    PhaseSequence,
    SequenceConsistency,
    by_group,
    initials,
    phase_durations,
    published_consistency,
    published_distances,
    published_phases,
    sequence_consistency,
)

From = Literal["stance", "lowest", "highest"]
FROMS: tuple[From, ...] = ("stance", "lowest", "highest")

PUBLISHED_PHASES, EVERYBODY = 6, "all"
"""Phases that Table 3.4 gives of a motion with the left foot first: one motion has its last one, too; and the
name of the group of all published motions."""


@dataclass(frozen=True)
class StatisticsSettings:
    """What is measured, and how.

    Attributes:
        overhead: What is passed under; None for nothing.
        limit: Distance from the centre of mass to a support within which shares are counted [m].
        active: Effectors that define phases and sequences; None for all.
        phases: Number of phases that are compared in sequences; None for all.
        start: Kind of phase from which on they are compared, such as ``DS``; None for the first of all.
        origin: From where placements are seen: the first stance, or where the centre of mass was lowest or
            highest. Motions that begin there with the right foot are seen in a mirror.
    """

    overhead: Overhead | None = None
    limit: float = LIMIT
    active: Collection[str] | None = None
    phases: int | None = None
    start: str | None = None
    origin: From = "stance"

    def __post_init__(self) -> None:
        if self.origin not in FROMS:
            raise InputError(f"placements from {self.origin!r}; valid: {', '.join(FROMS)}")

    def phases_of(self, clip: RecordedClip) -> PhaseSequence:
        """Phases of a motion by the effectors that count."""
        return clip.phases if self.active is None else clip.phases.of_effectors(self.active)

    def origin_of(self, clip: RecordedClip) -> Origin:
        """From where its placements are seen; InputError if it has no support, or does not move on."""
        if self.origin == "stance":
            return first_stance(clip)
        return com_extreme(clip, highest=self.origin == "highest")


@dataclass(frozen=True, eq=False)
class GroupStatistics:
    """Measures of the motions of one group; what is not known of them is empty.

    Attributes:
        durations: Of phases seen from beginning to end, by ``number`` (DS-1 and so on), by ``kind`` (DS, SS)
            and by the ``effectors`` that support [s].
        consistency: Of sequences and first steps.
        distances: Largest distance from the centre of mass to a support in a motion, by effector [m].
        within: Share of the instants within the limit, by effector.
        whole: Lowest and highest points of each motion, by its name.
        under: Passages under what is overhead, with the motion of each.
        unplaced: Why motions have no placements, by name.
    """

    group: str
    motions: tuple[str, ...]
    durations: Mapping[By, Mapping[str, Spread]]
    consistency: SequenceConsistency
    distances: Mapping[str, Spread] = field(default_factory=dict)
    within: Mapping[str, float] = field(default_factory=dict)
    whole: Mapping[str, Passage] = field(default_factory=dict)
    under: tuple[tuple[str, Passage], ...] = ()
    placements: tuple[SupportPlacement, ...] = ()
    unplaced: Mapping[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, with units in the keys."""
        low, alike = [passage.com_lowest for passage in self.whole.values()], self.consistency
        return {
            "motions": list(self.motions),
            "durations": {by: _dicts(each, "s") for by, each in self.durations.items()},
            "sequences": [{"sequence": initials(one), "motions": n} for one, n in alike.counts.items()],
            "modal_share": alike.modal_share, "modal_share_mirrored": alike.mirrored_share,
            "first_steps": dict(alike.first_steps),
            "largest_com_distance": _dicts(self.distances, "m"), "share_within_limit": dict(self.within),
            "com_lowest": Spread.of(low).as_dict("m") if low else None,
            "passages": [{"motion": name, **one.as_dict()} for name, one in self.under],
            "placements": [
                {"effector": one.effector, "number": one.number, "count": len(one.places),
                 "mean_m": one.mean, "covariance_m2": one.covariance}
                for one in self.placements
            ],
            "unplaced": dict(self.unplaced),
        }  # fmt: skip


def group_statistics(
    group: str, clips: Sequence[RecordedClip], settings: StatisticsSettings | None = None
) -> GroupStatistics:
    """Measures of the motions of one group, which need highest points if a passage is asked for."""
    how = settings or StatisticsSettings()
    sequences = [how.phases_of(clip) for clip in clips]
    placed, origins, unplaced = [], [], {}
    for clip in clips:
        try:
            origins.append(how.origin_of(clip))
            placed.append(clip)
        except InputError as error:
            unplaced[clip.name] = str(error)
    return GroupStatistics(
        group, tuple(clip.name for clip in clips), _durations(sequences),
        sequence_consistency(sequences, phases=how.phases, start=how.start),
        largest_distances(clips), shares_within(clips, how.limit),
        whole={clip.name: whole_passage(clip) for clip in clips},
        under=tuple((c.name, p) for c in clips for p in passages(c, how.overhead)) if how.overhead else (),
        placements=support_placements(placed, origins, mirror=True), unplaced=unplaced,
    )  # fmt: skip


def statistics_of(
    clips: Sequence[RecordedClip], settings: StatisticsSettings | None = None
) -> dict[str, GroupStatistics]:
    """:func:`group_statistics` of each group of motions, in the order in which groups appear."""
    groups: dict[str, list[RecordedClip]] = {}
    for clip in clips:
        groups.setdefault(clip.group, []).append(clip)
    return {group: group_statistics(group, members, settings) for group, members in groups.items()}


def published_statistics() -> dict[str, GroupStatistics]:
    """Statistics of the published motions: each configuration, left foot first, and all of them.

    ``all`` has the sequences of Table 3.2 and the distances of Table 3.5.
    """
    sequences = published_phases("left_foot")
    found = {
        group: GroupStatistics(
            group, tuple(one.name for one in members), _durations(members),
            consistency=sequence_consistency(members, phases=PUBLISHED_PHASES),
        )
        for group, members in by_group(sequences).items()
    }  # fmt: skip
    everybody = GroupStatistics(
        EVERYBODY, tuple(one.name for one in sequences), _durations(sequences),
        consistency=published_consistency(), distances=published_distances(),
    )  # fmt: skip
    return {**found, EVERYBODY: everybody}


def clip_as_dict(clip: RecordedClip, settings: StatisticsSettings | None = None) -> dict[str, Any]:
    """One motion for JSON: its phases, heights and distances, with units in the keys."""
    how = settings or StatisticsSettings()
    phases = how.phases_of(clip)
    return {
        "name": clip.name, "group": clip.group,
        "duration_s": float(clip.time[-1] - clip.time[0]), "standing_com_m": clip.standing_com,
        "phases": [
            {"phase": label, "effectors": list(one.effectors), "start_s": one.start, "end_s": one.end,
             "whole": whole}
            for label, one, whole in zip(phases.labels, phases.phases, phases.whole, strict=True)
        ],
        "whole": whole_passage(clip).as_dict(),
        "passages": [one.as_dict() for one in passages(clip, how.overhead)] if how.overhead else [],
        "supports": [
            {
                "effector": one.effector, "start_s": one.time[0], "end_s": one.time[-1],
                "com_distance_min_m": one.distance.min(), "com_distance_mean_m": one.distance.mean(),
                "com_distance_max_m": one.distance.max(),
                "share_within_limit": (one.distance <= how.limit).mean(),
            }
            for one in support_distances(clip)
        ],
    }  # fmt: skip


def _durations(sequences: Sequence[PhaseSequence]) -> dict[By, Mapping[str, Spread]]:
    return {by: phase_durations(sequences, by) for by in BYS}


def _dicts(spreads: Mapping[str, Spread], unit: str) -> dict[str, dict[str, float | int]]:
    return {name: one.as_dict(unit) for name, one in spreads.items()}
