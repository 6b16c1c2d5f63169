"""Postures of a body that crawls on hands and knees, kneels down and gets up.

What carries a hand is its heel, under the wrist: arms are nearly straight on it, so that elbows ask for a
quarter of their strength at rest.  Wrists bend back by 70 degrees at most, so elbows are behind them.
"""

import math
from collections.abc import Mapping
from functools import cache, partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import of_both_sides, stature_of
from manikin.contact import Contact, point
from manikin.kinematics import Placement, Preferences
from manikin.numerics.spatial import FloatArray, quaternions, rotation_from_yaw, rotations
from manikin.planning.contacts.contact_plan import Contacts
from manikin.planning.contacts.posture_finder import Posed, PostureFinder, PostureFinderSettings
from manikin.scene import Box, Obstacle, Scene

CRAWLERS = ("right_knee", "right_wrist", "left_knee", "left_wrist")  # in the order in which they go
RESTING_INSET = 0.02  # distance to the edges of where the body may rest, at 1.75 m; shifts are twice that [m]
EASE = 0.9  # largest share of the strength for which a posture at rest may ask; the motion asks for more
OUTWARDS = math.radians(30.0)  # angle of the fingers from the way
# Distance from a place that is wished for that costs half a unit, and that of a hand from what it left [m].
MISSED, OFF = 0.05, 0.03
TILT = 0.5  # sine of the largest angle of a hand: neither its edge nor the forearm is pressed into the ground
_ON_ALL_FOURS = {
    "hip_flexion": 90.0, "knee_flexion": 85.0, "ankle_dorsiflexion": -45.0, "shoulder_flexion": 66.0,
    "elbow_flexion": 48.0, "forearm_pronation": 65.0, "wrist_flexion": -62.0, "neck_flexion": -30.0,
}  # fmt: skip
_BENT = {"hip_flexion": 55.0, "knee_flexion": 60.0, "shoulder_flexion": 30.0, "elbow_flexion": 100.0}
_SQUATTING = {
    "hip_flexion": 126.0, "knee_flexion": 96.0, "ankle_dorsiflexion": 28.0, "lumbar_flexion": 20.0,
    "shoulder_flexion": 70.0, "elbow_flexion": 20.0,
}  # fmt: skip
_CRAWLING_PITCH, _SQUATTING_PITCH = math.radians(84.0), math.radians(58.0)
_PREFERENCES = Preferences(pelvis=0.0, trunk=0.0, head=0.0, arms=0.0)


class CrawlStyle(NamedTuple):
    """How a body is on all fours: the farther back its knees, the lower; lengths at 1.75 m [m]."""

    base: float  # distance of the hands before the knees
    room: float  # height below which all of it is
    needs: float  # height that has to be free
    apart: tuple[float, float]  # distances of knees and hands to the middle of the way
    resting: tuple[float, ...]  # shares of the way from knees to hands at which it rests, tried in turn
    gaits: tuple[tuple[float, float], ...]  # strides with distances of the hands before the knees, in turn


_GAITS = (0.42, 0.50), (0.42, 0.60), (0.28, 0.50), (0.28, 0.60)
UPRIGHT = CrawlStyle(0.55, 0.72, 0.61, (0.08, 0.20), (0.36, 0.42, 0.30), _GAITS)
LOW = CrawlStyle(0.70, 0.60, 0.55, (0.12, 0.17), (0.45, 0.50, 0.40), ((0.30, 0.70), (0.22, 0.70)))
LOWEST = CrawlStyle(0.80, 0.58, 0.45, (0.14, 0.17), (0.50, 0.46, 0.54), ((0.20, 0.80), (0.25, 0.80)))
STYLES = UPRIGHT, LOW, LOWEST


def on_all_fours(body: BodyModel, settings: PostureFinderSettings, style: CrawlStyle = UPRIGHT) -> Posed:
    """Posture on hands and knees on a level floor, the middle between them at the origin."""
    q = _bent(body, {**_ON_ALL_FOURS, **(_BENT if style is not UPRIGHT else {})}, 0.0, _CRAWLING_PITCH)
    q[2] = -Configuration(body, q).effector_placement(CRAWLERS[0])[1][2]
    size, held = stature_of(body) / 1.75, dict[str, Contact]()
    for name in CRAWLERS:
        side, _, part = name.partition("_")
        ahead, out = style.base * ((part == "wrist") - 0.5), style.apart[part == "wrist"]
        place = size * np.array([ahead, out if side == "left" else -out, 0.0])
        held[name] = point(name, place, friction=1.0, rotation=fingers_out(name))
    ceiling = Obstacle("ceiling", Box((4.0, 4.0, 1.0)), translation=(0.0, 0.0, size * style.room + 0.5))
    finder = PostureFinder(body, Scene([ceiling]), q, settings)
    return finder.pose(held, held, q, place=np.zeros(2), preferences=_PREFERENCES)


class CrawlPostures:
    """Postures of a body on all fours, and on the way there from its feet, by a :class:`PostureFinder`."""

    def __init__(self, body: BodyModel, scene: Scene, settings: PostureFinderSettings) -> None:
        self._body, self._posed = body, cache(partial(on_all_fours, body, settings))
        self.finder = PostureFinder(body, scene, self._posed(UPRIGHT).q, settings)
        self._inset = RESTING_INSET * stature_of(body) / 1.75

    def pose(
        self, held: Contacts, carrying: Contacts, start: FloatArray, guide: FloatArray | None = None,
        near: Contacts | None = None, style: CrawlStyle = UPRIGHT,
    ) -> Posed:  # fmt: skip
        """A posture that the strength can hold, hands flat and shanks level as far as they can be.

        One on hands and knees alone is like :func:`on_all_fours`, its weight between them; another one is
        like a guide (nq,), limbs just off what they left ``near``. The other arguments are those of
        :meth:`PostureFinder.pose`.
        """
        posed, crawls = Posed(None), held.keys() <= set(CRAWLERS)
        wishes = {name: _wished(item.position + OFF * item.normal) for name, item in (near or {}).items()}
        for share in style.resting if crawls else (0.0,):
            place = None
            if crawls:
                knees, wrists = (middle[:2] for middle in _middles(held))
                place = self.finder.resting_place(carrying, knees + share * (wrists - knees), self._inset)
            posed = self.finder.pose(
                held, carrying, start, self.over(held, style) if crawls else guide, place=place,
                placements=wishes, preferences=_PREFERENCES, restarts=not crawls,
            )  # fmt: skip
            posed = self._held_easily(posed, held, carrying)
            if posed.q is not None:
                break
        return posed

    def between(
        self, staying: Contacts, postures: tuple[FloatArray, FloatArray],
        places: Mapping[str, FloatArray] = MappingProxyType({}),
    ) -> FloatArray | None:  # fmt: skip
        """(nq,) posture half way between two, limbs near places (3,) off the ground [m]."""
        start = 0.5 * (postures[0] + postures[1])
        start[3:7] = postures[1][3:7]
        wishes = {name: _wished(place) for name, place in places.items()}
        return self.finder.pose(staying, staying, start, start, placements=wishes, preferences=_PREFERENCES).q

    def over(self, contacts: Contacts, style: CrawlStyle = UPRIGHT) -> FloatArray:
        """(nq,) the posture on all fours over contacts, turned and pitched as they lie."""
        knees, hands = _middles(contacts)
        ahead, posed = hands - knees, self._posed(style)
        q = np.array(self._body.standing_posture() if posed.q is None else posed.q)
        yaw = math.atan2(ahead[1], ahead[0])
        pitch = -math.atan2(ahead[2], math.hypot(ahead[0], ahead[1]))
        turn = rotations(np.array(yaw), np.array(pitch), np.array(0.0))
        root = pin.XYZQUATToSE3(q[:7])
        q[:7] = pin.SE3ToXYZQUAT(pin.SE3(turn, 0.5 * (knees + hands)) * root)
        return q

    def squatting(self, feet: Contacts) -> FloatArray:
        """(nq,) posture that squats on two feet: a person's way up, and no legs at full length."""
        ahead = np.mean([foot.rotation_contact_to_world[:2, 0] for foot in feet.values()], axis=0)
        q = _bent(self._body, _SQUATTING, math.atan2(ahead[1], ahead[0]), _SQUATTING_PITCH)
        state = Configuration(self._body, q)
        away = [foot.position - state.effector_placement(name)[1] for name, foot in feet.items()]
        q[:3] += np.mean(away, axis=0)
        return q

    def _held_easily(self, posed: Posed, held: Contacts, carrying: Contacts) -> Posed:
        """The posture, or that a hand is not level in it, or that it asks for too much of the strength."""
        if posed.q is None:
            return posed
        state = Configuration(self._body, posed.q)
        for name, contact in held.items():
            up = state.effector_placement(name)[0][:, 2]
            if name.endswith("wrist") and np.linalg.norm(np.cross(up, contact.normal)) > TILT:
                return Posed(None, f"{name} is not level")
        why = self.finder.strained(posed.q, carrying, EASE)
        return Posed(None, why) if why else posed


def fingers_out(name: str) -> FloatArray:
    """(3, 3) turn of a limb's frame from that of the way: fingers point outwards."""
    side, _, part = name.partition("_")
    return rotation_from_yaw((OUTWARDS if side == "left" else -OUTWARDS) * (part == "wrist"))


def _bent(body: BodyModel, degrees: Mapping[str, float], yaw: float, pitch: float) -> FloatArray:
    """(nq,) posture of angles on both sides [deg], the root turned and pitched [rad]."""
    angles = {name: math.radians(value) for name, value in degrees.items()}
    q = np.array(body.posture(of_both_sides(body, angles)))
    q[3:7] = quaternions(np.array(yaw), np.array(pitch), np.array(0.0))
    return q


def _middles(contacts: Contacts) -> tuple[FloatArray, FloatArray]:
    """(3,) middles of the knees and of the wrists [m]."""
    knees, wrists = (
        np.mean([contact.position for name, contact in contacts.items() if name.endswith(part)], axis=0)
        for part in ("knee", "wrist")
    )
    return knees, wrists


def _wished(place: FloatArray) -> Placement:
    """Wish for a limb at a place (3,) [m], turned as it likes."""
    return Placement(place, None, None, 0.5 / MISSED**2)
