"""The directory of push maps: every direction is kept as soon as it is known, and need not be searched again.

::

    DIR/map.json               the map asked for, and those it is compared with
    DIR/map.csv                one row per map and direction
    DIR/figures/push_map.png   drawn from the maps

Each file is written atomically.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from manikin.errors import InputError, MotionFileError
from manikin.result_directory import ResultDirectory, to_json
from manikin.simulation import PushMap
from manikin.version import __version__

MAP = "map.json"
TABLE = "map.csv"

RESULTS = ("impulse_Ns", "beyond_Ns", "trials", "bound_Ns")
"""Keys of a map that are found or computed; all others say what was asked."""


def maps_as_dict(maps: Sequence[PushMap]) -> dict[str, Any]:
    """Content of ``map.json``: the first map, the others under ``compared``."""
    first, *others = maps
    return {
        "manikin": __version__, "complete": not any(one.missing for one in maps), **first.as_dict(),
        "compared": [one.as_dict() for one in others],
    }  # fmt: skip


class MapDirectory(ResultDirectory):
    """Reads and writes the files of some maps.

    Attributes:
        maps: As far as they are known.
    """

    kind, marks = "map", (MAP,)

    def __init__(self, path: str | Path, asked: Sequence[PushMap]) -> None:
        """Create the directory, or go on with what an earlier run has found there.

        Args:
            path: The directory.
            asked: Empty maps of what is asked for.

        Raises:
            MotionFileError: If it cannot be written, or holds something that is no map.
            InputError: If it holds maps of something else.
        """
        super().__init__(path)
        self.maps = tuple(asked)
        if (self.path / MAP).exists():
            self.maps = self._taken_over(_read(self.path / MAP))

    def keep(self, maps: Sequence[PushMap]) -> None:
        """Write what is known by now.

        Raises:
            MotionFileError: If it cannot be written.
        """
        self.maps = tuple(maps)
        self.write(TABLE, _table(self.maps))
        self.write(MAP, maps_as_dict(self.maps))

    def _taken_over(self, data: Mapping[str, Any]) -> tuple[PushMap, ...]:
        """Maps of an earlier run.

        Raises:
            InputError: If they are about something else.
        """
        asked = _asked(maps_as_dict(self.maps))
        kept = _asked(data)
        for key in dict.fromkeys((*asked, *kept)):
            if asked.get(key) != kept.get(key):
                there, now = (json.dumps(one.get(key)) for one in (kept, asked))
                what = "other maps are compared there" if key == "compared" else (
                    f"{key} is {there} there and {now} now")  # fmt: skip
                raise InputError(f"{self.path / MAP}: {what}; valid: the same settings, or another directory")
        rest = {key: value for key, value in data.items() if key not in ("manikin", "complete", "compared")}
        try:
            return tuple(PushMap.from_dict(one) for one in (rest, *data["compared"]))
        except (KeyError, TypeError, ValueError):
            raise _damaged(self.path / MAP) from None


def _asked(data: Mapping[str, Any]) -> dict[str, Any]:
    """What a file of maps is about, without what was found; as JSON holds it."""
    one = {key: value for key, value in data.items() if key not in (*RESULTS, "complete", "compared")}
    others = data.get("compared")
    if isinstance(others, list):
        one["compared"] = [_asked(other) for other in others if isinstance(other, Mapping)]
    return json.loads(to_json(one))


def _read(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise _damaged(path) from None
    if not isinstance(data, dict):
        raise _damaged(path)
    return data


def _damaged(path: Path) -> MotionFileError:
    return MotionFileError(f"{path}: is damaged; valid: as written by manikin push --map")


def _table(maps: Sequence[PushMap]) -> str:
    """One row per map and direction; what is not known is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["map", "direction_deg", "impulse_Ns", "beyond_Ns", "bound_Ns"])
    for number, one in enumerate(maps):
        bounds = one.bound or (None,) * len(one.directions)
        for direction, found, bound in zip(one.directions, one.found, bounds, strict=True):
            row = (None, None, bound) if found is None else (found.held, found.beyond, bound)
            writer.writerow([number, direction, *("" if value is None else value for value in row)])
    return text.getvalue()
