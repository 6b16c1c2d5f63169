"""Frame of a scenario's task, and the same file at another place.

Planning, control and simulation happen in the *task frame*: its origin is below the body at the start,
its x axis points where the body faces there, its heights are those of the file.  Coordinates in it are
rounded to a grid, far finer than anything measured, so that a scenario written elsewhere in the world
gives the same numbers to the last bit, and so the same plan.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from manikin.numerics.spatial import IDENTITY, PlanarTransform
from manikin.scenarios.sections.support_sections import ContactSection
from manikin.scenarios.sections.task_sections import StateSection
from manikin.scenarios.validation import FrameMoves, Section

TASK_GRID = 9
"""Decimals of the task frame's metres and degrees; direction components have three more."""
FILE_GRID = 12
"""Decimals of the metres and degrees of a scenario that is written at another place."""


def task_frame(start: StateSection, contacts: Mapping[str, ContactSection] | None = None) -> PlanarTransform:
    """Transform from the frame of a task, with contacts of its first phase if given, to the world.

    The origin is below the centre of mass at the start, or where the body stands there; x is the heading at
    the start, see :func:`start_heading_deg`.
    """
    x, y = (start.com if start.com is not None else start.at or (0.0, 0.0))[:2]
    return PlanarTransform(x, y, start_heading_deg(start, contacts))


def start_heading_deg(start: StateSection, contacts: Mapping[str, ContactSection] | None = None) -> float:
    """Heading at the start, above -180 and up to 180 [deg].

    That of the file, or else the mean of the feet of the first phase, or of its hands where no foot stands.
    Feet whose mean has no direction, as those that point apart, leave it to the first of them.
    """
    if contacts is None or start.heading_deg is not None:
        return IDENTITY.turned(start.heading_deg or 0.0)
    headings = [item.yaw_deg for name, item in contacts.items() if "foot" in name] or [
        item.rpy_deg[2] if item.kind_for(name) == "grasp" and item.rpy_deg is not None else item.yaw_deg
        for name, item in contacts.items()
    ]
    first = headings[0]
    # Relative to the first, so that feet that are parallel have their own heading to the last bit.
    turns = np.exp(1j * np.deg2rad([heading - first for heading in headings])).sum()
    mean = 0.0 if abs(turns) < 1e-6 else float(np.angle(turns, deg=True))
    return PlanarTransform(yaw_deg=first).turned(mean)


def moved_data(
    section: Section, data: dict[str, Any], transform: PlanarTransform, decimals: int
) -> dict[str, Any]:
    """The values of a section and all in it, with coordinates in another frame.

    Which values are coordinates, and of which kind, the sections' fields say (:class:`FrameMoves`).

    Args:
        data: Its values as a file holds them; not changed.
        transform: From the frame of the coordinates to the other frame.
        decimals: Of metres and degrees in the other frame.
    """
    implied = section.implied()
    section = section.model_copy(update=implied)
    result = data | section.model_dump(mode="json", include=set(implied))
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if value is None or name not in result:
            continue
        kind = next((item for item in field.metadata if isinstance(item, FrameMoves)), None)
        if kind is None:
            result[name] = _moved_inside(value, result[name], transform, decimals)
        else:
            result[name] = _MOVED[kind](value, transform, decimals, section)
    return result


def _moved_inside(value: Any, data: Any, transform: PlanarTransform, decimals: int) -> Any:
    """A value with the coordinates of the sections in it moved."""
    if isinstance(value, Section):
        return moved_data(value, data, transform, decimals)
    if isinstance(value, (list, tuple)):
        return [_moved_inside(item, one, transform, decimals) for item, one in zip(value, data, strict=True)]
    return data


def _point(value: Any, transform: PlanarTransform, decimals: int, _section: Section) -> list[float]:
    return _rounded([*transform.points(value[:2]), *value[2:]], decimals)


def _direction(value: Any, transform: PlanarTransform, decimals: int, _section: Section) -> list[float]:
    return _rounded([*transform.directions(value[:2]), *value[2:]], decimals + 3)


def _heading(value: float, transform: PlanarTransform, decimals: int, section: Section) -> float:
    # On a surface that faces down, the heading turns the other way.
    normal = np.array(getattr(section, "normal", None) or (0.0, 0.0, 1.0))
    down = normal[2] < (-1.0 + 1e-12) * np.linalg.norm(normal)
    return _angle((transform.inverse if down else transform).turned(value), decimals)


def _orientation(value: Any, transform: PlanarTransform, decimals: int, _section: Section) -> list[float]:
    roll, pitch, yaw = value
    return [*_rounded([roll, pitch], decimals), _angle(transform.turned(yaw), decimals)]


def _angle(degrees: float, decimals: int) -> float:
    """The angle on the grid; -180 is 180."""
    return IDENTITY.turned(_rounded([degrees], decimals)[0])


def _rounded(values: Any, decimals: int) -> list[float]:
    """On the grid; never a negative zero."""
    return [round(float(value), decimals) + 0.0 for value in values]


_MOVED: Mapping[FrameMoves, Callable[[Any, PlanarTransform, int, Section], Any]] = {
    FrameMoves.POINT: _point,
    FrameMoves.DIRECTION: _direction,
    FrameMoves.HEADING: _heading,
    FrameMoves.ORIENTATION: _orientation,
}
