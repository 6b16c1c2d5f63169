"""The limits of one contact as named inequalities on its wrench.

All rows act on ``[force; moment]`` in the contact frame (x forward, y left, z the normal),
moments about its origin; they are of unit length, with alpha = 1 m.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from manikin.balance.friction import FrictionModel, pyramid_friction
from manikin.contact import Contact, ContactKind
from manikin.spatial import FloatArray


class LimitKind(StrEnum):
    """What gives way when a limit is reached."""

    SLIPPING = "slipping"
    TIPPING = "tipping"
    TURNING = "turning"
    LIFTING = "lifting"
    NORMAL_FORCE_CAP = "normal force cap"
    GRASP_FORCE = "grasp force"
    GRASP_MOMENT = "grasp moment"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True, eq=False)
class ContactLimits:
    """Rows ``A w <= b`` of one contact, each with its kind and a phrase.

    Attributes:
        A: (k, 6) unit rows.
        b: (k,) [N, N.m].
        kinds: What each row limits.
        phrases: Words for each row: how the contact moves when it gives way.
    """

    A: FloatArray
    b: FloatArray
    kinds: tuple[LimitKind, ...]
    phrases: tuple[str, ...]


Row = tuple[list[float], float, LimitKind, str]


def contact_limits(contact: Contact, friction_model: FrictionModel = "pyramid") -> ContactLimits:
    """Limits of a sole, point or grasp.

    A sole without ``torsion_limit`` has the 16 rows equivalent to four corner points with
    friction pyramids: friction, CoP, and the yaw moment those forces allow (closed form of
    the sole's wrench cone, our own derivation, checked against the corner forces). With a
    ``torsion_limit`` the yaw rows are the safe eight-row form ``|n tau| + mu |s tau| +
    mu |t tau| <= limit`` ([Qiu2012]_ 4.21 corrected), beside friction on the whole
    force (4.20) and CoP (4.14).

    A part of a sole is taken about the middle of its points; an edge resists no moment about itself.

    Raises:
        ContactError: If the friction model is unknown.
    """
    if contact.kind is ContactKind.GRASP:
        rows = _grasp_rows(contact)
    else:
        mu = pyramid_friction(contact, friction_model)
        rows = _friction_rows(mu)
        if contact.kind is ContactKind.SOLE:
            rows += _pressure_rows(contact) + _turning_rows(contact, mu)
        if contact.normal_force_cap is not None:
            cap = contact.normal_force_cap
            rows.append(
                ([0, 0, 1, 0, 0, 0], cap, LimitKind.NORMAL_FORCE_CAP, f"normal force cap of {cap:g} N")
            )
    A = np.array([row for row, *_ in rows], dtype=np.float64)
    b = np.array([bound for _, bound, *_ in rows])
    length = np.linalg.norm(A, axis=1)
    return ContactLimits(
        A / length[:, None], b / length, tuple(r[2] for r in rows), tuple(r[3] for r in rows)
    )


def _friction_rows(mu: float) -> list[Row]:
    """A force at its limit along +x cannot keep the contact from moving along -x."""
    slip = LimitKind.SLIPPING
    return [
        ([1, 0, -mu, 0, 0, 0], 0.0, slip, "slipping along -x"),
        ([-1, 0, -mu, 0, 0, 0], 0.0, slip, "slipping along +x"),
        ([0, 1, -mu, 0, 0, 0], 0.0, slip, "slipping along -y"),
        ([0, -1, -mu, 0, 0, 0], 0.0, slip, "slipping along +y"),
    ]


def _pressure_rows(contact: Contact) -> list[Row]:
    """CoP inside the rectangle ([Qiu2012]_ 4.14): x = -tau_y / f_z, y = tau_x / f_z."""
    half_length, half_width = contact.length / 2, contact.width / 2
    left, right = _side_names(contact.effector)
    tip = LimitKind.TIPPING
    if half_length == 0.0:
        return [
            ([0, 0, 0, 0, -1, 0], 0.0, tip, "rolling forward over its edge"),
            ([0, 0, 0, 0, 1, 0], 0.0, tip, "rolling backward over its edge"),
            ([0, 0, -half_width, 1, 0, 0], 0.0, tip, f"tipping over its {left} end"),
            ([0, 0, -half_width, -1, 0, 0], 0.0, tip, f"tipping over its {right} end"),
        ]
    return [
        ([0, 0, -half_length, 0, -1, 0], 0.0, tip, "tipping over its front edge"),
        ([0, 0, -half_length, 0, 1, 0], 0.0, tip, "tipping over its rear edge"),
        ([0, 0, -half_width, 1, 0, 0], 0.0, tip, f"tipping over its {left} edge"),
        ([0, 0, -half_width, -1, 0, 0], 0.0, tip, f"tipping over its {right} edge"),
    ]


def _side_names(effector: str) -> tuple[str, str]:
    if effector.startswith("left"):
        return "outer", "inner"
    if effector.startswith("right"):
        return "inner", "outer"
    return "left", "right"


def _turning_rows(contact: Contact, mu: float) -> list[Row]:
    turn = LimitKind.TURNING
    signs = [(a, b) for a in (1.0, -1.0) for b in (1.0, -1.0)]
    words = {1.0: "turning clockwise on its sole", -1.0: "turning counter-clockwise on its sole"}
    if contact.torsion_limit is not None:
        return [
            ([0, 0, 0, a * mu, b * mu, c], contact.torsion_limit, turn, words[c])
            for c in (1.0, -1.0)
            for a, b in signs
        ]
    x, y = contact.length / 2, contact.width / 2
    return [
        ([a * y, b * x, -mu * (x + y), c * a * mu, c * b * mu, c], 0.0, turn, words[c])
        for c in (1.0, -1.0)
        for a, b in signs
    ]


def _grasp_rows(contact: Contact) -> list[Row]:
    """Box per axis ([Qiu2012]_ 4.22); the axes are the world's."""
    rows: list[Row] = []
    for axis, name in enumerate("xyz"):
        for sign, text in ((1.0, "+"), (-1.0, "-")):
            row = np.zeros(6)
            row[axis] = sign
            phrase = f"grasp force limit of {contact.max_force:g} N along {text}{name}"
            rows.append((row.tolist(), contact.max_force, LimitKind.GRASP_FORCE, phrase))
            phrase = f"grasp moment limit of {contact.max_moment:g} N.m about {text}{name}"
            rows.append((np.roll(row, 3).tolist(), contact.max_moment, LimitKind.GRASP_MOMENT, phrase))
    return rows
