"""Comparison of two runs: timing, centre of mass, margins and joint angles, phase by phase."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.alignment import PhaseTime, TimingRow, matched, timing_rows
from manikin.runtime.display import Displayed

SAMPLES = 101
"""Instants of each phase at which two centres of mass are compared."""


def com_difference(rows: Sequence[TimingRow], first: ComTrack, second: ComTrack) -> dict[str, Any] | None:
    """Difference of two centres of mass, second less first, at equal shares of the matched phases.

    Returns:
        The ``com`` block of the JSON; None when no phase matches.
    """
    if not (phases := matched(rows)):
        return None
    share = np.linspace(0.0, 1.0, SAMPLES)
    times_first, times_second = (
        np.concatenate([phase.start_s + share * phase.duration_s for phase in of])
        for of in zip(*phases, strict=True)
    )
    gap = second.at(times_second) - first.at(times_first)
    distance = np.linalg.norm(gap, axis=1)
    worst = int(np.argmax(distance))
    return {
        "max_distance_m": float(distance[worst]), "max_at_first_s": float(times_first[worst]),
        "max_at_second_s": float(times_second[worst]), "rms_distance_m": float(np.sqrt(np.mean(distance**2))),
        "mean_difference_m": gap.mean(axis=0).tolist(), "first": com_numbers(first),
        "second": com_numbers(second),
    }  # fmt: skip


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
        one, other = _least(first, row.first), _least(second, row.second)
        gap = _difference(one, other) if comparable else None
        phases.append({"first": one, "second": other, "difference": gap})
    one, other = float(first.margin.min()), float(second.margin.min())
    return {
        "unit": first.margin_unit if comparable else None, "first_unit": first.margin_unit,
        "second_unit": second.margin_unit, "min_first": one, "min_second": other,
        "min_difference": other - one if comparable else None, "phases": phases,
    }  # fmt: skip


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
    """Angles of one hinge in both runs at one key instant, and second less first [deg]."""

    joint: str
    first_deg: float
    second_deg: float
    difference_deg: float


@dataclass(frozen=True)
class PostureDifference:
    """Two postures at matching key instants.

    Attributes:
        first_s, second_s: Key instant of each run [s].
        rms_deg: Root mean square over all common joints [deg].
        largest: The joints that differ most, the largest first.
    """

    first_s: float
    second_s: float
    rms_deg: float
    largest: tuple[JointDifference, ...]


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
    """Compare the angles of the joints that both bodies have, at every matching key instant."""
    common = [name for name in first.joint_names if name in second.joint_names]
    postures = []
    for times in key_instants(rows) if common else []:
        a, b = (_angles(*item, common) for item in zip((first, second), times, strict=True))
        order = np.argsort(-np.abs(b - a), kind="stable")[:LARGEST]
        largest = [JointDifference(common[i], float(a[i]), float(b[i]), float(b[i] - a[i])) for i in order]
        rms = float(np.sqrt(np.mean((b - a) ** 2)))
        postures.append(PostureDifference(*times, rms, tuple(largest)))
    return tuple(postures)


def _angles(motion: Motion, time: float, names: list[str]) -> FloatArray:
    """(joints,) angles of joints at the sample nearest to ``time`` [deg]."""
    places = [7 + motion.joint_names.index(name) for name in names]
    return np.rad2deg(motion.q[int(np.argmin(np.abs(motion.time - time)))][places])


STAGES = ("point mass", "planned", "executed")
"""Stages that are compared: the CoM plan, the planned and the executed motion."""


@dataclass(frozen=True, eq=False, repr=False)
class RunComparison(Displayed):
    """Two runs side by side; differences are second less first.

    Attributes:
        rows: Their phases, aligned by the effectors in contact; empty without schedules.
        postures_of: ``"planned"`` or ``"executed"``, whichever motion the postures are of, or None.
        postures: At the matching key instants.
        unmatched: What could not be compared and why, one line each.
    """

    first: RunRecord
    second: RunRecord
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

    @property
    def matched_phases(self) -> int:
        """Number of phases that both runs have."""
        return len(matched(self.rows))

    def as_dict(self) -> dict[str, Any]:
        """The JSON of ``manikin compare``."""
        shared, keys = shared_tracks(*self.runs), {stage: stage.replace(" ", "_") for stage in STAGES}

        def by_stage(difference: Callable[..., Any]) -> dict[str, Any]:
            known = {keys[stage]: difference(self.rows, *tracks) for stage, tracks in shared.items()}
            return dict.fromkeys(keys.values()) | known

        return {
            "first": _run_block(self.first, self.names[0]), "second": _run_block(self.second, self.names[1]),
            "matched_phases": self.matched_phases, "timing": [row.as_dict() for row in self.rows] or None,
            "duration_difference_s": _difference(*self.durations), "com": by_stage(com_difference),
            "margins": by_stage(margin_difference), "postures_of": self.postures_of,
            "postures": [asdict(posture) for posture in self.postures] or None,
            "unmatched": list(self.unmatched),
        }  # fmt: skip


def compare_runs(first: RunRecord, second: RunRecord) -> RunComparison:
    """Compare two runs as far as both got."""
    rows: tuple[TimingRow, ...] = ()
    if first.schedule is not None and second.schedule is not None:
        rows = timing_rows(first.schedule, second.schedule)
    kinds = [kind for kind in ("executed", "planned") if kind in first.motions and kind in second.motions]
    unmatched = [*_missing_stages(first, second), *_missing_phases(first, second, rows)]
    if not kinds:
        return RunComparison(first, second, rows, None, (), tuple(unmatched))
    motions = first.motions[kinds[0]], second.motions[kinds[0]]
    if alone := sorted(set(motions[0].joint_names) ^ set(motions[1].joint_names)):
        unmatched.append(f"joints of one body only: {', '.join(alone)}")
    postures = posture_differences(rows, *motions)
    return RunComparison(first, second, rows, kinds[0], postures, tuple(unmatched))


def tracks_of(record: RunRecord) -> dict[str, ComTrack]:
    """CoM of a run by stage, see :data:`STAGES`."""
    result = {} if record.plan is None else {"point mass": record.plan}
    return {**result, **(record.tracks if record.motions else {})}


def shared_tracks(first: RunRecord, second: RunRecord) -> dict[str, tuple[ComTrack, ComTrack]]:
    """CoM of both runs for every stage that both reached."""
    item, other = tracks_of(first), tracks_of(second)
    return {stage: (item[stage], other[stage]) for stage in STAGES if stage in item and stage in other}


def _missing_stages(first: RunRecord, second: RunRecord) -> list[str]:
    lines = []
    for place, record, other in (("first", first, second), ("second", second, first)):
        failure = record.summary.get("failure")
        why = f" (it failed in {failure['stage']}: {failure['reason']})" if failure else ""
        missing = [stage for stage in STAGES if stage in tracks_of(other) and stage not in tracks_of(record)]
        lines += [f"the {place} run has no {_words(stage)}{why}" for stage in missing]
    if not tracks_of(first) and not tracks_of(second):
        lines.append("neither run has a centre of mass")
    for stage, (one, two) in shared_tracks(first, second).items():
        if one.margin_unit != two.margin_unit:
            lines.append(f"margins of the {_words(stage)} are in {one.margin_unit} and in {two.margin_unit}")
    return lines


def _missing_phases(first: RunRecord, second: RunRecord, rows: tuple[TimingRow, ...]) -> list[str]:
    lines = []
    for row in rows:
        held = ", ".join(row.supports) or "no contact"
        if row.second is None and row.first is not None:
            lines.append(f"phase {row.first.phase} of the first run ({held}) has no match in the second")
        elif row.first is None and row.second is not None:
            lines.append(f"phase {row.second.phase} of the second run ({held}) has no match in the first")
    for place, record in (("first", first), ("second", second)):
        if record.schedule is None:
            lines.append(f"the {place} run has no contact schedule")
    return lines


def _run_block(record: RunRecord, name: str) -> dict[str, Any]:
    return {
        "run": name, "scenario": record.scenario, "succeeded": bool(record.summary.get("succeeded", False)),
        "failure": record.summary.get("failure"), "duration_s": _duration(record), "mass_kg": record.mass,
        "stature_m": None if record.body is None else record.body.stature,
    }  # fmt: skip


def _duration(record: RunRecord) -> float | None:
    return None if record.schedule is None else record.schedule.duration


def _words(stage: str) -> str:
    return "planned point mass" if stage == "point mass" else f"{stage} motion"
