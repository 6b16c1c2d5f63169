"""The comparison of two runs, and what cannot be compared."""

from dataclasses import dataclass
from typing import Any

from manikin.comparison.alignment import PhasePair, align_phases
from manikin.comparison.com import com_difference, margin_difference
from manikin.comparison.postures import PostureDifference, posture_differences, uncommon_joints
from manikin.comparison.timing import TimingRow, timing_rows
from manikin.contact import Stance
from manikin.display import Displayed
from manikin.record import ComTrack, RunRecord

STAGES = ("point mass", "planned", "executed")
"""What may be compared of each run: the CoM plan, the planned and the executed motion."""


@dataclass(frozen=True, eq=False, repr=False)
class RunComparison(Displayed):
    """Two runs side by side; differences are second less first.

    Attributes:
        first: The first run.
        second: The second run.
        pairs: Their phases, aligned by the effectors in contact; empty without schedules.
        rows: The same with key instants.
        postures_of: ``"planned"`` or ``"executed"``, whichever motion the postures are of, or None.
        postures: At the matching key instants.
        unmatched: What could not be compared and why, one line each.
    """

    first: RunRecord
    second: RunRecord
    pairs: tuple[PhasePair, ...]
    rows: tuple[TimingRow, ...]
    postures_of: str | None
    postures: tuple[PostureDifference, ...]
    unmatched: tuple[str, ...]

    @property
    def runs(self) -> tuple[RunRecord, RunRecord]:
        """Both runs."""
        return self.first, self.second

    @property
    def names(self) -> tuple[str, str]:
        """What to call the runs; numbered when their directories have the same name."""
        if self.first.label != self.second.label:
            return self.first.label, self.second.label
        return f"{self.first.label} (1)", f"{self.second.label} (2)"

    @property
    def durations(self) -> tuple[float | None, float | None]:
        """From the first to the last key instant of each run [s]."""
        return _duration(self.first), _duration(self.second)

    def as_dict(self) -> dict[str, Any]:
        """The JSON of ``manikin compare``."""
        shared = shared_tracks(self)
        return {
            "first": _run_block(self.first, self.names[0]),
            "second": _run_block(self.second, self.names[1]),
            "matched_phases": sum(pair.matched for pair in self.pairs),
            "timing": [row.as_dict() for row in self.rows] or None,
            "duration_difference_s": _duration_difference(self.first, self.second),
            "com": {
                _key(stage): com_difference(self.rows, *shared[stage]) if stage in shared else None
                for stage in STAGES
            },
            "margins": {
                _key(stage): margin_difference(self.rows, *shared[stage]) if stage in shared else None
                for stage in STAGES
            },
            "postures_of": self.postures_of,
            "postures": [posture.as_dict() for posture in self.postures] or None,
            "unmatched": list(self.unmatched),
        }


def compare_runs(first: RunRecord, second: RunRecord) -> RunComparison:
    """Compare two runs as far as both got.

    Args:
        first: A run.
        second: Another one, or the same.
    """
    pairs: tuple[PhasePair, ...] = ()
    rows: tuple[TimingRow, ...] = ()
    if first.schedule is not None and second.schedule is not None:
        pairs = align_phases(_stances(first), _stances(second))
        rows = timing_rows(pairs, first.schedule, second.schedule)
    kinds = [kind for kind in ("executed", "planned") if kind in first.motions and kind in second.motions]
    which = kinds[0] if kinds else None
    postures = ()
    if which is not None:
        postures = posture_differences(rows, first.motions[which], second.motions[which])
    unmatched = [*_missing_stages(first, second), *_missing_phases(first, second, rows)]
    if which is not None:
        unmatched += _missing_joints(first, second, which)
    return RunComparison(first, second, pairs, rows, which, postures, tuple(unmatched))


def tracks_of(record: RunRecord) -> dict[str, ComTrack]:
    """CoM of a run by stage, see :data:`STAGES`."""
    found = {} if record.plan is None else {"point mass": record.plan}
    return {**found, **(record.tracks if record.motions else {})}


def shared_tracks(comparison: RunComparison) -> dict[str, tuple[ComTrack, ComTrack]]:
    """CoM of both runs for every stage that both reached."""
    return _shared(comparison.first, comparison.second)


def _shared(first: RunRecord, second: RunRecord) -> dict[str, tuple[ComTrack, ComTrack]]:
    one, other = tracks_of(first), tracks_of(second)
    return {stage: (one[stage], other[stage]) for stage in STAGES if stage in one and stage in other}


def _stances(record: RunRecord) -> list[Stance]:
    return [] if record.schedule is None else [phase.stance for phase in record.schedule.sequence]


def _missing_stages(first: RunRecord, second: RunRecord) -> list[str]:
    lines = []
    for place, record, other in (("first", first, second), ("second", second, first)):
        failure = record.summary.get("failure")
        why = f" (it failed in {failure['stage']}: {failure['reason']})" if failure else ""
        for stage in STAGES:
            if stage in tracks_of(other) and stage not in tracks_of(record):
                lines.append(f"the {place} run has no {_words(stage)}{why}")
    if not tracks_of(first) and not tracks_of(second):
        lines.append("neither run has a centre of mass")
    shared = _shared(first, second)
    for stage, (one, two) in shared.items():
        if one.margin_unit != two.margin_unit:
            lines.append(f"margins of the {_words(stage)} are in {one.margin_unit} and in {two.margin_unit}")
    return lines


def _missing_phases(first: RunRecord, second: RunRecord, rows: tuple[TimingRow, ...]) -> list[str]:
    lines = []
    for row in rows:
        held = ", ".join(row.supports) or "no contact"
        if row.second is None and row.first is not None:
            lines.append(f"phase {row.first.index} of the first run ({held}) has no match in the second")
        elif row.first is None and row.second is not None:
            lines.append(f"phase {row.second.index} of the second run ({held}) has no match in the first")
    for place, record in (("first", first), ("second", second)):
        if record.schedule is None:
            lines.append(f"the {place} run has no contact schedule")
    return lines


def _missing_joints(first: RunRecord, second: RunRecord, which: str) -> list[str]:
    names = uncommon_joints(first.motions[which], second.motions[which])
    return [f"joints of one body only: {', '.join(names)}"] if names else []


def _run_block(record: RunRecord, name: str) -> dict[str, Any]:
    body = record.body
    return {
        "run": name,
        "scenario": record.scenario,
        "succeeded": bool(record.summary.get("succeeded", False)),
        "failure": record.summary.get("failure"),
        "duration_s": _duration(record),
        "mass_kg": record.mass,
        "stature_m": None if body is None else body.stature,
    }


def _duration(record: RunRecord) -> float | None:
    if record.schedule is None:
        return None
    return float(record.schedule.instants[-1] - record.schedule.instants[0])


def _duration_difference(first: RunRecord, second: RunRecord) -> float | None:
    durations = _duration(first), _duration(second)
    return None if durations[0] is None or durations[1] is None else durations[1] - durations[0]


def _words(stage: str) -> str:
    return {"point mass": "planned point mass"}.get(stage, f"{stage} motion")


def _key(stage: str) -> str:
    return stage.replace(" ", "_")
