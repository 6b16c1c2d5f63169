"""Contacts of a body that crawls under what it cannot walk below: it kneels down, crawls, and gets up again.

The order of the limbs is that of most four-legged animals that creep: a knee, the hand of its side, the other
knee, its hand, so that three of them carry at any time.  Each goes to where the way over the ground has it,
on whatever surface is there.  Getting up is planned from hands and knees to two feet; kneeling down is the
same backwards, as every posture at rest is at rest backwards as well.
"""

import math
from collections.abc import Callable, Mapping
from itertools import chain, product
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import of_both_sides
from manikin.contact import Contact, point
from manikin.kinematics import Placement, Preferences
from manikin.numerics.spatial import FloatArray, quaternions, rotation_from_yaw, rotations
from manikin.planning.contacts.best_first import Extension
from manikin.planning.contacts.contact_plan import ContactPlan, Contacts, Paces, Stage, onto_normal
from manikin.planning.contacts.endpoint import Endpoints, Habit
from manikin.planning.contacts.footholds import FEET, Footholds, feet_of
from manikin.planning.contacts.footsteps import LOW_STEP, low_way
from manikin.planning.contacts.limb_places import stature_of
from manikin.planning.contacts.posture_finder import Posed, PostureFinder, PostureFinderSettings
from manikin.planning.contacts.walk_search import COLUMN, WalkSettings
from manikin.scene import Box, Obstacle, Scene

ORDER = ("right_knee", "right_fist", "left_knee", "left_fist")  # order in which limbs go
CRAWLING = (0.2, 0.05, 0.45)  # radius, lowest and highest end of what is free to crawl, at 1.75 m [m]
APART = {"knee": 0.10, "fist": 0.17}  # distance of limbs to the middle of the way, at 1.75 m [m]; our choice
WHEELBASE = {"knee": -0.65, "fist": 0.65}  # place of limbs along the way, of a body of 1.75 m, twice [m]
RESTING = (0.35, 0.2, 0.5)  # shares of the way from knees to fists at which the body rests: arms are weaker
EASE = 0.9  # largest share of the strength for which a posture at rest may ask; the motion asks for more
ROOM = 0.72  # height below which the body is on all fours where nothing is lower, of a body of 1.75 m [m]
# Tried in turn, at 1.75 m [m]: strides with distances of hands before knees; to kneel down and get up,
# those distances with those of knees before the feet; shares of a limb's step with ways outwards.
GAITS = ((0.42, 0.60), (0.42, 0.70), (0.28, 0.52), (0.28, 0.70))
KNEELING = tuple(product((0.60, 0.50), (-0.20, -0.30, -0.12)))
NEARBY = ((1.0, 0.0), (0.6, 0.0), (1.0, -0.05), (1.0, 0.05), (0.6, -0.05))
BEFORE, BEHIND = 0.85, 0.45  # ways from the feet to what is low when a body kneels, gets up, at 1.75 m [m]
NEAR_END = 0.8  # way to the start or goal up to which the body kneels or gets up there, and does not walk [m]
TURNED = math.radians(25.0)  # angle up to which it does so with feet as they are
STEEPEST = math.radians(30.0)  # largest slope of a surface for hands and knees
INSET = 0.03  # distance of hands and knees to the edges of what they are on [m]
LIFT = 0.05  # height of a limb in flight [m]
LEVEL = {"knee": 0.3, "fist": 6.0}  # weights with which shanks are level and hands upright [1/rad^2]
TILT = 0.19  # sine of the largest angle of a hand on its fist: its edge is not pressed into the ground
PACES = Paces(swing_duration=0.45, swing_speed=1.2, shift_duration=0.15)  # on all fours; our choice
ON_FOURS_ROOM = (0.04, 0.04, 0.01)  # way of the centre of mass off a posture on all fours [m]; our choice
TURNING = 1.6  # time in which a leg goes from its knee onto its foot or back [s]
_ON_ALL_FOURS = {
    "hip_flexion": 90.0, "knee_flexion": 85.0, "ankle_dorsiflexion": -45.0, "shoulder_flexion": 80.0,
    "elbow_flexion": 10.0, "wrist_flexion": -65.0, "neck_flexion": -30.0,
}  # fmt: skip
_PITCH = math.radians(80.0)
_PREFERENCES = Preferences(pelvis=0.0, trunk=0.0, head=0.0, arms=0.0)


def on_all_fours(body: BodyModel, settings: PostureFinderSettings) -> Posed:
    """Posture on fists and knees on a level floor, the middle between them at the origin."""
    angles = {name: math.radians(value) for name, value in _ON_ALL_FOURS.items()}
    q = body.posture(of_both_sides(body, angles))
    q[3:7] = quaternions(np.array(0.0), np.array(_PITCH), np.array(0.0))
    q[2] = -Configuration(body, q).effector_placement(ORDER[0])[1][2]
    size, held = stature_of(body) / 1.75, dict[str, Contact]()
    for name in ORDER:
        side, _, part = name.partition("_")
        place = size * np.array([0.5 * WHEELBASE[part], (1.0 if side == "left" else -1.0) * APART[part], 0.0])
        held[name] = point(name, place, friction=1.0, rotation=np.eye(3))
    ceiling = Obstacle("ceiling", Box((4.0, 4.0, 1.0)), translation=(0.0, 0.0, size * ROOM + 0.5))
    finder = PostureFinder(body, Scene([ceiling]), q, settings)
    return finder.pose(held, held, q, place=np.zeros(2), placements=_level(held), preferences=_PREFERENCES)


class _Way(NamedTuple):
    """Way over the ground: places (n, 3) and its length (n,) up to each [m]."""

    places: FloatArray
    along: FloatArray

    def at(self, along: float) -> tuple[FloatArray, float]:
        """Place (3,) [m] and heading [rad], on the straight beyond both ends."""
        row = int(np.clip(np.searchsorted(self.along, along) - 1, 0, len(self.along) - 2))
        start, end = self.places[row : row + 2]
        ahead = (end - start) / (self.along[row + 1] - self.along[row])
        return start + (along - self.along[row]) * ahead, math.atan2(ahead[1], ahead[0])


class CrawlSearch:
    """Search for the contacts of a way that is crawled in part."""

    def __init__(
        self, poser: PostureFinder, endpoints: Endpoints, start: Stage, goal: Stage, friction: float,
        walk: Callable[[Stage, Stage], Extension], settings: WalkSettings | None = None,
    ) -> None:  # fmt: skip
        """Prepare a search.

        Args:
            poser: Of the body in its scene; postures on all fours are found with its settings.
            endpoints: Finds where the body stands before and behind what is low.
            start: On feet, as the goal.
            friction: Coulomb coefficient.
            walk: Plans a walk between two stages on feet.
        """
        self._body, self._scene = poser.body, poser.scene
        crawling = on_all_fours(poser.body, poser.settings)
        self._fault = f"no posture on all fours: {crawling.reason}" if crawling.q is None else ""
        self._reference = poser.body.standing_posture() if crawling.q is None else crawling.q
        self._poser = PostureFinder(self._body, self._scene, self._reference, poser.settings)
        self._endpoints, self._walk = endpoints, walk
        self._start, self._goal, self._friction = start, goal, friction
        self._settings = settings or WalkSettings()
        self._size = stature_of(self._body) / 1.75
        self._surfaces = self._scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)

    def run(self) -> Extension:
        """The plan, or why there is none."""
        found = self._fault or self._planned()
        plan, failure = (None, found) if isinstance(found, str) else (found, None)
        return Extension(plan, self._poser.searches, 0, failure)

    def _planned(self) -> ContactPlan | str:
        ends = feet_of(self._start.contacts), feet_of(self._goal.contacts)
        footholds = Footholds(self._body, self._scene, steepest=STEEPEST)
        low, high = (
            (self._size * radius, self._size * bottom, self._size * top)
            for radius, bottom, top in (CRAWLING, COLUMN)
        )
        found = low_way(self._scene, footholds, ends, low, high)
        if found is None:
            return "no way over the ground has room for the body on hands and knees"
        steps = np.linalg.norm(np.diff(found[0], axis=0), axis=1)
        way, under = _Way(found[0], np.append(0.0, np.cumsum(steps))), np.flatnonzero(~found[1])
        if not len(under):
            return "the body can walk all the way"
        first, last = float(way.along[under[0]]), float(way.along[under[-1]])
        before = self._standing(way, first - BEFORE * self._size, self._start, "before")
        behind = self._standing(way, last + BEHIND * self._size, self._goal, "behind")
        if isinstance(before, str) or isinstance(behind, str):
            return before if isinstance(before, str) else str(behind)
        down, up = self._risen(way, before), self._risen(way, behind)
        if isinstance(down, str) or isinstance(up, str):
            return down if isinstance(down, str) else str(up)
        reason = ""
        for gait in GAITS:
            crawl = self._on_hands_and_knees(way, down, up, gait)
            if not isinstance(crawl, str):
                # The crawl begins with the stage that kneeling down ends with.
                crawled = [*_backwards(self._body, down), *crawl[1:], *up.stages[1:]]
                return self._joined(before, crawled, behind)
            reason = reason or crawl
        return reason

    def _standing(self, way: _Way, along: float, end: Stage, side: str) -> Stage | str:
        """Where the body stands to kneel down, or gets up; the start or goal itself where it is near."""
        middle = np.mean([end.contacts[foot].position for foot in FEET], axis=0)
        own = 0.0 if side == "before" else float(way.along[-1])
        heading = way.at(own)[1]
        turned = [abs(math.remainder(end.contacts[foot].yaw - heading, 2.0 * math.pi)) for foot in FEET]
        if abs(own - along) < NEAR_END and max(turned) < TURNED:
            return end
        along = float(np.clip(along, 0.0, way.along[-1]))
        place, heading = way.at(along)
        place = middle if abs(own - along) < LOW_STEP else place
        result = self._endpoints.find(place[:2], heading, Habit.STANDING, float(place[2]))
        return result.stage or f"{side} what is low: {result.failure}"

    def _joined(self, before: Stage, crawled: list[Stage], behind: Stage) -> ContactPlan | str:
        """The crawl with what is walked before and behind it."""
        stages, goal = list(crawled), behind.q
        if before is not self._start:
            walk = self._walk(self._start, before).plan
            if walk is None:
                return "no walk leads to where the body would kneel down"
            stages = [*walk.stages, *stages[1:]]
        if behind is not self._goal:
            walk = self._walk(behind, self._goal).plan
            if walk is None:
                return "no walk leads on from where the body would get up"
            stages, goal = [*stages, *walk.stages[1:]], walk.goal
        return ContactPlan.of(self._body, stages, goal, self._settings)

    # --- kneeling down and getting up -------------------------------------------------------------

    def _risen(self, way: _Way, standing: Stage) -> "_Rise | str":
        """Stages from hands and knees to the feet of a stage, or why there are none."""
        feet = {foot: standing.contacts[foot] for foot in FEET}
        middle = np.mean([contact.position for contact in feet.values()], axis=0)
        along = float(way.along[int(np.argmin(np.linalg.norm(way.places - middle, axis=1)))])
        reason = ""
        for (base, behind), lead in product(KNEELING, ("right", "left")):
            at = along + behind * self._size
            held = self._contacts(way, (at, at + base * self._size))
            stages = held if isinstance(held, str) else self._got_up(held, feet, lead)
            if not isinstance(stages, str):
                return _Rise(stages, standing.q, at, base * self._size)
            reason = reason or stages
        return f"cannot kneel down at {_text(middle)}: {reason}"

    def _got_up(self, held: dict[str, Contact], feet: Contacts, lead: str) -> list[Stage] | str:
        """From four contacts onto two feet, the leading one first."""
        other = "left" if lead == "right" else "right"
        posed, stages = self._posed(held, held, self._guide(held), guided=True), list[Stage]()
        if posed.q is not None:
            stages = [Stage.of(self._body, held, posed.q, self._settings.shift_duration)]
        changes = [
            (f"{lead}_knee", None), (None, f"{lead}_foot"), (f"{other}_knee", None), (None, f"{other}_foot"),
            ("left_fist", None), ("right_fist", None),
        ]  # fmt: skip
        contacts = dict(held)
        for leaving, landing in changes:
            after = {name: contact for name, contact in contacts.items() if name != leaving}
            if landing is not None:
                after[landing] = feet[landing]
            both = {**contacts, **after}
            staying = {name: contact for name, contact in after.items() if name in contacts}
            if posed.q is not None:
                posed = self._posed(both, staying, posed.q)
            if posed.q is None:
                return f"{leaving or landing} cannot {'be put down' if landing else 'leave'}: {posed.reason}"
            contacts = after
            time = TURNING if len(after) == 3 and landing is None else self._settings.reach_duration
            stages.append(Stage.of(self._body, contacts, posed.q, time))
        return stages

    # --- on hands and knees -----------------------------------------------------------------------

    def _on_hands_and_knees(
        self, way: _Way, down: "_Rise", up: "_Rise", gait: tuple[float, float]
    ) -> list[Stage] | str:
        """Stages from one place on hands and knees to another, or why there are none."""
        stride, base = (self._size * value for value in gait)
        stages, goal = down.stages[:1], up.stages[0].contacts
        total, contacts, q = up.along - down.along, dict(stages[0].contacts), stages[0].q
        begin = {"knee": down.along, "fist": down.along + base}
        end = {"knee": up.along, "fist": up.along + up.base}
        reached = {name: down.along + down.base * name.endswith("fist") for name in ORDER}
        for number in range(4 * (2 + math.ceil(total / (0.5 * stride)))):
            name = ORDER[number % 4]
            part = name.partition("_")[2]
            ahead = begin[part] + 0.25 * (number + 1) * stride
            target = goal[name] if ahead >= end[part] else None
            if contacts[name] is not target:
                step = self._stepped(way, name, (reached[name], min(ahead, end[part])), target, contacts, q)
                if isinstance(step, str):
                    return step
                reached[name], *made = step
                stages += made
                q, contacts = made[-1].q, dict(made[-1].contacts)
            if all(contacts[each] is goal[each] for each in ORDER):
                return stages
        return "does not arrive on hands and knees"

    def _stepped(
        self, way: _Way, name: str, ends: tuple[float, float], target: Contact | None,
        contacts: Contacts, q: FloatArray,
    ) -> tuple[float, Stage, Stage] | str:  # fmt: skip
        """New place and stages of a limb that goes to a contact, where the way has it, or near there."""
        staying = {other: contact for other, contact in contacts.items() if other != name}
        lifted = self._posed(contacts, staying, q, guided=True)
        if lifted.q is None:
            return f"{name} cannot leave {_text(contacts[name].position)}: {lifted.reason}"
        reason = f"there is nothing to put {name} on beyond {_text(contacts[name].position)}"
        spots = ((ends[0] + share * (ends[1] - ends[0]), out) for share, out in NEARBY)
        offers = ((along, self._contact(way, name, along, out)) for along, out in spots)
        for along, contact in chain([(ends[1], target)], offers):
            if contact is None:
                continue
            landed = {**staying, name: contact}
            landing = self._posed(landed, staying, lifted.q, guided=True)
            if landing.q is None:
                reason = f"{name} cannot be put down at {_text(contact.position)}: {landing.reason}"
                continue
            via = self._between(staying, name, (contacts[name], contact), (lifted.q, landing.q))
            if via is None:
                reason = f"{name} finds no way to {_text(contact.position)}"
                continue
            flight = PACES.flight(contacts[name], contact)
            flying = Stage.of(self._body, staying, lifted.q, flight, ON_FOURS_ROOM, via)
            return along, flying, Stage.of(self._body, landed, landing.q, PACES.shift_duration, ON_FOURS_ROOM)
        return reason

    def _between(
        self, staying: Contacts, name: str, ends: tuple[Contact, Contact],
        postures: tuple[FloatArray, FloatArray],
    ) -> FloatArray | None:  # fmt: skip
        """(nq,) posture in the middle of a flight, the limb off the line between its contacts."""
        middle = 0.5 * (ends[0].position + ends[1].position) + LIFT * ends[1].normal
        start = 0.5 * (postures[0] + postures[1])
        start[3:7] = postures[1][3:7]
        return self._posed(staying, staying, start, {name: Placement(middle, None, None, 0.5 / LIFT**2)}).q

    # --- contacts and postures --------------------------------------------------------------------

    def _contacts(self, way: _Way, ends: tuple[float, float]) -> dict[str, Contact] | str:
        """Knees and hands at two places along the way."""
        found: dict[str, Contact] = {}
        for name in ORDER:
            contact = self._contact(way, name, ends[name.endswith("fist")])
            if contact is None:
                return f"there is nothing for {name} at {_text(way.at(ends[0])[0])}"
            found[name] = contact
        return found

    def _contact(self, way: _Way, name: str, along: float, out: float = 0.0) -> Contact | None:
        """Contact of a limb beside the way, on the surface that is nearest to its height."""
        place, heading = way.at(along)
        side, _, part = name.partition("_")
        turn = rotation_from_yaw(heading)
        wanted = place + (1.0 if side == "left" else -1.0) * (APART[part] * self._size + out) * turn[:, 1]
        best: Contact | None = None
        least = 0.25 * self._size
        for surface in self._surfaces:
            base = surface.polygon[0]
            height = base[2] - float((wanted - base)[:2] @ surface.normal[:2]) / surface.normal[2]
            spot = np.array([wanted[0], wanted[1], height])
            around = spot + INSET * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
            if abs(height - wanted[2]) < least and surface.outside(around).max() <= 0.0:
                least, frame = abs(height - wanted[2]), onto_normal(turn, surface.normal)
                best = point(name, spot, friction=self._friction, rotation=frame)
        return best

    def _guide(self, contacts: Contacts) -> FloatArray:
        """(nq,) the posture on all fours over contacts, turned and pitched as they lie."""
        knees, hands = _middles(contacts)
        ahead, q = hands - knees, np.array(self._reference)
        yaw = math.atan2(ahead[1], ahead[0])
        pitch = -math.atan2(ahead[2], math.hypot(ahead[0], ahead[1]))
        turn = rotations(np.array(yaw), np.array(pitch), np.array(0.0))
        root = pin.XYZQUATToSE3(q[:7])
        q[:7] = pin.SE3ToXYZQUAT(pin.SE3(turn, 0.5 * (knees + hands)) * root)
        return q

    def _posed(
        self, held: Contacts, carrying: Contacts, start: FloatArray,
        wishes: Mapping[str, Placement] | None = None, *, guided: bool = False,
    ) -> Posed:  # fmt: skip
        """A posture that the strength can hold, palms flat and shanks level as far as they can be.

        A guided one is like that on all fours, its weight between the knees and the fists.
        """
        first: Posed | None = None
        for share in RESTING if guided else (None,):
            place = None
            if share is not None:
                knees, fists = (middle[:2] for middle in _middles(held))
                near = knees + share * (fists - knees)
                place = self._poser.resting_place(carrying, near, self._poser.settings.inset)
            posed = self._poser.pose(
                held, carrying, start, self._guide(held) if guided else None, place=place,
                placements={**_level(held), **(wishes or {})}, preferences=_PREFERENCES,
                restarts=not guided and not wishes,
            )  # fmt: skip
            posed = self._held_easily(posed, held, carrying)
            if posed.q is not None:
                return posed
            first = first or posed
        return first or Posed(None)

    def _held_easily(self, posed: Posed, held: Contacts, carrying: Contacts) -> Posed:
        """The posture, or that a hand is not upright in it, or that it asks for too much of the strength."""
        if posed.q is not None:
            state = Configuration(self._body, posed.q)
            for name, contact in held.items():
                up = state.effector_placement(name)[0][:, 2]
                if name.endswith("fist") and np.linalg.norm(np.cross(up, contact.normal)) > TILT:
                    return Posed(None, f"{name} is not upright")
            why = self._poser.strained(posed.q, carrying, EASE)
            return Posed(None, why) if why else posed
        return posed


def _middles(contacts: Contacts) -> tuple[FloatArray, FloatArray]:
    """(3,) middles of the knees and of the fists [m]."""
    knees, fists = (
        np.mean([contact.position for name, contact in contacts.items() if name.endswith(part)], axis=0)
        for part in ("knee", "fist")
    )
    return knees, fists


def _level(held: Contacts) -> dict[str, Placement]:
    """Wishes for shanks that are level and hands that are upright."""
    return {
        name: Placement(None, contact.rotation_contact_to_world, LEVEL[name.partition("_")[2]])
        for name, contact in held.items() if name in ORDER
    }  # fmt: skip


class _Rise(NamedTuple):
    """Getting up: on hands and knees, then up to two feet, with the posture (nq,) at the end.

    The knees are at ``along`` on the way, the hands ``base`` before them [m].
    """

    stages: list[Stage]
    q: FloatArray
    along: float
    base: float


def _backwards(body: BodyModel, rise: _Rise) -> list[Stage]:
    """Kneeling down: the stages of getting up in the other order of time."""
    begins = [*(stage.q for stage in rise.stages[1:]), rise.q]
    stages = zip(reversed(rise.stages), reversed(begins), strict=True)
    return [Stage.of(body, stage.contacts, q, stage.min_duration) for stage, q in stages]


def _text(place: FloatArray) -> str:
    return f"{np.round(place, 2).tolist()} m"
