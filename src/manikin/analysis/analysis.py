"""What was measured of one recording."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.analysis.measured_motion import MeasuredMotion
from manikin.analysis.on_plates import PlateReport
from manikin.balance.limiting import LimitingConstraint
from manikin.body import BodyModel
from manikin.display import Displayed
from manikin.ergonomics import Ergonomics
from manikin.locomotion.segmentation import PathSegments
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import RecordedSupports, SupportPhase
from manikin.motion import Motion
from manikin.spatial import GRAVITY, FloatArray

WHOLE_BODY = "whole-body"


@dataclass(frozen=True, eq=False, repr=False)
class Analysis(Displayed):
    """A recorded motion under the yardsticks of planned ones; instants are on the recording's clock [s].

    Attributes:
        name: What to call it.
        source: The file.
        rate: Frames per second [Hz].
        sex: Table of segment masses that was used.
        found: Reconstruction, not smoothed.
        supports: Of feet, hands and seat.
        motion: As recorded, smoothed, with torques, forces and whole-body margin; its time is 0 at the first
            instant.
        shifted_motion: The same shifted onto its contacts, where that is to be believed; else None.
        point_mass_margin: (n,) margin of the motion as recorded without angular momentum [N.m].
        measured: The motion as recorded, and shifted, with the margins of both.
        limiting: What limits the lowest margin; None if no margin is known.
        cop: (n, 2) centre of pressure that the motion needs [m]; NaN in flight, and below 20 N.
        segments: Holonomic and nonholonomic stretches; None where nobody walks upright.
        ergonomics: Scores, torques against strength, effort; its time is that of the motion.
        plates: Comparison with force plates; None without plates.
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
    segments: PathSegments | None
    ergonomics: Ergonomics
    plates: PlateReport | None
    remarks: tuple[str, ...]
    wall: float

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
        """Of the motion as recorded in a phase [N.m]; None where none is known."""
        known = self.motion.margin[self.frames_of(phase) & np.isfinite(self.motion.margin)]
        return float(known.min()) if known.size else None

    def series(self) -> dict[str, FloatArray]:
        """(n,) columns for a table, by name and unit."""
        columns: dict[str, FloatArray] = {"time_s": self.time}
        for axis, name in enumerate("xyz"):
            columns[f"com_{name}_m"] = self.motion.com[:, axis]
        for axis, name in enumerate("xyz"):
            columns[f"angular_momentum_{name}_kgm2ps"] = self.motion.angular_momentum[:, axis]
        columns |= {
            "margin_Nm": self.motion.margin,
            "point_mass_margin_Nm": self.point_mass_margin,
            "recorded_margin_Nm": self.measured.recorded_margins.whole_body,
            **self._shifted_series(),
            "balance_force_N": self.measured.recorded_margins.body.force,
            "zmp_distance_m": self.measured.recorded_margins.body.zmp_distance,
            "vertical_force_N": self.vertical_force,
            "cop_x_m": self.cop[:, 0],
            "cop_y_m": self.cop[:, 1],
        }
        for number, name in enumerate(self.motion.contact_names):
            columns[f"{name}_support"] = self.motion.support[:, number].astype(np.float64)
            columns[f"{name}_vertical_force_N"] = self.motion.contact_force[:, number, 2]
        if self.plates is not None:
            columns["plates_vertical_force_N"] = self.plates.vertical_force
            columns |= {f"plates_cop_{name}_m": self.plates.cop[:, axis] for axis, name in enumerate("xy")}
        skipped = ("time_s", "margin_Nm")
        return columns | {name: one for name, one in self.ergonomics.series().items() if name not in skipped}

    def _shifted_series(self) -> dict[str, FloatArray]:
        shifted = self.measured.shifted
        if shifted is None:
            return {}
        return {
            "shifted_margin_Nm": shifted.margins.whole_body,
            "shifted_at_floor": shifted.at_floor.astype(np.float64),
            "shift_m": shifted.size,
        }

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers (SI), as ``manikin analyze --json`` prints them."""
        lowest = int(np.argmin(self.com_height))
        supports = self.supports
        return {
            "name": self.name,
            "file": self.source,
            "duration_s": float(self.time[-1] - self.time[0]),
            "frames": len(self.time),
            "rate_hz": self.rate,
            "stature_m": self.body.stature,
            "mass_kg": self.body.own_mass,
            "load_kg": sum(self.body.loads.values()),
            "sex": self.sex,
            "supports": [
                {
                    "effector": one.effector, "start_s": one.start, "end_s": one.end,
                    "start_seen": one.start_seen, "end_seen": one.end_seen, "place_m": one.place.tolist(),
                }
                for one in supports.supports
            ],
            "surfaces_m": list(supports.surfaces),
            "sequence": list(supports.sequence),
            "key_frames_s": list(supports.key_frames),
            "phases": [self._phase(one) for one in supports.phases],
            "phase_durations_s": [one.duration for one in supports.phases],
            "com_height_min_m": float(self.com_height[lowest]),
            "com_height_min_at_s": float(self.time[lowest]),
            "reconstruction_residual_m": {"median": self.found.median, "max": self.found.worst},
            "segments": None if self.segments is None else [
                {"kind": one.kind, "start_s": float(self.time[0]) + one.start,
                 "end_s": float(self.time[0]) + one.end}
                for one in self.segments.segments
            ],
            "margin": self._margin(),
            "force_plates": None if self.plates is None else self.plates.as_dict(),
            "ergonomics": _later(self.ergonomics.as_dict(), self.supports.start),
            "remarks": list(self.remarks),
            "wall_s": self.wall,
        }  # fmt: skip

    def _phase(self, phase: SupportPhase) -> dict[str, Any]:
        shifted, is_floor = self.measured.lowest_shifted(self.frames_of(phase))
        return {
            "start_s": phase.start, "end_s": phase.end, "effectors": list(phase.effectors),
            "margin_min_Nm": self.lowest_margin(phase),
            "shifted_margin_min_Nm": shifted, "shifted_at_floor": is_floor,
        }  # fmt: skip

    def _margin(self) -> dict[str, Any]:
        margin = self.motion.margin
        known, lowest = np.isfinite(margin), None
        if known.any():
            lowest = int(np.nanargmin(margin))
        body, held = self.measured.recorded_margins.body, self.measured.recorded_margins.held
        points = self.point_mass_margin[np.isfinite(self.point_mass_margin)]
        return {
            "form": WHOLE_BODY,
            "motion": "recorded",
            "unit": self.motion.margin_unit,
            "min": None if lowest is None else float(margin[lowest]),
            "at_s": None if lowest is None else float(self.time[lowest]),
            "share_positive": float(np.mean(margin[known] > 0.0)) if known.any() else None,
            "limiting": None if self.limiting is None else self.limiting.description,
            "limiting_contact": None if self.limiting is None else self.limiting.effector,
            "share_known": float(np.mean(known)),
            "share_in_contact": float(np.mean(held)),
            "share_positive_in_contact": self.measured.recorded_margins.balanced,
            "recorded": {
                "share_positive": float(np.mean(self.measured.recorded_margins.whole_body > 0.0)),
                "share_positive_in_contact": self.measured.recorded_margins.balanced,
                "min": float(self.measured.recorded_margins.whole_body.min()),
            },
            "shifted": self.measured.shifted_dict(),
            "force_min_N": float(body.force[held].min()) if held.any() else None,
            "zmp_distance_min_m": body.min_zmp_distance,
            "point_mass_min": float(points.min()) if points.size else None,
            "point_mass_share_positive": float(np.mean(points > 0.0)) if points.size else None,
        }


def _later(numbers: Any, start: float) -> Any:
    """The same with instants, by keys that end in ``at_s``, on a clock that shows ``start`` at their zero."""
    if not isinstance(numbers, dict):
        return numbers
    return {
        key: value + start if key.endswith("at_s") and value is not None else _later(value, start)
        for key, value in numbers.items()
    }
