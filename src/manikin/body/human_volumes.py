"""The ranges of motion of the human hip and shoulder, learnt from recordings.

The file holds computed distances and no recorded data. The recordings are everyday and some less everyday
movements (walks, turns, runs, steps, climbing, crouching, crawling, sitting, lifting) of the following
sources; ``docs/ranges_of_motion.py`` makes it again from them.

* "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding
  from NSF EIA-0196217."
* "Motion capture data: ACCAD / The Ohio State University, Open Motion Project, CC BY 3.0 Unported"

Both sides share a volume: equal angles are mirrored postures. Nobody was asked to move as far as possible,
as in the protocol of the thesis, so the volumes are on the narrow side, most of all for arms overhead and
behind the back.
"""

import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from manikin.atomic import atomic_path
from manikin.body.joint_volume import JointVolume
from manikin.errors import BodyError

FILE = Path(__file__).with_name("human_volumes.npz")
"""Where the shipped volumes are."""

FORMAT = "manikin-joint-volumes-1"
_DIGIT = 1e-4


@cache
def human_volumes() -> Mapping[str, JointVolume]:
    """Volumes of ``"thigh"`` (hip) and ``"upper_arm"`` (shoulder), for our human's hinges."""
    return MappingProxyType(load_volumes(FILE))


def save_volumes(path: str | Path, volumes: Mapping[str, JointVolume], acknowledgement: str) -> None:
    """Write volumes into a NumPy archive, distances to 1e-4 rad.

    Args:
        path: Where to; its folder must exist.
        volumes: By segment, without its side.
        acknowledgement: Whose recordings they were learnt from.

    Raises:
        OSError: If the folder cannot be written to.
    """
    arrays: dict[str, Any] = {}
    for name, volume in volumes.items():
        arrays[f"{name}/origin"], arrays[f"{name}/step"] = volume.origin, np.array(volume.step)
        arrays[f"{name}/distances"] = np.rint(volume.distances / _DIGIT).astype(np.int16)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file, format=np.array(FORMAT), acknowledgement=np.array(acknowledgement), **arrays
        )


def load_volumes(path: str | Path) -> dict[str, JointVolume]:
    """Read volumes that :func:`save_volumes` wrote.

    Raises:
        BodyError: If the file is missing or holds none.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            if str(archive["format"]) != FORMAT:
                raise ValueError(f"format {archive['format']}")
            names = sorted({key.split("/")[0] for key in archive.files if "/" in key})
            return {
                name: JointVolume(
                    archive[f"{name}/origin"], float(archive[f"{name}/step"]),
                    _DIGIT * archive[f"{name}/distances"],
                )
                for name in names
            }  # fmt: skip
    except FileNotFoundError:
        raise BodyError(f"{path}: there is no such file; valid: a file of save_volumes") from None
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())[:100]
        raise BodyError(f"{path}: cannot be read ({reason}); valid: a file of save_volumes") from None
