"""Results of the analysis of one recording: motions, margins, force plates, remarks."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.analysis.activity import Activity
from manikin.analysis.gait_bands import GaitBand, gait_band
from manikin.analysis.gait_cycles import GaitReport, LegLoads
from manikin.balance import zero_moment_point
from manikin.balance.wrench import LimitingConstraint
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.ergonomics import Ergonomics
from manikin.motion import Motion
from manikin.numerics.spatial import GRAVITY, FloatArray
from manikin.recordings.dynamics.plate_forces import (
    ForceComparison,
    PlateComparison,
    TorqueComparison,
    compare_foot_forces,
    compare_torques,
    compare_with_plates,
    plate_forces,
)
from manikin.recordings.dynamics.recorded_dynamics import RecordedDynamics, RecordedMargins
from manikin.recordings.dynamics.recorded_forces import torques_of
from manikin.recordings.dynamics.shifted_motion import LeastShift
from manikin.recordings.readers.markers import ForcePlate, MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import RecordedSupports, SupportPhase
from manikin.recordings.supports.supports import TimingError, timing_errors
from manikin.runtime.display import Displayed
from manikin.walking.segmentation import PathSegments

LARGE_RESIDUAL, OTHER_MASS = 0.02, 0.03
"""Median distance between the body and what was recorded above which the body does not fit [m], and share by
which the mass of a person is not that on the plates."""

CHILD = 1.4
"""Stature below which tables of adults are said to be used [m]."""

MOST_NAMED = 40
"""Markers that are not used and named in a remark."""

SLOW_RATE, LONG_FLIGHT = 50.0, 0.5
"""Below the first rate instants of supports are as coarse as the frames [Hz]; a flight longer than the second
means a contact that was not recorded [s]."""


def remarks_on(analysis: "Analysis", recording: Recording | MarkerRecording) -> tuple[str, ...]:
    """Reasons to doubt what was measured on a recording, a line each."""
    found, supports, plates, lines = analysis.found, analysis.supports, analysis.plates, []
    lines += recording.remarks if isinstance(recording, MarkerRecording) else ()
    if found.median > LARGE_RESIDUAL:
        lines.append(
            f"the body does not fit the recording: residual {1e3 * found.median:.0f} mm (median); "
            "are its units, or the names of its markers, right?"
        )
    if (stature := analysis.body.stature or CHILD) < CHILD:
        lines.append(
            f"a person of {stature:.2f} m: lengths are the recording's, but shares of the segments' masses "
            "and strength are those of adults"
        )
    if found.neutral:
        names = ", ".join(name.replace("_", " ") for name in found.neutral)
        lines.append(f"not recorded, held as in standing: {names}")
    unseen = _never_seen(recording)
    for names, why in (
        (
            [name for name in found.others if name not in unseen],
            "are not used, for their names say nothing known",
        ),
        ([name for name in found.others if name in unseen], "are in no frame"),
    ):
        if names:
            more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
            lines.append(f"{len(names)} markers {why}: {', '.join(names[:MOST_NAMED])}{more}")
    what = "joints" if isinstance(recording, Recording) else "markers"
    if repaired := [one for one in found.repairs if one.kind not in ("gap", "jump")]:
        names = ", ".join(dict.fromkeys(one.marker for one in repaired))
        runs = f"{len(repaired)} run{'s' if len(repaired) > 1 else ''} of frames"
        lines.append(f"cleaned: {what} off their places in {runs} are not used as recorded: {names}")
    if jumps := [one for one in found.repairs if one.kind == "jump"]:
        names = ", ".join(dict.fromkeys(one.marker for one in jumps))
        frames = ", ".join(map(str, sorted({one.first for one in jumps})[:MOST_NAMED]))
        lines.append(f"joints jump after frames {frames}, where forces and margins are too large: {names}")
    dropped = len(recording) - len(found.time)
    if dropped > 0:
        lines.append(f"{dropped} of {len(recording)} frames at the ends show too little of the person")
    if recording.rate < SLOW_RATE:
        lines.append(
            f"{recording.rate:g} frames per second: instants are known to {0.5e3 / recording.rate:.0f} ms, "
            "and the forces of quick steps are cut off"
        )
    flights = [one.duration for one in supports.phases if not one.effectors]
    if supports.supports and max(flights, default=0.0) > LONG_FLIGHT:
        lines.append(
            f"nothing supports for {max(flights):.2f} s: the person may touch something that is not recorded"
        )
    shifted = analysis.measured.shifted
    if supports.supports and shifted is not None and shifted.solved and not shifted.believable:
        lines.append(
            f"balanced in {100.0 * (shifted.margins.balanced or 0.0):.0f} % of the frames in contact "
            f"if shifted by {1e3 * shifted.rms:.0f} mm (RMS): contacts were not found, or do not carry; "
            "the shifted motion is not to be believed"
        )
    if shifted is not None and not shifted.solved:
        lines.append("no shift onto the contacts was found: the postures jump")
    lines += () if plates is None else plates.remarks
    mass = None if plates is None else plates.mass
    if mass is not None and abs(mass / analysis.body.mass - 1.0) > OTHER_MASS:
        lines.append(
            f"the force plates carry {mass:.1f} kg, not {analysis.body.mass:.1f} kg: forces, torques and "
            f"margins are in proportion to the mass (--mass {mass:.1f} for the plates')"
        )
    if plates is not None and not plates.compared.any():
        lines.append("no instant has all supports on force plates: their forces are not compared")
    return tuple(lines)


def _never_seen(recording: Recording | MarkerRecording) -> set[str]:
    """Markers that are in no frame."""
    if not isinstance(recording, MarkerRecording):
        return set()
    return {recording.marker_names[k] for k in np.flatnonzero(~recording.seen.any(axis=0))}


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """A motion as recorded and smoothed, and the nearest one that its contacts can carry.

    ``shifted`` is the latter, whether it is to be believed or not; None if none was looked for.
    """

    recorded: RecordedDynamics
    recorded_margins: RecordedMargins
    shifted: LeastShift | None

    @property
    def believed(self) -> LeastShift | None:
        """The shifted motion if it is to be believed."""
        return self.shifted if self.shifted is not None and self.shifted.believable else None

    def lowest_shifted(self, frames: NDArray[np.bool_] | None = None) -> tuple[float | None, bool | None]:
        """Lowest margin of the shifted motion [N.m] in some frames (n,) or all; whether it is the floor.

        The imposed floor was put there by the shift: it is no result, and None stands for it.
        """
        if self.shifted is None:
            return None, None
        margin = self.shifted.margins.whole_body
        known = np.isfinite(margin) if frames is None else frames & np.isfinite(margin)
        if not known.any():
            return None, None
        lowest = int(np.argmin(np.where(known, margin, np.inf)))
        is_floor = bool(self.shifted.at_floor[lowest])
        return None if is_floor else float(margin[lowest]), is_floor

    def shifted_dict(self) -> dict[str, Any] | None:
        """JSON-ready numbers of the shifted motion; None if none was looked for."""
        if (shifted := self.shifted) is None:
            return None
        margin, held, at_floor = shifted.margins.whole_body, shifted.margins.held, shifted.at_floor
        (lowest, is_floor), imposed = self.lowest_shifted(), margin[at_floor]
        return {
            "believed": shifted.believable, "share_positive": float(np.mean(margin > 0.0)),
            "share_positive_in_contact": shifted.margins.balanced, "rms_m": shifted.rms,
            "max_m": float(shifted.size.max()), "floor_m": shifted.floor_length, "floor_Nm": shifted.floor,
            "margin_at_floor_Nm": float(np.median(imposed)) if imposed.size else None,
            "share_at_floor_in_contact": float(np.mean(at_floor[held])) if held.any() else None,
            "min_at_floor": is_floor, "min": lowest,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class PlateReport:
    """Forces by plates, and the errors of a motion against them.

    Attributes:
        vertical_force: (n,) of all plates together [N].
        cop: (n, 2) their centre of pressure [m]; NaN while they are not loaded.
        compared: (n,) whether every support is on a plate, so that the plates measure the whole force.
        mass: Of the person, by them [kg]; None where it is not known.
        timing: Touch-downs and lift-offs beside those of the plates.
        forces: Errors of forces and centres of pressure of the motion as recorded; None where no foot alone
            was on a plate. ``shifted`` are those of it shifted onto its contacts, if a shift was looked for.
        torques: Of the legs, of the motion as recorded; empty where no foot was on a plate of its own.
            ``shifted_torques`` are those of the shifted motion, if that is to be believed.
        foot_forces: Of each foot on a plate of its own, of the motion as recorded; ``shifted_foot_forces`` of
            the shifted one, if that is to be believed.
        leg_loads: Torques by the plates, and which feet are on plates of their own.
        remarks: What was taken off the plates' readings, a line each.
    """

    vertical_force: FloatArray
    cop: FloatArray
    compared: NDArray[np.bool_]
    mass: float | None
    timing: tuple[TimingError, ...]
    forces: PlateComparison | None
    shifted: PlateComparison | None
    torques: tuple[TorqueComparison, ...]
    shifted_torques: tuple[TorqueComparison, ...]
    foot_forces: tuple[ForceComparison, ...]
    shifted_foot_forces: tuple[ForceComparison, ...]
    leg_loads: LegLoads
    remarks: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers (SI); None where there was nothing to compare."""
        forces = self.forces
        errors = [abs(one.error) for one in self.timing]
        return {
            "mass_kg": self.mass, "events": len(errors),
            "timing_median_s": float(np.median(errors)) if errors else None,
            "timing_max_s": float(np.max(errors)) if errors else None,
            "vertical_rms_body_weight": None if forces is None else forces.vertical_rms,
            "cop_rms_m": None if forces is None else forces.cop_rms,
            "cop_rms_recorded_m": None if forces is None else forces.cop_rms,
            "cop_rms_shifted_m": None if self.shifted is None else self.shifted.cop_rms,
            "frames": int(self.compared.sum()),
            "single_support_frames": None if forces is None else forces.single_frames,
            "margin_share_positive": None if forces is None else forces.margin_share,
            "torques": _torques(self.torques), "torques_shifted": _torques(self.shifted_torques),
            "foot_forces": _foot_forces(self.foot_forces),
            "foot_forces_shifted": _foot_forces(self.shifted_foot_forces),
        }  # fmt: skip


def _torques(compared: Sequence[TorqueComparison]) -> dict[str, dict[str, float]]:
    """JSON-ready, by joint."""
    return {
        one.joint: {"frames": one.frames, "rms_Nm": one.rms, "mean_Nm": one.mean, "peak_Nm": one.peak,
                    "peak_by_plates_Nm": one.peak_by_plates}
        for one in compared
    }  # fmt: skip


def _foot_forces(compared: Sequence[ForceComparison]) -> dict[str, dict[str, float | None]]:
    """JSON-ready, by component."""
    return {
        one.component.replace(" ", "_"): {
            "frames": one.frames,
            "rms": one.rms,
            "rrmse": one.rrmse,
            "r": one.r,
        }
        for one in compared
    }


def plate_report(
    plates: Sequence[ForcePlate], supports: RecordedSupports, schedule: ContactSchedule,
    measured: MeasuredMotion, motions: tuple[Motion, Motion | None], mass: float | None,
) -> PlateReport:  # fmt: skip
    """Compare a motion with the plates under it, at least one, on the clock of the supports.

    ``motions`` are as recorded, and shifted where that is to be believed, with forces and torques; the mass
    is that of the person by the plates [kg].
    """
    forces = plate_forces(plates, measured.recorded.time + supports.start, schedule)
    height = float(np.mean([plate.origin[2] for plate in plates]))
    with np.errstate(divide="ignore", invalid="ignore"):
        cop = zero_moment_point(forces.wrench, height)
        cop = np.where((forces.wrench[:, 2] > 20.0)[:, None], cop, np.nan)
    shifted, moved, moved_torques, moved_feet = measured.shifted, None, (), ()
    if shifted is not None:
        moved = compare_with_plates(shifted.dynamics, shifted.margins, forces, height)
        if motions[1] is not None:
            moved_torques = compare_torques(shifted.dynamics, motions[1], forces)
            moved_feet = compare_foot_forces(shifted.dynamics, motions[1], forces, height)
    loads = LegLoads(
        torques_of(measured.recorded, forces.effectors, forces.of_effector),
        dict(zip(forces.effectors, forces.alone.T, strict=True)),
    )
    return PlateReport(
        forces.wrench[:, 2], cop, forces.covered, mass, timing_errors(supports, plates),
        compare_with_plates(measured.recorded, measured.recorded_margins, forces, height), moved,
        compare_torques(measured.recorded, motions[0], forces), moved_torques,
        compare_foot_forces(measured.recorded, motions[0], forces, height), moved_feet, loads,
    )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Analysis(Displayed):
    """Measures of a recorded motion, as of planned ones; instants are on the recording's clock [s].

    Attributes:
        rate: Frames per second [Hz].
        sex: Table of segment masses that was used.
        found: Reconstruction, not smoothed.
        motion: As recorded, smoothed, with torques, forces and whole-body margin; its time is 0 at the first
            instant.
        shifted_motion: The same shifted onto its contacts, where that is to be believed; else None.
        point_mass_margin: (n,) margin of the motion as recorded without angular momentum [N.m].
        measured: The motion as recorded, and shifted, with the margins of both.
        limiting: What limits the lowest margin; None if no margin is known.
        cop: (n, 2) centre of pressure that the motion needs [m]; NaN in flight, and below 20 N.
        activity: What the person does.
        gait: Gait cycles and steps; None where the activity has none.
        segments: Holonomic and nonholonomic stretches of an upright walk; None of other activities.
        ergonomics: Scores, torques against strength, effort; its time is that of the motion.
        implausible: Results that no person's motion has, a line each: nothing that follows is to be believed.
        remarks: What a reader must know, a line each.
        wall: Time that it took [s].
    """

    name: str
    source: str
    rate: float
    sex: str
    found: Reconstruction
    supports: RecordedSupports
    motion: Motion
    shifted_motion: Motion | None
    point_mass_margin: FloatArray
    measured: MeasuredMotion
    limiting: LimitingConstraint | None
    cop: FloatArray
    activity: Activity
    gait: GaitReport | None
    segments: PathSegments | None
    ergonomics: Ergonomics
    plates: PlateReport | None
    remarks: tuple[str, ...]
    wall: float
    implausible: tuple[str, ...] = ()

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {
            "name": self.name, "duration": f"{self.motion.duration:.2f} s", "rate": f"{self.rate:g} Hz",
            "stature": f"{self.body.stature or 0.0:.2f} m", "mass": f"{self.body.own_mass:.1f} kg",
        }  # fmt: skip

    @property
    def body(self) -> BodyModel:
        """The human with the person's lengths."""
        return self.found.body

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants [s]."""
        return self.supports.start + self.motion.time

    @cached_property
    def gait_band(self) -> GaitBand:
        """Curves of the people beside whose gait the person's is shown."""
        return gait_band(self.body.stature or 1.7)

    @property
    def weight(self) -> float:
        """[N]."""
        return self.body.mass * GRAVITY

    @cached_property
    def vertical_force(self) -> FloatArray:
        """(n,) of the scene on the body, as the motion needs it [N]; 0 where nothing supports."""
        return self.motion.contact_force[:, :, 2].sum(axis=1)

    @cached_property
    def com_height(self) -> FloatArray:
        """(n,) of the centre of mass above the lowest surface stood on, or the world's zero [m]."""
        return self.motion.com[:, 2] - min(self.supports.surfaces, default=0.0)

    def frames_of(self, phase: SupportPhase) -> NDArray[np.bool_]:
        """(n,) whether a frame is in a phase, the end of which is left out."""
        return (self.time >= phase.start - 1e-9) & (self.time < phase.end - 1e-9)

    def lowest_margin(self, phase: SupportPhase) -> float | None:
        """Lowest margin of the motion as recorded in a phase [N.m]; None where none is known."""
        known = self.motion.margin[self.frames_of(phase) & np.isfinite(self.motion.margin)]
        return float(known.min()) if known.size else None

    def series(self) -> dict[str, FloatArray]:
        """(n,) columns for a table, by name and unit."""
        motion, shifted, margins = self.motion, self.measured.shifted, self.measured.recorded_margins
        momentum, columns = motion.angular_momentum, {"time_s": self.time}
        columns |= {f"com_{name}_m": motion.com[:, axis] for axis, name in enumerate("xyz")}
        columns |= {f"angular_momentum_{name}_kgm2ps": momentum[:, axis] for axis, name in enumerate("xyz")}
        columns |= {
            "margin_Nm": motion.margin, "point_mass_margin_Nm": self.point_mass_margin,
            "recorded_margin_Nm": margins.whole_body,
        }  # fmt: skip
        if shifted is not None:
            columns["shifted_margin_Nm"] = shifted.margins.whole_body
            columns["shifted_at_floor"] = shifted.at_floor.astype(np.float64)
            columns["shift_m"] = shifted.size
        columns |= {
            "balance_force_N": margins.body.force, "zmp_distance_m": margins.body.zmp_distance,
            "vertical_force_N": self.vertical_force, "cop_x_m": self.cop[:, 0], "cop_y_m": self.cop[:, 1],
        }  # fmt: skip
        for number, name in enumerate(motion.contact_names):
            columns[f"{name}_support"] = motion.support[:, number].astype(np.float64)
            columns[f"{name}_vertical_force_N"] = motion.contact_force[:, number, 2]
        if self.plates is not None:
            columns["plates_vertical_force_N"] = self.plates.vertical_force
            columns |= {f"plates_cop_{name}_m": self.plates.cop[:, axis] for axis, name in enumerate("xy")}
        skipped = ("time_s", "margin_Nm")
        return columns | {name: one for name, one in self.ergonomics.series().items() if name not in skipped}

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers (SI), as ``manikin analyze --json`` prints them."""
        lowest, start, supports = int(np.argmin(self.com_height)), float(self.time[0]), self.supports
        return {
            "name": self.name, "file": self.source,
            "duration_s": float(self.time[-1] - self.time[0]), "frames": len(self.time), "rate_hz": self.rate,
            "stature_m": self.body.stature, "mass_kg": self.body.own_mass,
            "load_kg": sum(self.body.loads.values()), "sex": self.sex,
            "supports": [
                {"effector": one.effector, "start_s": one.start, "end_s": one.end,
                 "start_seen": one.start_seen, "end_seen": one.end_seen, "place_m": one.place.tolist()}
                for one in supports.supports
            ],
            "surfaces_m": list(supports.surfaces), "sequence": list(supports.sequence),
            "key_frames_s": list(supports.key_frames),
            "phases": [self._phase(one) for one in supports.phases],
            "phase_durations_s": [one.duration for one in supports.phases],
            "com_height_min_m": float(self.com_height[lowest]),
            "com_height_min_at_s": float(self.time[lowest]),
            "reconstruction_residual_m": {"median": self.found.median, "max": self.found.worst},
            "activity": self.activity.as_dict(), "gait": self._gait(),
            "segments": None if self.segments is None else [
                {"kind": one.kind, "start_s": start + one.start, "end_s": start + one.end}
                for one in self.segments.segments
            ],
            "margin": self._margin(),
            "force_plates": None if self.plates is None else self.plates.as_dict(),
            "ergonomics": _later(self.ergonomics.as_dict(), self.supports.start),
            "cleaning": [
                {"marker": one.marker, "kind": one.kind, "other": one.other or None,
                 "first_frame": one.first, "stop_frame": one.stop,
                 "start_s": start + (one.first - self.found.first_frame) / self.rate,
                 "end_s": start + (one.stop - self.found.first_frame) / self.rate,
                 "distance_m": one.distance, "outcome": one.outcome}
                for one in self.found.repairs
            ],
            "implausible": list(self.implausible), "remarks": list(self.remarks), "wall_s": self.wall,
        }  # fmt: skip

    def _gait(self) -> dict[str, Any] | None:
        if self.gait is None:
            return None
        return self.gait.as_dict() | {
            "people": self.gait_band.as_dict(self.gait) if self.gait.cycles else None
        }

    def _phase(self, phase: SupportPhase) -> dict[str, Any]:
        shifted, is_floor = self.measured.lowest_shifted(self.frames_of(phase))
        return {
            "start_s": phase.start, "end_s": phase.end, "effectors": list(phase.effectors),
            "margin_min_Nm": self.lowest_margin(phase),
            "shifted_margin_min_Nm": shifted, "shifted_at_floor": is_floor,
        }  # fmt: skip

    def _margin(self) -> dict[str, Any]:
        margin = self.motion.margin
        known = np.isfinite(margin)
        lowest = int(np.nanargmin(margin)) if known.any() else None
        recorded, limiting = self.measured.recorded_margins, self.limiting
        body, held = recorded.body, recorded.held
        points = self.point_mass_margin[np.isfinite(self.point_mass_margin)]
        return {
            "form": "whole-body", "motion": "recorded", "unit": self.motion.margin_unit,
            "min": None if lowest is None else float(margin[lowest]),
            "at_s": None if lowest is None else float(self.time[lowest]),
            "share_positive": float(np.mean(margin[known] > 0.0)) if known.any() else None,
            "limiting": limiting and limiting.description, "limiting_contact": limiting and limiting.effector,
            "share_known": float(np.mean(known)), "share_in_contact": float(np.mean(held)),
            "share_positive_in_contact": recorded.balanced,
            "recorded": {
                "share_positive": float(np.mean(recorded.whole_body > 0.0)),
                "share_positive_in_contact": recorded.balanced, "min": float(recorded.whole_body.min()),
            },
            "shifted": self.measured.shifted_dict(),
            "force_min_N": float(body.force[held].min()) if held.any() else None,
            "zmp_distance_min_m": body.min_zmp_distance,
            "point_mass_min": float(points.min()) if points.size else None,
            "point_mass_share_positive": float(np.mean(points > 0.0)) if points.size else None,
        }  # fmt: skip


def _later(numbers: Any, start: float, *, instants: bool = False) -> Any:
    """Numbers with instants, below keys ending in ``at_s``, on a clock that shows ``start`` at their zero."""
    if isinstance(numbers, dict):
        return {
            key: _later(value, start, instants=instants or key.endswith("at_s"))
            for key, value in numbers.items()
        }
    return numbers + start if instants and numbers is not None else numbers
