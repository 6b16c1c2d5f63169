"""Numbers, vectors and placements in the attributes of XML elements."""

from xml.etree.ElementTree import Element

import numpy as np

from manikin.errors import BodyError
from manikin.spatial import FloatArray, rotation_from_rpy


def number(element: Element, key: str, where: str, default: float | None = None) -> float:
    """A finite number.

    Args:
        element: The element.
        key: Its attribute.
        where: For the message.
        default: Value without the attribute; None if it is needed.

    Raises:
        BodyError: If it is missing or no finite number.
    """
    text = element.get(key)
    if text is None and default is not None:
        return default
    return float(_numbers(text, f"{where} {key}", 1)[0])


def vector(element: Element, key: str, where: str, default: FloatArray | None = None) -> FloatArray:
    """(3,) finite numbers, as :func:`number`.

    Raises:
        BodyError: If they are missing or not three finite numbers.
    """
    text = element.get(key)
    if text is None and default is not None:
        return default
    return _numbers(text, f"{where} {key}", 3)


def placement(origin: Element | None, where: str) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) and translation (3,) [m] of an ``<origin>``; the identity without one.

    Raises:
        BodyError: If a number is missing or not finite.
    """
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = vector(origin, "rpy", f"{where} origin", np.zeros(3))
    return rotation_from_rpy(roll, pitch, yaw), vector(origin, "xyz", f"{where} origin", np.zeros(3))


def _numbers(text: str | None, where: str, count: int) -> FloatArray:
    try:
        values = np.array((text or "").split(), dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.all(np.isfinite(values)):
        shown = "missing" if text is None else repr(text[:40])
        raise BodyError(f"{where} is {shown}; valid: {count} finite number{'s' if count > 1 else ''}")
    return values
