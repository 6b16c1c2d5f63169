"""A recorded motion beside the force plates under it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.analysis.measured_motion import MeasuredMotion
from manikin.balance import zero_moment_point
from manikin.contact import ContactSchedule
from manikin.mocap.force_plate import ForcePlate
from manikin.mocap.plate_forces import PlateComparison, compare_with_plates, mass_on_plates, plate_forces
from manikin.mocap.plate_supports import TimingError, timing_errors
from manikin.mocap.plate_torques import TorqueComparison, compare_torques
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_supports import RecordedSupports
from manikin.motion import Motion
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class PlateReport:
    """What plates say of a motion, and how far the motion is from it.

    Attributes:
        vertical_force: (n,) of all plates together [N].
        cop: (n, 2) their centre of pressure [m]; NaN while they are not loaded.
        compared: (n,) whether every support is on a plate, so that the plates tell all there is.
        mass: Of the person, by them [kg]; None where they cannot tell.
        timing: Touch-downs and lift-offs beside those of the plates.
        forces: Errors of forces and centres of pressure of the motion as recorded; None where no foot alone
            was on a plate.
        shifted: The same of it shifted onto its contacts; None as well if no shift was looked for.
        torques: Of the legs, of the motion as recorded; empty where no foot was on a plate of its own.
        shifted_torques: The same of the shifted motion; empty if that is not to be believed.
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

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers (SI); None where there was nothing to compare."""
        forces = self.forces
        errors = [abs(one.error) for one in self.timing]
        return {
            "mass_kg": self.mass,
            "events": len(errors),
            "timing_median_s": float(np.median(errors)) if errors else None,
            "timing_max_s": float(np.max(errors)) if errors else None,
            "vertical_rms_body_weight": None if forces is None else forces.vertical_rms,
            "cop_rms_m": None if forces is None else forces.cop_rms,
            "cop_rms_recorded_m": None if forces is None else forces.cop_rms,
            "cop_rms_shifted_m": None if self.shifted is None else self.shifted.cop_rms,
            "frames": int(self.compared.sum()),
            "single_support_frames": None if forces is None else forces.single_frames,
            "margin_share_positive": None if forces is None else forces.margin_share,
            "torques": _torques(self.torques),
            "torques_shifted": _torques(self.shifted_torques),
        }


def _torques(compared: Sequence[TorqueComparison]) -> dict[str, dict[str, float]]:
    """JSON-ready, by joint."""
    return {
        one.joint: {
            "frames": one.frames,
            "rms_Nm": one.rms,
            "mean_Nm": one.mean,
            "peak_Nm": one.peak,
            "peak_by_plates_Nm": one.peak_by_plates,
        }
        for one in compared
    }


def measured_mass(
    plates: Sequence[ForcePlate], dynamics: RecordedDynamics, schedule: ContactSchedule, start: float
) -> float | None:
    """Mass by the plates [kg]; None where there are none, or they cannot tell.

    Args:
        plates: On the clock of the schedule.
        dynamics: Its motion, of any mass.
        schedule: Its stances.
        start: The schedule's clock at the motion's first instant [s].
    """
    if not plates:
        return None
    return mass_on_plates(dynamics, plate_forces(plates, dynamics.time + start, schedule))


def plate_report(
    plates: Sequence[ForcePlate], supports: RecordedSupports, schedule: ContactSchedule,
    measured: MeasuredMotion, motions: tuple[Motion, Motion | None], mass: float | None,
) -> PlateReport:  # fmt: skip
    """Hold a motion against the plates under it.

    Args:
        plates: At least one, on the clock of the supports.
        supports: Of the motion.
        schedule: Its stances.
        measured: The motion, with the person's mass.
        motions: As recorded, and shifted where that is to be believed, with forces and torques.
        mass: Of the person, by the plates [kg].
    """
    forces = plate_forces(plates, measured.recorded.time + supports.start, schedule)
    height = float(np.mean([plate.origin[2] for plate in plates]))
    with np.errstate(divide="ignore", invalid="ignore"):
        cop = zero_moment_point(forces.wrench, height)
    loaded = forces.wrench[:, 2] > 20.0
    shifted, moved, moved_torques = measured.shifted, None, ()
    if shifted is not None:
        moved = compare_with_plates(shifted.dynamics, shifted.margins, forces, height)
        if motions[1] is not None:
            moved_torques = compare_torques(shifted.dynamics, motions[1], forces)
    return PlateReport(
        forces.wrench[:, 2], np.where(loaded[:, None], cop, np.nan), forces.covered, mass,
        timing_errors(supports, plates),
        compare_with_plates(measured.recorded, measured.recorded_margins, forces, height), moved,
        compare_torques(measured.recorded, motions[0], forces), moved_torques,
    )  # fmt: skip
