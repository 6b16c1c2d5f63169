"""A load in the hands: a point mass at the palms that moves with them."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from manikin.body.model import BodyModel
from manikin.body.segments import Segment
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number

HANDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"left": ("left_hand",), "right": ("right_hand",), "both": ("left_hand", "right_hand")}
)
"""Effectors that carry a load, by the word for them; both hands carry half each."""


def carrying(body: BodyModel, mass: float, hand: str = "both") -> BodyModel:
    """Return the body with a load in its hands.

    The load is a point mass at the origin of each hand's effector (the middle of the palm), rigidly held: it
    has no size, no inertia of its own and meets nothing. It is part of the hand's segment, and thereby of
    all masses, inertias, torques, forces and margins. The strength stays that of the body alone.

    Args:
        body: With the effectors ``left_hand`` and ``right_hand``.
        mass: Of the load [kg]; 0 returns the body as it is.
        hand: ``"left"``, ``"right"`` or ``"both"``.

    Raises:
        BodyError: If the mass is negative, the hand is not known, or the body has no such hand.
    """
    return with_masses(body, hand_masses(body, mass, hand))


def hand_masses(body: BodyModel, mass: float, hand: str = "both") -> dict[str, float]:
    """What each hand of a body carries of a load [kg], by the name of its effector.

    Args:
        body: Who carries it.
        mass: Of the load [kg]; of 0 nothing.
        hand: ``"left"``, ``"right"`` or ``"both"``.

    Raises:
        BodyError: If the mass is negative, the hand is not known, or the body has no such hand.
    """
    finite_number(mass, "load [kg]", at_least=0.0, error=BodyError)
    if hand not in HANDS:
        raise BodyError(f"hand of the load is {hand!r}; valid: {', '.join(HANDS)}")
    if mass == 0.0:
        return {}
    missing = [name for name in HANDS[hand] if name not in body.effectors]
    if missing:
        raise BodyError(f"body {body.name!r} has no {missing[0]} to carry a load; valid: a body with hands")
    return dict.fromkeys(HANDS[hand], mass / len(HANDS[hand]))


def with_masses(body: BodyModel, masses: Mapping[str, float]) -> BodyModel:
    """The body with point masses [kg] at the origins of effectors, as parts of their segments."""
    if not masses:
        return body
    loads = dict(body.loads)
    segments = list(body.segments)
    for name, share in masses.items():
        effector = body.effector(name)
        number = next(k for k, segment in enumerate(segments) if segment.name == effector.segment)
        segments[number] = _with_point(segments[number], share, effector.translation)
        loads[name] = loads.get(name, 0.0) + share
    nominal = None if body.nominal_mass is None else body.nominal_mass + sum(masses.values())
    return replace(body, segments=tuple(segments), loads=loads, nominal_mass=nominal)


def _with_point(segment: Segment, mass: float, position: FloatArray) -> Segment:
    """The segment with a point mass [kg] at a position (3,) in its frame [m]."""
    total = segment.mass + mass
    com = (segment.mass * segment.com + mass * position) / total
    apart = position - segment.com
    square = segment.mass * mass / total * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    return replace(segment, mass=total, com=com, inertia=segment.inertia + square)
