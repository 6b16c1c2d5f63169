"""Readers of BVH, ASF with AMC, C3D, TRC and MOT files."""

from pathlib import Path

from manikin.errors import InputError
from manikin.recordings.readers.acclaim import read_amc
from manikin.recordings.readers.bvh import read_bvh
from manikin.recordings.readers.c3d import read_c3d
from manikin.recordings.readers.marker_map import MarkerMap, read_marker_map
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.opensim import read_trc
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.readers.upward import turned_upright

READERS = {".bvh": read_bvh, ".amc": read_amc, ".c3d": read_c3d, ".trc": read_trc}
PARTS = {".asf": ".amc", ".mot": ".trc", ".sto": ".trc"}
"""Readers by ending; endings of what is read along with a recording, and of the recording."""


def read_recording(
    path: str | Path, frames: tuple[int, int] | None = None, markers: MarkerMap | str | Path | None = None
) -> Recording | MarkerRecording:
    """Read a recording with the reader of its ending, with its defaults.

    Args:
        path: The file: BVH or AMC for a skeleton, C3D or TRC for markers.
        frames: First frame and the one after the last, counted from 0 in the file; None for all.
        markers: Marker map or its file, for names that do not say what is marked.

    Raises:
        InputError: If the ending is unknown, a file cannot be read, it does not have the frames or the
            markers of the map, or holds a skeleton and a map is given.
    """
    ending = Path(path).suffix.lower()
    reader = READERS.get(ending)
    if reader is None and ending in PARTS:
        raise InputError(f"{path}: is part of a recording only; valid: its {PARTS[ending]} file")
    if reader is None:
        raise InputError(f"{path}: no reader for {ending[:40]!r}; valid: {', '.join(READERS)}")
    wanted = read_marker_map(markers) if isinstance(markers, str | Path) else markers
    found: Recording | MarkerRecording = reader(path)
    if wanted is not None:
        if not isinstance(found, MarkerRecording):
            raise InputError(f"{path}: holds a skeleton; valid: a marker map for C3D and TRC files only")
        found = turned_upright(wanted.applied_to(found))
    if frames is None:
        return found
    first, stop = frames
    if not 0 <= first < stop <= len(found):
        raise InputError(f"{path}: frames {first} to {stop}; valid: within 0 to {len(found)}, rising")
    return found.cut(first, stop)
