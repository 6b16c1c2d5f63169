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
from dataclasses import replace
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
from manikin.recordings.readers.upward import TURNED, upward_axis

FEWEST_PRESSED = 10
"""Loaded samples without which no fixed point of the moments is looked for."""


def read_mot(
    path: str | Path, up: str = "y", moments_about: ArrayLike | None = None
) -> tuple[ForcePlate, ...]:
    """Read the force plates of a MOT, STO or CSV file, also those that were never stepped on.

    A CSV file has the columns of a MOT file, parted by commas or semicolons, and no header but their names.

    Args:
        up: The file's axis that points up.
        moments_about: (3,) fixed point of all moments [m], z up; None to find each plate's.

    Raises:
        InputError: If the file is missing, damaged, cut short, uneven in time, holds what is no number
            or no force plate.
    """
    return _read_mot(path, up, moments_about)[0]


def _read_mot(
    path: str | Path, up: str, moments_about: ArrayLike | None = None
) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """Plates, and remarks on the file."""
    file = str(path)
    fixed = None if moments_about is None else frozen_array(moments_about, "moments_about", (3,))
    turn = rotation_to_z_up(up, file)
    text = read_text(path, "MOT")
    if Path(path).suffix.lower() == ".csv":  # a line of names and one per instant, parted by commas
        text = "endheader\n" + text.replace(";", " ").replace(",", " ").replace('"', " ")
    names, table, remarks = _mot_table(text, file)
    if names[0] != "time" or len(table) < 2:
        raise InputError(f"{file}: no column of time with two instants; valid: time first, a row per instant")
    time = table[:, 0]
    step = (time[-1] - time[0]) / (len(time) - 1)
    if not 0.0 < step < np.inf:
        raise InputError(f"{file}: time does not rise; valid: evenly rising instants")
    check_even(time, 1.0 / step, file)
    found = tuple(
        _plate(f"{file}: {plate}", [table[:, part] @ turn.T for part in parts], 1.0 / step, time[0], fixed)
        for plate, parts in _mot_plates(names, file).items()
    )
    return found, remarks


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


def _mot_table(text: str, file: str) -> tuple[list[str], FloatArray, tuple[str, ...]]:
    """Names of the columns, their numbers (n, k), and what the header says wrongly."""
    remarks = list[str]()
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
                    told = (
                        f"{Path(file).name}: {counts[name]} {name} where {declared} are declared: read as is"
                    )
                    remarks.append(told)
    flat = numbers([word for row in rows for word in row], f"{file}: a row", gaps=True)
    return names, flat.reshape(len(rows), len(names)), tuple(remarks)


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
    path: str | Path, forces: str | Path | Sequence[ForcePlate] | None = None, up: str | None = None
) -> MarkerRecording:
    """Read a TRC file and the force plates recorded with it.

    A header that counts other frames or markers than there are is read as the data are, with a remark;
    columns without a name are left out.

    Args:
        forces: Force plates or their MOT, STO, CSV or Cortex ``.forces`` file, with the same axis up; None
            for ``NAME_grf.mot`` beside ``NAME.trc``, or else another such file whose name begins with
            ``NAME``. An empty sequence for none.
        up: The file's axis that points up; None for y, or the one along which the person stands.

    Raises:
        InputError: If a file is missing, damaged, uneven in time or holds what is no number; if the unit is
            unknown.
    """
    file, remarks = str(path), list[str]()
    rotation_to_z_up(up or "y", file)
    lines = read_text(path, "TRC").splitlines()
    rate, frames, markers, unit = _header(lines, file)
    names = _names(lines[3], markers, file)
    table = _table(lines[5:], len(names), file)
    for declared, found, what in ((frames, len(table), "frames"), (markers, len(names), "named markers")):
        if declared != found:
            remarks.append(f"the header declares {declared} {what[-7:].strip()}, the file has {found} {what}")
    if np.any(np.diff(table[:, 0]) != 1.0):
        raise InputError(f"{file}: frame numbers do not rise by one; valid: no row missing")
    check_even(table[:, 1], rate, file)
    positions, start = unit * without_unseen(table[:, 2:].reshape(len(table), -1, 3)), float(table[0, 1])
    as_filed = MarkerRecording(Path(path).name, names, positions, rate, start, ())
    axis = up or upward_axis(as_filed) or "+y"
    if up is None and axis != "+y":
        remarks.append(TURNED)
    if forces is None:
        forces = _forces_beside(Path(path), remarks)
    if isinstance(forces, str | Path):
        of_cortex = Path(forces).suffix.lower() == ".forces"
        plates, told = (read_cortex if of_cortex else _read_mot)(forces, axis)
        remarks += told
    else:
        plates = tuple(forces)
    turned = positions @ rotation_to_z_up(axis, file).T
    return replace(as_filed, positions=turned, plates=tuple(plates), remarks=tuple(remarks))


def _forces_beside(path: Path, remarks: list[str]) -> Path | tuple[ForcePlate, ...]:
    """File of force plates of a TRC file; other such files beside it are said not to be read."""
    usual = path.with_name(f"{path.stem}_grf.mot")
    if usual.is_file():
        return usual
    others = sorted(
        one
        for one in path.parent.iterdir()
        if one.suffix.lower() in (".mot", ".sto", ".csv", ".forces") and one.is_file() and _holds_forces(one)
    )
    stem = path.stem.lower()
    mine = [one for one in others if one.stem.lower().startswith(stem)]
    alone = len(others) == 1 and len(list(path.parent.glob("*.[tT][rR][cC]"))) == 1
    if chosen := mine or (others if alone else []):
        remarks.append(f"force plates are those of {chosen[0].name}")
        return chosen[0]
    free = [one for one in others if not _belongs(one)]
    if free:
        remarks.append(
            f"force plates beside, of no name that begins with {path.stem!r}, are not read: "
            + ", ".join(one.name for one in free[:5])
        )
    return ()


def _belongs(forces: Path) -> bool:
    """Whether a TRC file beside it has the beginning of its name."""
    trials = forces.parent.glob("*.[tT][rR][cC]")
    return any(forces.stem.lower().startswith(trial.stem.lower()) for trial in trials)


def _holds_forces(path: Path) -> bool:
    """Whether a file names forces of a plate among its first lines."""
    try:
        with path.open("rb") as file:
            head = file.read(20_000).decode("latin-1").lower()
    except OSError:
        return False
    if path.suffix.lower() == ".csv":
        head = head.split("\n", 1)[0]
        return "vx" in head and head.startswith(("time", '"time"', "\xef\xbb\xbftime"))
    return "[force data]" in head or "vx" in head


def read_cortex(path: str | Path, up: str = "z") -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """Read the force plates of a ``.forces`` file (Motion Analysis Cortex), and remarks on it.

    Per plate force [N], the point where it acts [mm] and the free moment about the vertical [N.mm]; ``up`` is
    the file's axis that points up. InputError if the file is missing or damaged.
    """
    file = str(path)
    turn = rotation_to_z_up(up, file)
    lines = [line for line in read_text(path, "forces").splitlines() if line.strip()]
    head = dict(line.split("=", 1) for line in lines[:4] if "=" in line)
    place = next((k for k, line in enumerate(lines) if line.startswith("#Sample")), None)
    if "SampleRate" not in head or place is None or len(lines) < place + 3:
        raise InputError(
            f"{file}: is no file of forces; valid: [Force Data], SampleRate, #Sample, the samples"
        )
    rate = float(numbers([head["SampleRate"]], f"{file}: SampleRate")[0])
    names = lines[place].split()
    rows = [line.split() for line in lines[place + 1 :]]
    short = next((k for k, row in enumerate(rows, start=1) if len(row) != len(names)), None)
    if short is not None:
        raise InputError(f"{file}: sample {short} has not {len(names)} numbers; valid: as many as names")
    if not rate > 0.0:
        raise InputError(f"{file}: SampleRate is {rate:g}; valid: > 0")
    table = numbers([word for row in rows for word in row], f"{file}: a sample").reshape(len(rows), -1)
    columns, found = {name: table[:, k] for k, name in enumerate(names)}, []
    for number in (name[2:] for name in names if name.startswith("FX")):
        wanted = [f"{part}{number}" for part in ("FX", "FY", "FZ", "X", "Y", "Z", "MZ")]
        if missing := [name for name in wanted if name not in columns]:
            raise InputError(
                f"{file}: no column {missing[0]!r}; valid: force, point and moment of each plate"
            )
        values = np.stack([columns[name] for name in wanted], axis=1)
        moment = np.zeros((len(values), 3))
        moment[:, 2] = 1e-3 * values[:, 6]
        force, point = values[:, :3] @ turn.T, 1e-3 * values[:, 3:6] @ turn.T
        wrenches = wrench_about(np.hstack([force, moment @ turn.T]), -point)
        loaded = force[:, 2] >= LEAST_FORCE
        height = float(np.median(point[loaded, 2] if loaded.any() else point[:, 2]))
        found.append(ForcePlate(f"{file}: plate {number}", wrenches, np.array([0.0, 0.0, height]), rate))
    if not found:
        raise InputError(f"{file}: no columns of a force plate; valid: FX1, FY1 and so on")
    return tuple(found), ()


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
    """Names of the markers: one for every three cells, or as many as declared however they are parted."""
    cells = [cell.strip() for cell in line.split("\t")]
    while cells and not cells[-1]:
        del cells[-1]
    names = cells[2::3]
    if len(cells) < 3 or any(cells[3::3]) or any(cells[4::3]):
        names = [cell for cell in cells if cell][2:] or line.split()[2:]
        names = line.split()[2:] if len(names) != markers else names
        if len(names) != markers:
            raise InputError(
                f"{file}: {len(names)} names for {markers} markers; valid: Frame#, Time, the names"
            )
    if not line.split() or line.split()[0] != "Frame#" or not any(names):
        raise InputError(f"{file}: no names of {markers} markers; valid: Frame#, Time and the names")
    return unique_names(names)


def _table(lines: list[str], markers: int, file: str) -> FloatArray:
    """(n, 2 + 3 markers) numbers, NaN in empty cells; further cells, without a name, are left out."""
    width = 2 + 3 * markers
    rows = [(number, line.split("\t")) for number, line in enumerate(lines, start=6) if line.strip()]
    if rows and all(not cells[0].strip() and len(cells) > 1 for _, cells in rows):  # an empty first column
        rows = [(number, cells[1:]) for number, cells in rows]
    words: list[str] = []
    for number, cells in rows:
        if len(cells) < width:
            wrong = f"line {number}: {len(cells)} cells"
            raise InputError(f"{file}: {wrong}; valid: {width} (is the file cut short?)")
        words += [cell if cell.strip() else "nan" for cell in cells[:width]]
    if not words:
        raise InputError(f"{file}: no frame; valid: at least one row of numbers")
    table = numbers(words, f"{file}: a frame", gaps=True).reshape(-1, width)
    if np.any(np.isnan(table[:, :2])):
        raise InputError(f"{file}: a frame without number or time; valid: both in every row")
    return table
