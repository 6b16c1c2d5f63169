"""Choosing a motion and a format, and writing the file.

The writers themselves are imported when they are needed, so that a wrong option is
refused at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from manikin.errors import InputError, MotionFileError
from manikin.result_directory import write_result

if TYPE_CHECKING:
    from manikin.motion import Motion
    from manikin.motion.file import MotionFile

FORMATS = ("bvh", "csv")
BVH_RATE = 100.0
"""Samples per second of a BVH file unless the caller says otherwise [Hz]."""


def check_format(name: str) -> None:
    """Refuse an unknown format.

    Raises:
        InputError: If there is no such format.
    """
    if name not in FORMATS:
        raise InputError(f"format is {name!r}; valid: {', '.join(FORMATS)}")


def pick_motion(content: MotionFile, which: str | None = None) -> tuple[str, Motion]:
    """Name and value of the motion wanted; by default the executed one, else the planned one.

    Raises:
        InputError: If the file does not hold it.
    """
    name = which if which is not None else list(content.motions)[-1]
    if name not in content.motions:
        raise InputError(f"motion is {name!r}; valid here: {', '.join(content.motions)}")
    return name, content.motions[name]


def export_motion(
    content: MotionFile,
    source: str | Path,
    format_name: str,
    *,
    out: str | Path | None = None,
    which: str | None = None,
    rate: float | None = None,
) -> Path:
    """Write a motion in another format, atomically.

    Args:
        content: What the motion file holds.
        source: The run directory or motion file it came from.
        format_name: One of :data:`FORMATS`.
        out: File to write; ``motion.FORMAT`` beside the motion file when omitted.
        which: ``"planned"`` or ``"executed"``; see :func:`pick_motion`.
        rate: Samples per second [Hz]; 100 for BVH and every sample for CSV when omitted.

    Returns:
        The file written.

    Raises:
        InputError: If the format, the motion or the rate is not available.
        MotionFileError: If the file cannot be written, or BVH is wanted without a body.
    """
    check_format(format_name)
    _, motion = pick_motion(content, which)
    folder = Path(source) if Path(source).is_dir() else Path(source).parent
    path = Path(out) if out is not None else folder / f"motion.{format_name}"
    text = _text(content, motion, format_name, rate, source)
    return write_result(path, text)


def _text(
    content: MotionFile, motion: Motion, format_name: str, rate: float | None, source: str | Path
) -> str:
    from manikin.export.resample import resample

    if format_name == "csv":
        from manikin.export.csv import to_csv

        return to_csv(resample(motion, rate))
    from manikin.export.bvh import to_bvh

    if content.body is None:
        raise MotionFileError(f"{source}: holds no body; valid: a motion file with a body for bvh")
    return to_bvh(content.body, resample(motion, BVH_RATE if rate is None else rate))
