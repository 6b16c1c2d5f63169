"""Markers in TRC files and force plates in MOT and STO files (Motion Analysis, OpenSim).

TRC: one row per frame, tabs in between. The header declares rate, counts and unit, but not which axis points
up; OpenSim's files are y up, x forward, z right. A cell that is empty or ``nan``, or a position of exact
zeros, is a marker that was not seen.

MOT and STO: one row per instant, a name for each column. A plate has three columns of force, ``..._vx`` to
``..._vz``, the point where it acts, ``..._px`` to ``..._pz``, and a moment, ``..._mx`` (or
``ground_torque..._x``) to z; metres and newtons. The moment should be about that point, but some programs
leave it about a fixed point, such as the middle of the plate. As feet press and do not pull, the moment about
the centre of pressure is vertical, which identifies the point.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, frozen_array, skew, wrench_about
from manikin.recordings.readers.markers import (
    LEAST_FORCE,
    ForcePlate,
    MarkerRecording,
    unique_names,
    without_unseen,
)
from manikin.recordings.readers.text_files import (
    check_even,
    metres_per,
    numbers,
    read_text,
    rotation_to_z_up,
    whole_number,
)

FEWEST_PRESSED = 10
"""Loaded samples without which no fixed point of the moments is looked for."""


def read_mot(
    path: str | Path, up: str = "y", moments_about: ArrayLike | None = None
) -> tuple[ForcePlate, ...]:
    """Read the force plates of a MOT or STO file, also those that were never stepped on.

    Args:
        up: The file's axis that points up.
        moments_about: (3,) fixed point of all moments [m], z up; None to find each plate's.

    Raises:
        InputError: If the file is missing, damaged, cut short, uneven in time, holds what is no number
            or no force plate.
    """
    file = str(path)
    fixed = None if moments_about is None else frozen_array(moments_about, "moments_about", (3,))
    turn = rotation_to_z_up(up, file)
    names, table = _mot_table(read_text(path, "MOT"), file)
    if names[0] != "time" or len(table) < 2:
        raise InputError(f"{file}: no column of time with two instants; valid: time first, a row per instant")
    time = table[:, 0]
    step = (time[-1] - time[0]) / (len(time) - 1)
    if not 0.0 < step < np.inf:
        raise InputError(f"{file}: time does not rise; valid: evenly rising instants")
    check_even(time, 1.0 / step, file)
    return tuple(
        _plate(f"{file}: {plate}", [table[:, part] @ turn.T for part in parts], 1.0 / step, time[0], fixed)
        for plate, parts in _mot_plates(names, file).items()
    )


def _plate(
    name: str, parts: Sequence[FloatArray], rate: float, start: float, fixed: FloatArray | None
) -> ForcePlate:
    """A plate of its force, point and moment, turned to z up."""
    force, point, moment = parts
    pressed = force[:, 2] >= LEAST_FORCE
    # Without a force there is no point where it acts; some files say so.
    free = np.isnan(point).any(axis=1) | np.isnan(moment).any(axis=1)
    point, moment = (np.where((free & ~pressed)[:, None], 0.0, values) for values in (point, moment))
    if any(np.isnan(values).any() for values in (force, point, moment)):
        raise InputError(f"{name} has a force that is no number or acts nowhere; valid: finite numbers")
    about = _fixed_point(force[pressed], point[pressed], moment[pressed]) if fixed is None else fixed
    wrenches = wrench_about(np.hstack([force, moment]), -(point if about is None else about))
    surface = point[pressed, 2] if pressed.any() else point[:, 2]
    return ForcePlate(name, wrenches, np.array([0.0, 0.0, np.median(surface)]), rate, float(start))


def _fixed_point(force: FloatArray, point: FloatArray, moment: FloatArray) -> FloatArray | None:
    """(3,) point the moments are about, None for the points where the forces act.

    The fixed point ``c`` is that for which the moments ``m - (p - c) x F`` about the points ``p`` have the
    smallest horizontal parts, by least squares. It is believed if these are less than half as large as
    those of the moments as they stand.
    """
    if len(force) < FEWEST_PRESSED:
        return None
    level = (moment - np.cross(point, force))[:, :2].ravel()
    by_place = -skew(force)[:, :2].reshape(-1, 3)
    fixed, *_ = np.linalg.lstsq(by_place, -level, rcond=None)
    left = np.linalg.norm(level + by_place @ fixed)
    return np.asarray(fixed, dtype=np.float64) if left < 0.5 * np.linalg.norm(moment[:, :2]) else None


def _mot_table(text: str, file: str) -> tuple[list[str], FloatArray]:
    """Names of the columns and their numbers (n, k)."""
    head, mark, rest = text.partition("endheader")
    lines = [line for line in rest.splitlines() if line.strip()]
    if not mark or len(lines) < 2:
        raise InputError(f"{file}: no endheader with columns after it; valid: a MOT or STO file")
    names = lines[0].split()
    rows = [line.split() for line in lines[1:]]
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            wrong = f"{len(row)} numbers for {len(names)} columns"
            raise InputError(f"{file}: row {number}: {wrong}; valid: {len(names)} (is the file cut short?)")
    counts = {"rows": len(rows), "columns": len(names)}
    for line in head.splitlines():  # such as nRows=12 or datarows 12
        key, *number = line.replace("=", " ").split() or [""]
        for name in counts:
            if key.lower() in (f"n{name}", f"data{name}"):
                declared = whole_number(" ".join(number), f"{file}: {key}")
                if declared != counts[name]:
                    wrong = f"{counts[name]} {name} where {declared} are declared"
                    raise InputError(f"{file}: {wrong}; valid: all of them")
    flat = numbers([word for row in rows for word in row], f"{file}: a row", gaps=True)
    return names, flat.reshape(len(rows), len(names))


def _mot_plates(names: list[str], file: str) -> dict[str, list[list[int]]]:
    """Three columns each of force, point and moment of each plate, by the beginning of their names."""
    places = {name: place for place, name in enumerate(names)}
    if len(places) != len(names):
        raise InputError(f"{file}: a column occurs twice; valid: unique names")
    found = {}
    for stem in (name[:-2] for name in names if name.endswith("vx")):
        moments = [f"{stem}m", stem.replace("force", "torque"), stem.replace("force", "moment")]
        moment = next((m for m in moments if f"{m}x" in places), f"{stem}m")
        wanted = [[f"{part}{axis}" for axis in "xyz"] for part in (f"{stem}v", f"{stem}p", moment)]
        missing = [column for part in wanted for column in part if column not in places]
        if missing:
            raise InputError(f"{file}: no column {missing[0][:60]!r}; valid: force, point and moment of each")
        found[stem.strip("_") or "plate"] = [[places[column] for column in part] for part in wanted]
    if not found:
        raise InputError(f"{file}: no columns of a force plate; valid: ground_force_1_vx and so on")
    return found


_HEADER = ("DataRate", "NumFrames", "NumMarkers", "Units")


def read_trc(
    path: str | Path, forces: str | Path | Sequence[ForcePlate] | None = None, up: str = "y"
) -> MarkerRecording:
    """Read a TRC file and the force plates recorded with it.

    Args:
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
    if forces is None:
        beside = Path(path).with_name(f"{Path(path).stem}_grf.mot")
        forces = beside if beside.is_file() else ()
    plates = read_mot(forces, up) if isinstance(forces, str | Path) else tuple(forces)
    return MarkerRecording(Path(path).name, names, positions, rate, float(table[0, 1]), plates)


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
        wrong = f"{frames} frames of {markers} markers at {rate:g} Hz"
        raise InputError(f"{file}: {wrong}; valid: more than none of each")
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
            wrong = f"line {number}: {len(cells)} cells"
            raise InputError(f"{file}: {wrong}; valid: {width} (is the file cut short?)")
        words += [cell if cell.strip() else "nan" for cell in cells[:width]]
    table = numbers(words, f"{file}: a frame", gaps=True).reshape(-1, width)
    if np.any(np.isnan(table[:, :2])):
        raise InputError(f"{file}: a frame without number or time; valid: both in every row")
    return table
