"""A recorded motion as it is, and beside it the nearest one that its contacts can carry."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins
from manikin.mocap.shifted_motion import LeastShift


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """A motion as recorded, which is what is measured, and shifted onto its contacts, beside it.

    Attributes:
        recorded: Smoothed, as recorded.
        recorded_margins: Of it.
        shifted: The motion nearest to it that its contacts can carry, whether that one is to be believed or
            not; None if none was looked for.
    """

    recorded: RecordedDynamics
    recorded_margins: RecordedMargins
    shifted: LeastShift | None

    @property
    def believed(self) -> LeastShift | None:
        """The shifted motion if it is to be believed."""
        return self.shifted if self.shifted is not None and self.shifted.believable else None

    def lowest_shifted(self, frames: NDArray[np.bool_] | None = None) -> tuple[float | None, bool | None]:
        """Lowest margin of the shifted motion [N.m], and whether it is the imposed floor.

        A margin that is the floor was put there by the shift: it is no result, and None stands for it.

        Args:
            frames: (n,) the frames looked at; all if None.
        """
        if self.shifted is None:
            return None, None
        margin = self.shifted.margins.whole_body
        known = np.isfinite(margin) if frames is None else frames & np.isfinite(margin)
        if not known.any():
            return None, None
        lowest = int(np.argmin(np.where(known, margin, np.inf)))
        if self.shifted.at_floor[lowest]:
            return None, True
        return float(margin[lowest]), False

    def shifted_dict(self) -> dict[str, Any] | None:
        """JSON-ready numbers of the shifted motion; None if none was looked for."""
        shifted = self.shifted
        if shifted is None:
            return None
        margin, held, at_floor = shifted.margins.whole_body, shifted.margins.held, shifted.at_floor
        lowest, is_floor = self.lowest_shifted()
        there = margin[at_floor]
        return {
            "believed": shifted.believable,
            "share_positive": float(np.mean(margin > 0.0)),
            "share_positive_in_contact": shifted.margins.balanced,
            "rms_m": shifted.rms,
            "max_m": float(shifted.size.max()),
            "floor_m": shifted.floor_length,
            "floor_Nm": shifted.floor,
            "margin_at_floor_Nm": float(np.median(there)) if there.size else None,
            "share_at_floor_in_contact": float(np.mean(at_floor[held])) if held.any() else None,
            "min_at_floor": is_floor,
            "min": lowest,
        }
