"""Where the body is at the start of a scenario, before anything is planned."""

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.errors import ScenarioError
from manikin.scenarios.values import ScenarioValues
from manikin.spatial import FloatArray, finite_number

STANDING = "standing"
POSTURES = (STANDING,)
"""Names of postures."""


def start_posture(
    values: ScenarioValues,
    body: BodyModel,
    *,
    at: tuple[float, float] | None = None,
    heading_deg: float | None = None,
    posture: str | None = None,
) -> FloatArray:
    """(nq,) configuration at the start: a posture turned and moved to its place.

    The place is that of the root, or puts the centre of mass over the file's; the height is that of
    the supports it stands on, or of the floor.

    Args:
        values: The scenario's values.
        body: Its body.
        at: Where to stand, x and y [m]; the file's own place when omitted.
        heading_deg: Where to face, counter-clockwise from world x [deg]; the file's own, or that of
            its feet, when omitted.
        posture: Name of a posture; the file's own, or standing, when omitted.

    Raises:
        ScenarioError: If the posture is not known or the file gives no place.
        InputError: If a number is not finite.
    """
    start = values.file.task.start
    name = posture or start.posture or STANDING
    if name not in POSTURES:
        if posture is None:
            raise values.error(("task", "start", "posture"), f"is {name!r}; valid: {', '.join(POSTURES)}")
        raise ScenarioError(f"posture is {name!r}; valid: {', '.join(POSTURES)}")
    heading_deg = None if heading_deg is None else finite_number(heading_deg, "heading [deg]")
    at = None if at is None else (finite_number(at[0], "at x [m]"), finite_number(at[1], "at y [m]"))
    q = turned(body.standing_posture(), np.deg2rad(_heading(values) if heading_deg is None else heading_deg))
    q[2] += values.start_level
    place = at or start.at
    if place is not None:
        q[:2] = place
    else:
        q[:2] += values.start_com[:2] - Configuration(body, q).com[:2]
    return q


def turned(q: FloatArray, yaw: float) -> FloatArray:
    """(nq,) the configuration with its root turned about the vertical through itself [rad]."""
    found = np.array(q)
    half = np.array([np.sin(0.5 * yaw), np.cos(0.5 * yaw)])
    x, y, z, w = q[3:7]
    found[3:7] = (
        half[1] * x - half[0] * y, half[1] * y + half[0] * x,
        half[1] * z + half[0] * w, half[1] * w - half[0] * z,
    )  # fmt: skip
    return found


def _heading(values: ScenarioValues) -> float:
    """Heading of the start, or that of the feet of the first phase, or 0 [deg]."""
    given = values.file.task.start.heading_deg
    if given is not None:
        return float(given)
    if values.file.supports is None:
        return 0.0
    contacts = values.explicit_supports().resolved_phases()[0]
    yaws = np.deg2rad([item.yaw_deg for name, item in contacts.items() if "foot" in name] or [0.0])
    return float(np.rad2deg(np.arctan2(np.sin(yaws).sum(), np.cos(yaws).sum())))
