"""Markers, force plates and events in C3D files.

The file declares the unit of length, the rates, and the axis that points up on the screen
(``POINT:Y_SCREEN``, z where it is missing). Points that are angles, forces, moments or powers, computed by
other programs, are left out. Events and the first frame are on the clock of the trial from which the file
may be cut.
"""

from pathlib import Path

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, wrench_about
from manikin.recordings.readers.c3d_layout import C3dLayout, c3d_frames, c3d_layout, plate_load
from manikin.recordings.readers.marker_sets import is_known
from manikin.recordings.readers.markers import (
    LEAST_FORCE,
    Event,
    ForcePlate,
    MarkerRecording,
    unique_names,
    without_unseen,
)
from manikin.recordings.readers.skeleton_recording import FARTHEST, Subject
from manikin.recordings.readers.text_files import LARGEST, metres_per, read_content, rotation_to_z_up
from manikin.recordings.readers.upward import turned_upright

NO_PLACES = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "ENERGIES")
"""Parameters of ``POINT`` that list the points which are no places."""

CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
"""Channels of the types of force plates that can be read."""


def read_c3d(path: str | Path, up: str | None = None, plates: bool = True) -> MarkerRecording:
    """Read a C3D file.

    Args:
        up: The file's axis that points up; None for the one that it declares.
        plates: Whether force plates are read.

    Raises:
        InputError: If the file is missing, damaged or cut short, a force plate is of a type that is not
            known or wrongly described.
    """
    file, content = str(path), read_content(path, "C3D")
    layout = c3d_layout(content, file)
    with np.errstate(all="ignore"):  # damaged numbers are found below
        points, channels = c3d_frames(content, layout)
    remarks = list[str]()
    if layout.without_analog_rate:
        remarks.append(
            f"ANALOG:RATE is missing: {layout.rate * layout.samples:g} Hz by the samples of a frame"
        )
    if ("POINT", "RATE") not in layout.parameters:
        remarks.append(f"POINT:RATE is missing: {layout.rate:g} Hz as in the header")
    unit = _unit(layout, points, remarks)
    declared_up = next(iter(layout.texts("POINT", "Y_SCREEN")), "")
    turn = rotation_to_z_up(up or declared_up or "+z", f"{file}: POINT:Y_SCREEN")
    rate, (names, kept) = layout.rate, _markers(layout)
    positions = without_unseen(unit * _finite(points[:, kept], file, "a point") @ turn.T)
    names, positions = _within_reach(names, positions, remarks)
    forces = _plates(channels, layout, unit, turn, remarks) if plates else ()
    recording = MarkerRecording(
        Path(path).name, names, positions, rate, (layout.first_frame - 1) / rate, forces,
        _events(layout), _subject(layout, unit), tuple(remarks),
    )  # fmt: skip
    return recording if up else turned_upright(recording)


FAR_IN_MILLIMETRES = 20.0
"""Usual coordinate above which a number without a unit is in millimetres: no laboratory is as large [m]."""


def _unit(layout: C3dLayout, points: FloatArray, remarks: list[str]) -> float:
    """Unit of length [m], by the size of the numbers where the file names none."""
    declared = next(iter(layout.texts("POINT", "UNITS")), "")
    if declared:
        return metres_per(declared, f"{layout.file}: POINT:UNITS")
    sizes = np.abs(points[np.isfinite(points) & (points != 0.0)])
    unit = "mm" if sizes.size and np.median(sizes) > FAR_IN_MILLIMETRES else "m"
    remarks.append(f"POINT:UNITS is missing: {unit} by the size of the numbers")
    return metres_per(unit, layout.file)


def _within_reach(
    names: tuple[str, ...], positions: FloatArray, remarks: list[str]
) -> tuple[tuple[str, ...], FloatArray]:
    """Without points of no known name that are ever beyond any laboratory: other programs' numbers."""
    with np.errstate(invalid="ignore"):
        far = np.any(np.abs(positions) > FARTHEST, axis=(0, 2))
    others = {name for name, away in zip(names, far, strict=True) if away and not is_known(name)}
    if not others:
        return names, positions
    remarks.append(
        f"points beyond {FARTHEST:g} m, of no known name, are left out: {', '.join(sorted(others))}"
    )
    kept = [k for k, name in enumerate(names) if name not in others]
    return tuple(names[k] for k in kept), positions[:, kept]


def _finite(values: FloatArray, file: str, what: str) -> FloatArray:
    """Values, NaN in gaps, of which none is absurd."""
    if np.any(np.abs(values) > LARGEST):
        raise InputError(f"{file}: {what} beyond {LARGEST:g}; valid: finite numbers")
    return np.asarray(values, dtype=np.float64)


# --- points ------------------------------------------------------------------------------------


def _markers(layout: C3dLayout) -> tuple[tuple[str, ...], list[int]]:
    """Names and indices of the points that are places."""
    labels = layout.texts("POINT", "LABELS")
    for number in range(2, 1 + layout.points // 255 + 1):
        labels += layout.texts("POINT", f"LABELS{number}")
    labels = (labels + [""] * layout.points)[: layout.points]
    others = {name for group in NO_PLACES for name in layout.texts("POINT", group) if name}
    kept = [place for place, label in enumerate(labels) if label not in others]
    if not kept:
        raise layout.error("no point is a place", "at least one marker")
    return unique_names([labels[place] for place in kept]), kept


def _subject(layout: C3dLayout, unit: float) -> Subject:
    """Measures that Plug-in Gait leaves in ``PROCESSING``, in the unit of the points, means of both sides."""
    given = {
        name.lower().replace(" ", ""): layout.numbers(group, name)
        for (group, name), parameter in layout.parameters.items()
        if group == "PROCESSING" and not parameter.is_text and parameter.count
    }

    def measure(factor: float, *names: str) -> float | None:
        found = [float(given[name][0]) for name in names if name in given]
        found = [value for value in found if 0.0 < value < LARGEST]
        return factor * float(np.mean(found)) if found else None

    both = ("kneewidth", "anklewidth", "elbowwidth", "shoulderoffset")
    knee, ankle, elbow, offset = (measure(unit, f"l{name}", f"r{name}") for name in both)
    return Subject(
        measure(1.0, "bodymass"), measure(unit, "height"), knee, ankle, elbow, offset,
        measure(0.5 * unit, "markerdiameter"),
    )  # fmt: skip


def _events(layout: C3dLayout) -> tuple[Event, ...]:
    """Events, whose instants the file holds as minutes and seconds."""
    times = layout.numbers("EVENT", "TIMES")
    if not times.size:
        return ()
    if times.size % 2 or not np.all(np.abs(times) <= LARGEST):
        raise layout.error("EVENT:TIMES are no minutes and seconds", "two finite numbers per event")
    instants = times.reshape(-1, 2) @ [60.0, 1.0]
    labels, contexts = (
        (layout.texts("EVENT", name) + [""] * len(instants))[: len(instants)]
        for name in ("LABELS", "CONTEXTS")
    )
    return tuple(map(Event, labels, contexts, instants.tolist()))


# --- force plates ------------------------------------------------------------------------------


def _has_plates(layout: C3dLayout) -> bool:
    """Whether there are force plates; InputError if they are not described completely."""
    used = layout.integers("FORCE_PLATFORM", "USED")
    count = int(used[0]) if len(used) else 0
    if not count:
        return False
    types = layout.integers("FORCE_PLATFORM", "TYPE")[:count]
    wrong = sorted(set(types.tolist()) - set(CHANNELS))
    if wrong or len(types) < count:
        told = f"force plates of type {wrong}, {len(types)} of {count}"
        raise layout.error(told, "1 to 4, or plates=False")
    for name, each in (("CORNERS", 12), ("ORIGIN", 3)):
        if layout.count("FORCE_PLATFORM", name) < each * count:
            raise layout.error(f"FORCE_PLATFORM:{name} has too few values", f"{each} for each of {count}")
    each, size = max(CHANNELS[kind] for kind in types.tolist()), layout.size("CHANNEL")
    if len(size) != 2 or size[0] < each or size[1] < count:
        raise layout.error(f"FORCE_PLATFORM:CHANNEL is of size {size}", f"({each}, {count})")
    size = layout.size("CAL_MATRIX")
    complete = len(size) == 3 and min(size[:2]) >= 6 and size[2] >= count
    if not complete and (4 in types or (len(size) > 2 and layout.count("FORCE_PLATFORM", "CAL_MATRIX"))):
        raise layout.error(f"FORCE_PLATFORM:CAL_MATRIX is of size {size}", f"(6, 6, {count})")
    return True


def _moment_factor(layout: C3dLayout, channels: list[int]) -> float:
    """Lengths of the file's unit in one of the moments', by the units of a plate's channels (from 0)."""
    lengths = next(iter(layout.texts("POINT", "UNITS")), "mm").lower()
    units = layout.texts("ANALOG", "UNITS")
    declared = {"".join(filter(str.isalpha, units[k].lower())) for k in channels if k < len(units)}
    moments = declared & {"nm", "nmm"}
    if len(moments) != 1 or lengths not in ("m", "mm"):
        return 1.0
    return {("nm", "mm"): 1e3, ("nmm", "m"): 1e-3}.get((moments.pop(), lengths), 1.0)


def _plates(
    channels: FloatArray, layout: C3dLayout, unit: float, turn: FloatArray, remarks: list[str]
) -> tuple[ForcePlate, ...]:  # fmt: skip
    """Plates by their channels (c, n); those whose channels are not in the file are left out, with a remark.

    Moments are as their channels declare where most centres of pressure then lie on the plate, else in the
    file's unit of length.
    """
    if not _has_plates(layout):
        return ()
    types = layout.integers("FORCE_PLATFORM", "TYPE")
    count = int(layout.integers("FORCE_PLATFORM", "USED")[0])
    used = layout.integers("FORCE_PLATFORM", "CHANNEL").reshape(-1, layout.size("CHANNEL")[0]) - 1
    corners, origins = (_finite_reals(layout, name) for name in ("CORNERS", "ORIGIN"))
    force_unit = next(iter(layout.texts("FORCE_PLATFORM", "UNITS")), "N")
    rate = layout.rate
    if force_unit not in ("N", ""):
        raise layout.error(f"force plates in {force_unit[:20]!r}", "N")
    sampled, start, found = rate * layout.samples, (layout.first_frame - 1) / rate, []
    for plate, kind in enumerate(types[:count].tolist()):
        name, mine = f"force plate {plate + 1}", used[plate, : CHANNELS[kind]]
        if mine.min() < 0 or mine.max() >= layout.channels:
            remarks.append(
                f"{name} is not read: its channels are not among the {layout.channels} of the file"
            )
            continue
        calibration = None
        if kind == 4:
            table = _finite_reals(layout, "CAL_MATRIX")
            calibration = table.reshape(layout.size("CAL_MATRIX"), order="F")[:6, :6, plate]
        surface = corners[12 * plate : 12 * plate + 12].reshape(4, 3)
        own = _finite(channels[mine], layout.file, name)
        origin = origins[3 * plate : 3 * plate + 3]
        force, moment = plate_load(kind, own, surface, origin, calibration)
        if kind != 3 and (factor := _moment_factor(layout, mine.tolist())) != 1.0:
            other = plate_load(kind, *_in_lengths(kind, own, calibration, factor, surface, origin))
            if _pressed_inside(*other, surface) >= 0.5:
                force, moment = other
                remarks.append(f"{name}: moments converted by {factor:g} to the unit of length of the points")
        if any(np.isnan(values).any() for values in (force, moment, surface)):
            raise layout.error(f"{name} is described or measured by NaN", "finite numbers")
        surface, where = unit * surface @ turn.T, f"{layout.file}: {name}"
        middle, normal = surface.mean(axis=0), _normal(surface, where)
        wrenches = wrench_about(np.hstack([force @ turn.T, unit * moment @ turn.T]), -middle)
        found.append(ForcePlate(where, wrenches, middle, sampled, start, normal, surface))
    return tuple(found)


def _in_lengths(
    kind: int, channels: FloatArray, calibration: FloatArray | None, factor: float, corners: FloatArray,
    origin: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:  # fmt: skip
    """What :func:`plate_load` takes, with moments times a factor."""
    rows = np.ones(6)
    rows[5 if kind == 1 else slice(3, 6)] = factor
    if calibration is not None:
        return channels, corners, origin, rows[:, None] * calibration
    return rows[:, None] * channels, corners, origin, None


def _pressed_inside(force: FloatArray, moment: FloatArray, corners: FloatArray) -> float:
    """Share of the loaded samples whose centre of pressure is on the plate, by moments about its middle."""
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    normal /= max(float(np.linalg.norm(normal)), 1e-9)
    along = force @ normal
    loaded = np.abs(along) > max(LEAST_FORCE, 0.2 * float(np.abs(along).max(initial=0.0)))
    if not loaded.any():
        return 0.0
    away = np.cross(normal, moment[loaded]) / along[loaded, None]
    reach = 0.5 * float(np.linalg.norm(corners[2] - corners[0]))
    return float(np.mean(np.linalg.norm(away, axis=1) <= reach))


def _finite_reals(layout: C3dLayout, name: str) -> FloatArray:
    """(n,) values of a parameter of the force plates, none absurd."""
    return _finite(layout.numbers("FORCE_PLATFORM", name), layout.file, f"FORCE_PLATFORM:{name}")


def _normal(corners: FloatArray, name: str) -> FloatArray:
    """(3,) upward unit normal of the surface, by its diagonals."""
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    size = float(np.linalg.norm(normal))
    if size < 1e-6:
        raise InputError(f"{name}: its corners enclose no surface; valid: four corners, one after the other")
    return normal * (np.sign(normal[2]) or 1.0) / size
