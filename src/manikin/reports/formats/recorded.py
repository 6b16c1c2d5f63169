"""A motion as a recording: virtual markers, contact forces and events as TRC, MOT and C3D files.

TRC and MOT have OpenSim's axes: x forward, y up, z right; millimetres, newtons and metres. C3D has z up and
millimetres. Of a contact that is loaded from below the force acts at the centre of pressure, about which the
moment is vertical; of others at the contact's own origin.
"""

from collections.abc import Mapping
from io import StringIO
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.motion.motion import point_paths
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.markers import LEAST_FORCE
from manikin.recordings.virtual_markers import marker_paths, virtual_markers
from manikin.reports.formats.c3d_content import c3d_content

TO_OPENSIM: FloatArray = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation of our world's axes to OpenSim's: X = x (forward), Y = z (up), Z = -y (right)."""
TO_OPENSIM.setflags(write=False)

MILLIMETRES = 1e3
AROUND = 0.2
"""How far the rectangle of a force plate goes beyond the places of its contact [m]."""
FARTHEST_PRESSURE = 0.5
"""Farther than this from a contact's origin no centre of pressure is believed [m]."""


def rate_of(motion: Motion) -> float:
    """Samples per second of a motion that is evenly sampled [Hz]; 100 of a single sample."""
    return 100.0 if len(motion.time) < 2 else (len(motion.time) - 1) / motion.duration


def to_trc(body: BodyModel, motion: Motion) -> str:
    """Text of a TRC file of the virtual markers of a motion at one rate.

    Raises:
        InputError: If the body is no human.
    """
    markers, rate = virtual_markers(body), rate_of(motion)
    places = MILLIMETRES * marker_paths(body, markers, motion.q) @ TO_OPENSIM.T
    count, width = len(motion.time), len(markers)
    text = StringIO()
    text.write("PathFileType\t4\t(X/Y/Z)\tmotion.trc\n")
    text.write("DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t")
    text.write(f"OrigNumFrames\n{rate:.9g}\t{rate:.9g}\t{count}\t{width}\tmm\t{rate:.9g}\t1\t{count}\n")
    text.write("Frame#\tTime\t" + "\t\t\t".join(marker.name for marker in markers) + "\t\t\n")
    text.write("\t\t" + "\t".join(f"{axis}{k}" for k in range(1, width + 1) for axis in "XYZ") + "\n\n")
    table = np.column_stack([np.arange(1, count + 1), motion.time, places.reshape(count, -1)])
    np.savetxt(text, table, fmt=["%d", "%.9g", *["%.6f"] * (3 * width)], delimiter="\t")
    return text.getvalue()


def contact_loads(body: BodyModel, motion: Motion) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
    """Force (n, 3) [N], where it acts (n, 3) [m] and moment about that (n, 3) [N.m] of each contact."""
    paths = dict(zip(motion.contact_names, point_paths(body, motion.q, motion.contact_names), strict=True))
    loads = {}
    for number, name in enumerate(motion.contact_names):
        active = motion.support[:, number, None]
        force, moment = (
            np.where(active, motion.contact_force[:, number, part], 0.0) for part in (np.s_[:3], np.s_[3:])
        )
        force, moment = np.nan_to_num(force), np.nan_to_num(moment)
        pressed = force[:, 2] >= LEAST_FORCE
        upward = np.where(pressed, force[:, 2], 1.0)
        shift = np.stack([-moment[:, 1] / upward, moment[:, 0] / upward, np.zeros(len(upward))], axis=1)
        near = pressed & (np.linalg.norm(shift, axis=1) <= FARTHEST_PRESSURE)
        shift = np.where(near[:, None], shift, 0.0)
        loads[name] = (force, paths[name] + shift, moment - np.cross(shift, force))
    return loads


def loads_mot(body: BodyModel, motion: Motion) -> str:
    """Text of a MOT file of the contact forces, columns ``CONTACT_force_vx`` and so on."""
    names, columns = ["time"], [motion.time]
    for contact, parts in contact_loads(body, motion).items():
        for letter, values in zip(("force_v", "force_p", "torque_"), parts, strict=True):
            names += [f"{contact}_{letter}{axis}" for axis in "xyz"]
            columns += list(TO_OPENSIM @ values.T)
    return storage_text("contact forces", names, np.column_stack(columns), degrees=False)


def storage_text(title: str, names: list[str], table: FloatArray, *, degrees: bool) -> str:
    """Text of a MOT or STO file; the first column is the time."""
    text = StringIO()
    text.write(f"{title}\nversion=1\nnRows={len(table)}\nnColumns={len(names)}\n")
    text.write(f"inDegrees={'yes' if degrees else 'no'}\nendheader\n" + "\t".join(names) + "\n")
    np.savetxt(text, table, fmt="%.10g", delimiter="\t")
    return text.getvalue()


def contact_events(motion: Motion) -> list[tuple[str, str, float]]:
    """Label, side and instant [s] of each contact that is made or broken, as gait laboratories call them."""
    found = []
    for number, name in enumerate(motion.contact_names):
        change = np.diff(motion.support[:, number].astype(int))
        side, _, part = name.partition("_")
        context = side.capitalize() if side in ("left", "right") else "General"
        words = ("Foot Strike", "Foot Off") if part == "foot" else ("Contact", "Release")
        found += [
            (words[0 if change[k] > 0 else 1], context, float(motion.time[k + 1]))
            for k in np.flatnonzero(change).tolist()
        ]
    return sorted(found, key=lambda event: event[2])


def to_c3d(body: BodyModel, motion: Motion) -> bytes:
    """Content of a C3D file: virtual markers, a force plate of type 2 for each contact, events.

    Raises:
        InputError: If the body is no human, or the motion has too many samples.
    """
    markers, rate = virtual_markers(body), rate_of(motion)
    places = MILLIMETRES * marker_paths(body, markers, motion.q)
    groups: dict[str, dict[str, Any]] = {
        "POINT": {
            "LABELS": [marker.name for marker in markers], "UNITS": ["mm"],
            "DESCRIPTIONS": [marker.segment for marker in markers], "X_SCREEN": ["+X"], "Y_SCREEN": ["+Z"],
        },
    }  # fmt: skip
    channels, plates = _plates(contact_loads(body, motion))
    if events := contact_events(motion):
        labels, contexts, instants = zip(*events, strict=True)
        minutes = np.floor(np.array(instants) / 60.0)
        groups["EVENT"] = {
            "USED": np.int16(len(events)), "LABELS": labels, "CONTEXTS": contexts,
            "TIMES": np.stack([minutes, np.array(instants) - 60.0 * minutes]),
        }  # fmt: skip
    channels = channels if len(channels) else np.zeros((len(places), 0))
    return c3d_content(places, channels, rate, groups | plates)


def _plates(
    loads: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
) -> tuple[FloatArray, dict[str, dict[str, Any]]]:
    """Channels (n, c) and parameters of a plate around the places of each contact.

    Its x points forward, y right, z down, as plates are built.
    """
    turn = np.diag([1.0, -1.0, -1.0])
    channels, corners = list[FloatArray](), list[FloatArray]()
    for force, place, moment in loads.values():
        used = place[np.any(force != 0.0, axis=1)]
        used = used if len(used) else place
        low, high = used.min(axis=0) - AROUND, used.max(axis=0) + AROUND
        middle = np.array([*(low + high)[:2] / 2.0, np.median(used[:, 2])])
        signs = np.array([[1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
        corners.append(MILLIMETRES * (middle + signs * (high - low) / 2.0))
        about = moment + np.cross(place - middle, force)
        channels += [force @ turn, MILLIMETRES * about @ turn]
    count = len(loads)
    if not count:
        return np.zeros((0, 0)), {}
    plates = {
        "USED": np.int16(count), "TYPE": np.full(count, 2), "ZERO": np.array([1, 0]), "UNITS": ["N"],
        "CORNERS": np.array(corners).transpose(2, 1, 0), "ORIGIN": np.zeros((3, count)),
        "CHANNEL": np.arange(1, 6 * count + 1).reshape(count, 6).T,
    }  # fmt: skip
    analog = {
        "LABELS": [f"{name}.{kind}{axis}" for name in loads for kind in "FM" for axis in "xyz"],
        "UNITS": (["N"] * 3 + ["Nmm"] * 3) * count,
    }
    return np.hstack(channels), {"ANALOG": analog, "FORCE_PLATFORM": plates}
