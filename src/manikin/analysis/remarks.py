"""What a reader of an analysis must know before believing it."""

from typing import TYPE_CHECKING

from manikin.mocap.markers import MarkerRecording
from manikin.mocap.recording import Recording

if TYPE_CHECKING:
    from manikin.analysis.analysis import Analysis

LARGE_RESIDUAL = 0.02
"""Median distance between the body and what was recorded above which the body does not fit [m]."""

SLOW_RATE = 50.0
"""Below this rate instants of supports are as coarse as the frames [Hz]."""

LONG_FLIGHT = 0.5
"""Nobody is without support for longer [s]."""

OTHER_MASS = 0.03
"""Share by which the mass of a person is not that on the plates."""


def remarks_on(analysis: "Analysis", recording: Recording | MarkerRecording) -> tuple[str, ...]:
    """Reasons to doubt the numbers, a line each.

    Args:
        analysis: Whose numbers.
        recording: What they were measured on.
    """
    found, supports, lines = analysis.found, analysis.supports, []
    if found.median > LARGE_RESIDUAL:
        lines.append(
            f"the body does not fit the recording: residual {1e3 * found.median:.0f} mm (median); "
            "are its units, or the names of its markers, right?"
        )
    if found.neutral:
        names = ", ".join(name.replace("_", " ") for name in found.neutral)
        lines.append(f"not recorded, held as in standing: {names}")
    if found.others:
        lines.append(f"{len(found.others)} markers are not used, for their names say nothing known")
    dropped = len(recording) - len(found.time)
    if dropped > 0:
        lines.append(f"{dropped} of {len(recording)} frames at the ends show too little of the person")
    if recording.rate < SLOW_RATE:
        lines.append(
            f"{recording.rate:g} frames per second: instants are known to {0.5e3 / recording.rate:.0f} ms, "
            "and the forces of quick steps are cut off"
        )
    if not supports.supports:
        lines.append("no support was found: nothing rests near the ground for long enough")
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
    mass = None if analysis.plates is None else analysis.plates.mass
    if mass is not None and abs(mass / analysis.body.mass - 1.0) > OTHER_MASS:
        lines.append(
            f"the force plates carry {mass:.1f} kg, not {analysis.body.mass:.1f} kg: forces, torques and "
            f"margins are in proportion to the mass (--mass {mass:.1f} for the plates')"
        )
    if analysis.plates is not None and not analysis.plates.compared.any():
        lines.append("no instant has all supports on force plates: their forces are not compared")
    return tuple(lines)
