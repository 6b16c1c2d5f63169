"""Comparison of two runs: timing, centre of mass, margins and joint angles, phase by phase."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manikin.contact import Stance
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.alignment import (
    PhasePair,
    PhaseTime,
    TimingRow,
    align_phases,
    matched,
    timing_rows,
)
from manikin.runtime.display import Displayed

SAMPLES = 101
"""Instants of each phase at which two centres of mass are compared."""


def matched_times(rows: Sequence[TimingRow]) -> tuple[FloatArray, FloatArray]:
    """(n,) instants of both runs at the same share of each phase that both have [s]."""
    share, empty = np.linspace(0.0, 1.0, SAMPLES), np.zeros(0)
    times = [(a.start_s + share * a.duration_s, b.start_s + share * b.duration_s) for a, b in matched(rows)]
    return np.concatenate([empty, *(a for a, _ in times)]), np.concatenate([empty, *(b for _, b in times)])


def com_difference(rows: Sequence[TimingRow], first: ComTrack, second: ComTrack) -> dict[str, Any] | None:
    """Difference of two centres of mass, second less first, at equal shares of the matched phases.

    Returns:
        The ``com`` block of the JSON; None when no phase matches.
    """
    times_first, times_second = matched_times(rows)
    if not len(times_first):
        return None
    gap = second.at(times_second) - first.at(times_first)
    distance = np.linalg.norm(gap, axis=1)
    worst = int(np.argmax(distance))
    return {
        "max_distance_m": float(distance[worst]),
        "max_at_first_s": float(times_first[worst]),
        "max_at_second_s": float(times_second[worst]),
        "rms_distance_m": float(np.sqrt(np.mean(distance**2))),
        "mean_difference_m": gap.mean(axis=0).tolist(),
        "first": com_numbers(first),
        "second": com_numbers(second),
    }


def com_numbers(track: ComTrack) -> dict[str, Any]:
    """Size of one CoM motion."""
    steps = np.linalg.norm(np.diff(track.position, axis=0), axis=1)
    return {
        "path_length_m": float(steps.sum()),
        "height_min_m": float(track.position[:, 2].min()),
        "height_max_m": float(track.position[:, 2].max()),
        "speed_max_mps": float(np.linalg.norm(track.velocity, axis=1).max()),
    }


def margin_difference(rows: Sequence[TimingRow], first: ComTrack, second: ComTrack) -> dict[str, Any]:
    """Smallest margins of two runs in each phase; second less first.

    Returns:
        One entry of the ``margins`` block of the JSON. Differences are None where a run does not
        have the phase, or the two margins have different units.
    """
    comparable = first.margin_unit == second.margin_unit
    phases = []
    for row in rows:
        least = _least(first, row.first), _least(second, row.second)
        phases.append(
            {"first": least[0], "second": least[1], "difference": _difference(*least) if comparable else None}
        )
    whole = float(first.margin.min()), float(second.margin.min())
    return {
        "unit": first.margin_unit if comparable else None,
        "first_unit": first.margin_unit,
        "second_unit": second.margin_unit,
        "min_first": whole[0],
        "min_second": whole[1],
        "min_difference": whole[1] - whole[0] if comparable else None,
        "phases": phases,
    }


def _least(track: ComTrack, phase: PhaseTime | None) -> float | None:
    if phase is None:
        return None
    inside = (track.time >= phase.start_s - 1e-9) & (track.time < phase.end_s - 1e-9)
    return float(track.margin[inside].min()) if np.any(inside) else None


def _difference(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else second - first


LARGEST = 5
"""Joints named per key instant."""


@dataclass(frozen=True)
class JointDifference:
    """One joint at one key instant.

    Attributes:
        joint: Name of the hinge.
        first_deg: Angle in the first run [deg].
        second_deg: Angle in the second run [deg].
    """

    joint: str
    first_deg: float
    second_deg: float

    @property
    def difference_deg(self) -> float:
        """Second less first [deg]."""
        return self.second_deg - self.first_deg

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self) | {"difference_deg": self.difference_deg}


@dataclass(frozen=True)
class PostureDifference:
    """Two postures at matching key instants.

    Attributes:
        first_s: Key instant of the first run [s].
        second_s: Key instant of the second run [s].
        rms_deg: Root mean square over all common joints [deg].
        largest: The joints that differ most, the largest first.
    """

    first_s: float
    second_s: float
    rms_deg: float
    largest: tuple[JointDifference, ...]

    def as_dict(self) -> dict[str, Any]:
        """One entry of the ``postures`` block of the JSON."""
        return asdict(self) | {"largest": [joint.as_dict() for joint in self.largest]}


def key_instants(rows: Sequence[TimingRow]) -> list[tuple[float, float]]:
    """Key instants of both runs [s]: the start of each matched phase, and its end where the next differs."""
    instants: list[tuple[float, float]] = []
    for first, second in matched(rows):
        start = first.start_s, second.start_s
        if not instants or instants[-1] != start:
            instants.append(start)
        instants.append((first.end_s, second.end_s))
    return instants


def posture_differences(
    rows: Sequence[TimingRow], first: Motion, second: Motion
) -> tuple[PostureDifference, ...]:
    """Compare the angles of the joints that both bodies have, at every matching key instant.

    Args:
        rows: Aligned phases.
        first: Motion of the first run.
        second: Motion of the second one.
    """
    common = [name for name in first.joint_names if name in second.joint_names]
    if not common:
        return ()
    places = [[7 + motion.joint_names.index(name) for name in common] for motion in (first, second)]
    return tuple(
        _postures_difference(
            common, times, _angles(first, places[0], times[0]), _angles(second, places[1], times[1])
        )
        for times in key_instants(rows)
    )


def _angles(motion: Motion, places: list[int], time: float) -> FloatArray:
    """(joints,) angles at the sample nearest to ``time`` [deg]."""
    return np.rad2deg(motion.q[int(np.argmin(np.abs(motion.time - time)))][places])


def _postures_difference(
    names: list[str], times: tuple[float, float], first: FloatArray, second: FloatArray
) -> PostureDifference:
    gap = second - first
    order = np.argsort(-np.abs(gap), kind="stable")[:LARGEST]
    largest = tuple(JointDifference(names[i], float(first[i]), float(second[i])) for i in order)
    return PostureDifference(times[0], times[1], float(np.sqrt(np.mean(gap**2))), largest)


STAGES = ("point mass", "planned", "executed")
"""Stages that are compared: the CoM plan, the planned and the executed motion."""


@dataclass(frozen=True, eq=False, repr=False)
class RunComparison(Displayed):
    """Two runs side by side; differences are second less first.

    Attributes:
        first, second: The runs.
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
        """Names of the runs; numbered when their directories have the same name."""
        if self.first.label != self.second.label:
            return self.first.label, self.second.label
        return f"{self.first.label} (1)", f"{self.second.label} (2)"

    @property
    def durations(self) -> tuple[float | None, float | None]:
        """Time from the first to the last key instant of each run [s]."""
        return _duration(self.first), _duration(self.second)

    def as_dict(self) -> dict[str, Any]:
        """The JSON of ``manikin compare``."""
        shared = shared_tracks(*self.runs)
        return {
            "first": _run_block(self.first, self.names[0]),
            "second": _run_block(self.second, self.names[1]),
            "matched_phases": sum(pair.matched for pair in self.pairs),
            "timing": [row.as_dict() for row in self.rows] or None,
            "duration_difference_s": _difference(*self.durations),
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
    """Compare two runs as far as both got."""
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
    result = {} if record.plan is None else {"point mass": record.plan}
    return {**result, **(record.tracks if record.motions else {})}


def shared_tracks(first: RunRecord, second: RunRecord) -> dict[str, tuple[ComTrack, ComTrack]]:
    """CoM of both runs for every stage that both reached."""
    item, other = tracks_of(first), tracks_of(second)
    return {stage: (item[stage], other[stage]) for stage in STAGES if stage in item and stage in other}


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
    shared = shared_tracks(first, second)
    for stage, (item, two) in shared.items():
        if item.margin_unit != two.margin_unit:
            lines.append(f"margins of the {_words(stage)} are in {item.margin_unit} and in {two.margin_unit}")
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
    names = sorted(set(first.motions[which].joint_names) ^ set(second.motions[which].joint_names))
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


def _words(stage: str) -> str:
    return {"point mass": "planned point mass"}.get(stage, f"{stage} motion")


def _key(stage: str) -> str:
    return stage.replace(" ", "_")
