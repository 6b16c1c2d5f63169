"""Markers in TRC files (Motion Analysis, OpenSim): text, one row per frame, tabs in between.

The header declares rate, counts and unit; it does not say which axis points up. OpenSim's files are y up,
x forward, z right. A cell that is empty or ``nan``, or a place of exact zeros, is a marker that was not seen.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from manikin.errors import InputError
from manikin.mocap.axes import metres_per, rotation_to_z_up
from manikin.mocap.force_plate import ForcePlate
from manikin.mocap.markers import MarkerRecording, unique_names, without_unseen
from manikin.mocap.mot import read_mot
from manikin.mocap.text import check_even, numbers, read_text, whole_number
from manikin.spatial import FloatArray

_HEADER = ("DataRate", "NumFrames", "NumMarkers", "Units")


def read_trc(
    path: str | Path, forces: str | Path | Sequence[ForcePlate] | None = None, up: str = "y"
) -> MarkerRecording:
    """Read a TRC file and the force plates recorded with it.

    Args:
        path: The markers.
        forces: Force plates or their MOT file, with the same axis up; None for ``NAME_grf.mot`` beside
            ``NAME.trc`` where there is one. An empty sequence for none.
        up: The file's axis that points up.

    Raises:
        InputError: If a file is missing, damaged, cut short, uneven in time or holds what is no number;
            if the unit is unknown.
    """
    file = str(path)
    turn = rotation_to_z_up(up, file)
    lines = read_text(path, "TRC").splitlines()
    rate, frames, markers, unit = _header(lines, file)
    names = _names(lines[3], markers, file)
    table = _table(lines[5:], 2 + 3 * markers, file)
    if len(table) != frames:
        raise InputError(f"{file}: {len(table)} rows for {frames} frames; valid: {frames} (is it cut short?)")
    if np.any(np.diff(table[:, 0]) != 1.0):
        raise InputError(f"{file}: frame numbers do not rise by one; valid: no row missing")
    check_even(table[:, 1], rate, file)
    positions = unit * without_unseen(table[:, 2:].reshape(frames, markers, 3)) @ turn.T
    return MarkerRecording(
        Path(path).name, names, positions, rate, float(table[0, 1]), _plates(Path(path), forces, up)
    )


def _plates(path: Path, forces: str | Path | Sequence[ForcePlate] | None, up: str) -> tuple[ForcePlate, ...]:
    if forces is None:
        beside = path.with_name(f"{path.stem}_grf.mot")
        return read_mot(beside, up) if beside.is_file() else ()
    return read_mot(forces, up) if isinstance(forces, str | Path) else tuple(forces)


def _header(lines: list[str], file: str) -> tuple[float, int, int, float]:
    """Rate [Hz], frames, markers and unit [m] of the first three lines."""
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        raise InputError(f"{file}: is no TRC file; valid: PathFileType, five lines of header, the frames")
    values = dict(zip(lines[1].split(), lines[2].split(), strict=False))
    missing = [key for key in _HEADER if key not in values]
    if missing:
        raise InputError(f"{file}: no {missing[0]} in the header; valid: {', '.join(_HEADER)}")
    rate = float(numbers([values["DataRate"]], f"{file}: DataRate")[0])
    frames, markers = (whole_number(values[key], f"{file}: {key}") for key in ("NumFrames", "NumMarkers"))
    if not (rate > 0.0 and frames and markers):
        raise InputError(
            f"{file}: {frames} frames of {markers} markers at {rate:g} Hz; valid: more than none of each"
        )
    return rate, frames, markers, metres_per(values["Units"], f"{file}: Units")


def _names(line: str, markers: int, file: str) -> tuple[str, ...]:
    cells = [cell.strip() for cell in line.split("\t")]
    names = cells[2::3]
    if cells[0] != "Frame#" or any(names[markers:]) or not all(names[:markers]) or len(names) < markers:
        given = sum(bool(name) for name in names)
        raise InputError(f"{file}: {given} names for {markers} markers; valid: Frame#, Time, {markers} names")
    return unique_names(names[:markers])


def _table(lines: list[str], width: int, file: str) -> FloatArray:
    """(n, width) numbers, NaN in empty cells."""
    words: list[str] = []
    for number, line in enumerate(lines, start=6):
        if not line.strip():
            continue
        cells = line.split("\t")
        if len(cells) < width or any(cell.strip() for cell in cells[width:]):
            raise InputError(
                f"{file}: line {number}: {len(cells)} cells; valid: {width} (is the file cut short?)"
            )
        row = cells[:width]
        if " " in line or not all(row):
            row = [cell if cell.strip() else "nan" for cell in row]
        words += row
    table = numbers(words, f"{file}: a frame", gaps=True).reshape(-1, width)
    if np.any(np.isnan(table[:, :2])):
        raise InputError(f"{file}: a frame without number or time; valid: both in every row")
    return table
