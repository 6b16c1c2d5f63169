"""A recorded motion beside the force plates under it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.balance import zero_moment_point
from manikin.contact import ContactSchedule
from manikin.mocap.force_plate import ForcePlate
from manikin.mocap.plate_forces import PlateComparison, compare_with_plates, mass_on_plates, plate_forces
from manikin.mocap.plate_supports import TimingError, timing_errors
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins
from manikin.mocap.recorded_supports import RecordedSupports
from manikin.mocap.shifted_motion import LeastShift
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
        forces: Errors of forces and centres of pressure; None where no foot alone was on a plate.
        shifted: The same of the motion shifted onto its contacts.
    """

    vertical_force: FloatArray
    cop: FloatArray
    compared: NDArray[np.bool_]
    mass: float | None
    timing: tuple[TimingError, ...]
    forces: PlateComparison | None
    shifted: PlateComparison | None

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
            "cop_rms_shifted_m": None if self.shifted is None else self.shifted.cop_rms,
            "frames": int(self.compared.sum()),
            "single_support_frames": None if forces is None else forces.single_frames,
            "margin_share_positive": None if forces is None else forces.margin_share,
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
    dynamics: RecordedDynamics, margins: RecordedMargins, shifted: LeastShift, mass: float | None,
) -> PlateReport:  # fmt: skip
    """Hold a motion against the plates under it.

    Args:
        plates: At least one, on the clock of the supports.
        supports: Of the motion.
        schedule: Its stances.
        dynamics: Its forces, with the person's mass.
        margins: Its margins.
        shifted: The motion nearest to it that its contacts can carry.
        mass: Of the person, by the plates [kg].
    """
    measured = plate_forces(plates, dynamics.time + supports.start, schedule)
    height = float(np.mean([plate.origin[2] for plate in plates]))
    with np.errstate(divide="ignore", invalid="ignore"):
        cop = zero_moment_point(measured.wrench, height)
    loaded = measured.wrench[:, 2] > 20.0
    return PlateReport(
        measured.wrench[:, 2], np.where(loaded[:, None], cop, np.nan), measured.covered, mass,
        timing_errors(supports, plates), compare_with_plates(dynamics, margins, measured, height),
        compare_with_plates(shifted.dynamics, shifted.margins, measured, height),
    )  # fmt: skip
