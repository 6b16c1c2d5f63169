"""Marker maps: files that say what the markers of a laboratory mark, where their names do not.

A map is a YAML mapping. Its keys are landmarks of :data:`~manikin.recordings.readers.marker_sets.LANDMARKS`
with one marker each, segments of :data:`~manikin.recordings.readers.marker_sets.SEGMENTS` with the further
markers on them, and ``unused`` with those that mark nothing::

    left_asis: M01
    right_asis: M02
    sacrum: M03
    left_thigh: [M10, M11, M12]
    unused: [M40]

Names of markers are texts, also those that look like numbers. Markers that a map does not name are
recognised by their names.
"""

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from manikin.errors import InputError
from manikin.recordings.readers.marker_sets import LANDMARKS, SEGMENTS, UNUSED
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.text_files import read_text

LONGEST_FILE, MOST_NAMED = 200_000, 60
"""Longest map that is read [characters], and most valid names that a message lists."""


@dataclass(frozen=True, eq=False)
class MarkerMap:
    """What markers mark.

    Attributes:
        source: The file, for messages.
        places: Landmark, segment or :data:`~manikin.recordings.readers.marker_sets.UNUSED` by marker.
    """

    source: str
    places: Mapping[str, str]

    def applied_to(self, recording: MarkerRecording) -> MarkerRecording:
        """The recording with what the map says of its markers.

        A marker is also known without the subject before its name: ``M01`` for ``Anna:M01``. InputError if
        the recording does not have it, or two of that name.
        """
        known = recording.marker_names
        found = dict[str, str]()
        for marker, place in self.places.items():
            same = [name for name in known if name == marker] or [
                name for name in known if name.rpartition(":")[2] == marker
            ]
            if len(same) != 1:
                wrong = f"{self.source}: {place}: marker {marker!r} is {len(same)} times in the recording"
                raise InputError(f"{wrong} {recording.name!r}; valid: {_listed(known)}")
            found[same[0]] = place
        return replace(recording, marker_map=found)


def read_marker_map(path: str | Path) -> MarkerMap:
    """Read a marker map.

    InputError, with the line, if the file cannot be read or is no such mapping, a landmark is not known or
    given twice, or a marker is given twice.
    """
    file = str(path)
    places = dict[str, str]()
    keys = set[str]()
    for key, where, markers, several in _entries(_mapping(file), file):
        if key in keys:
            raise InputError(f"{where}: {key} is given twice; valid: once, with a list of markers")
        keys.add(key)
        if key not in (*LANDMARKS, *SEGMENTS, UNUSED):
            close = difflib.get_close_matches(key, (*LANDMARKS, *SEGMENTS), 3, 0.6)
            valid = ", ".join(close or (*LANDMARKS, *SEGMENTS, UNUSED))
            raise InputError(f"{where}: {key[:40]!r} is no landmark or segment; valid: {valid}")
        if several and key in LANDMARKS:
            raise InputError(f"{where}: {key} is a list; valid: one marker for a landmark")
        for marker in markers:
            if marker in places:
                wrong = f"marker {marker[:40]!r} is given twice, for {places[marker]} and {key}"
                raise InputError(f"{where}: {wrong}; valid: once")
            places[marker] = key
    return MarkerMap(file, places)


def _mapping(file: str) -> yaml.MappingNode:
    """Composed, so that no name is taken for a number or a truth value."""
    valid = "valid: lines of 'landmark: marker'"
    text = read_text(file, "YAML")
    if len(text) > LONGEST_FILE:
        raise InputError(f"{file}: has {len(text)} characters; valid: at most {LONGEST_FILE}")
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = error.problem_mark if isinstance(error, yaml.MarkedYAMLError) else None
        line = "" if mark is None else f":{mark.line + 1}"
        raise InputError(f"{file}{line}: is not valid YAML; {valid}") from None
    except RecursionError:
        raise InputError(f"{file}: is nested too deeply; {valid}") from None
    if not isinstance(node, yaml.MappingNode) or not node.value:
        raise InputError(f"{file}: is no mapping; {valid}")
    return node


def _entries(node: yaml.MappingNode, file: str) -> Iterator[tuple[str, str, tuple[str, ...], bool]]:
    """Key, place in the file, its markers, and whether they are a list."""
    for key, value in node.value:
        where = f"{file}:{key.start_mark.line + 1}"
        several = isinstance(value, yaml.SequenceNode)
        parts = value.value if isinstance(value, yaml.SequenceNode) else [value]
        markers = tuple(part.value for part in parts if isinstance(part, yaml.ScalarNode) and part.value)
        if not isinstance(key, yaml.ScalarNode) or len(markers) != len(parts):
            raise InputError(f"{where}: holds no names; valid: 'landmark: marker', or a list of markers")
        yield key.value, where, markers, several


def _listed(names: tuple[str, ...]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
