"""Contacts of a body that crawls under what it cannot walk below: it kneels down, crawls, and gets up again.

The order of the limbs is that of most four-legged animals that creep: a knee, the hand of its side, the other
knee, its hand, so that three of them carry at any time.  Each goes to where the way over the ground has it,
on whatever surface is there.  Getting up is planned from hands and knees to two feet; kneeling down is the
same backwards, as every posture at rest is at rest backwards as well.  Where a later stage refuses a phase,
another way to kneel down or to get up, or another gait, is the remedy.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import chain, product
from typing import NamedTuple

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import stature_of
from manikin.body.segments import FEET
from manikin.contact import Contact, point
from manikin.numerics.spatial import FloatArray, onto_normal, rotation_from_yaw
from manikin.planning.contacts.best_first import Extension
from manikin.planning.contacts.contact_plan import ContactPlan, Contacts, Paces, Stage
from manikin.planning.contacts.crawl_postures import CRAWLERS, STYLES, CrawlPostures, CrawlStyle, fingers_out
from manikin.planning.contacts.endpoint import Endpoints, Habit
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.planning.contacts.walk_search import COLUMN, WalkSettings
from manikin.planning.guide.ground import LOW_STEP, Ground, low_way
from manikin.scene.collision import column_is_free

HANDS = ("left_wrist", "right_wrist")
CRAWLING = (0.2, 0.05, 0.45)  # radius, lowest and highest end of what is free to crawl, at 1.75 m [m]
# Tried, at 1.75 m [m]: hands before knees with knees before feet, to kneel; shares of a step with ways out.
KNEELING = tuple(product((0.60, 0.50), (-0.20, -0.30, -0.12)))
NEARBY = ((1.0, 0.0), (0.6, 0.0), (1.0, -0.05), (1.0, 0.05), (0.6, -0.05))
BEFORE, BEHIND = 0.85, 0.45  # ways from the feet to what is low when a body kneels, gets up, at 1.75 m [m]
NEAR_END = 0.8  # way to the start or goal up to which the body kneels or gets up there, and does not walk [m]
TURNED = math.radians(25.0)  # angle up to which it does so with feet as they are
STEEPEST = math.radians(30.0)  # largest slope of a surface for hands and knees
INSET = 0.03  # distance of hands and knees to the edges of what they are on [m]
LIFT, STEP = 0.05, 0.1  # heights of a limb in flight, and of a foot between its knee's place and its own [m]
PACES = Paces(swing_duration=0.4, swing_speed=1.5, shift_duration=0.15, hinge_pace=3.0, com_pace=0.5)
ON_FOURS_ROOM = (0.02, 0.02, 0.01)  # way of the centre of mass off a posture on all fours [m]; our choice
CLEARANCE = 0.024  # distance to obstacles on all fours: motions take some of it; our choice [m]
# Time in which a leg goes from its knee onto its foot or back [s], and largest turn of a hinge as it does.
TURNING, WIDEST = 1.0, math.radians(100.0)


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


_Choice = tuple[object, ...]
"""What was chosen for some phases of a plan: a style and a gait, or a side with how the body kneels there."""


class CrawlSearch:
    """Search for the contacts of a way that is crawled in part, which can be asked again for another one."""

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
        self._postures = CrawlPostures(self._body, self._scene, poser.settings)
        self._crawling = CrawlPostures(self._body, self._scene, replace(poser.settings, clearance=CLEARANCE))
        self._start, self._goal, self._friction, self._walk = start, goal, friction, walk
        self._endpoints, self._settings = endpoints, settings or WalkSettings()
        self._size = stature_of(self._body) / 1.75
        self._surfaces = self._scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        self._refused, self._choices = set[_Choice](), list[_Choice | None]()

    def run(self) -> Extension:
        """The plan, or why there is none."""
        found = self._planned()
        plan, failure = (None, found) if isinstance(found, str) else (found, None)
        return Extension(plan, self._postures.finder.searches + self._crawling.finder.searches, 0, failure)

    def refuse(self, phase: int) -> bool:
        """Close what was chosen for a phase of the last plan; False where that is walked."""
        choice = self._choices[phase] if phase < len(self._choices) else None
        if choice is not None:
            self._refused.add(choice)
        return choice is not None

    def _planned(self) -> ContactPlan | str:
        ends = np.array([end.contacts[foot].position for end in (self._start, self._goal) for foot in FEET])
        low, high = (
            (self._size * radius, self._size * bottom, self._size * top)
            for radius, bottom, top in (CRAWLING, COLUMN)
        )
        found = low_way(self._scene, Ground(self._scene, STEEPEST), ends, low, high)
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
        down, up = self._risen(way, before, "before"), self._risen(way, behind, "behind")
        if isinstance(down, str) or isinstance(up, str):
            return down if isinstance(down, str) else str(up)
        refused = "every way to crawl there was refused by a later stage"
        reason, columns = "", {style: (*low[:2], self._size * style.needs) for style in STYLES}
        order = sorted(STYLES, key=lambda x: not column_is_free(self._scene, way.places, columns[x]).all())
        for style, gait in ((each, gait) for each in order for gait in each.gaits):
            if (style, gait) in self._refused:
                continue
            crawl = self._on_hands_and_knees(way, down, up, style, gait)
            if not isinstance(crawl, str):
                parts = _backwards(self._body, down), crawl[1:], up.stages[1:]  # kneeling has crawl[0]
                choices = down.choice, (style, gait), up.choice
                self._choices = [each for each, part in zip(choices, parts, strict=True) for _ in part]
                return self._joined(before, [*chain(*parts)], behind)
            reason = reason or crawl
        return reason or refused

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
            self._choices = [*[None] * len(walk.stages), *self._choices[1:]]
        if behind is not self._goal:
            walk = self._walk(behind, self._goal).plan
            if walk is None:
                return "no walk leads on from where the body would get up"
            stages, goal = [*stages, *walk.stages[1:]], walk.goal
        return ContactPlan.of(self._body, stages, goal, PACES)

    # --- kneeling down and getting up -------------------------------------------------------------

    def _risen(self, way: _Way, standing: Stage, side: str) -> "_Rise | str":
        """Stages from hands and knees to the feet of a stage on one side, or why there are none."""
        feet = {foot: standing.contacts[foot] for foot in FEET}
        middle = np.mean([contact.position for contact in feet.values()], axis=0)
        along = float(way.along[int(np.argmin(np.linalg.norm(way.places - middle, axis=1)))])
        reason = ""
        for (base, behind), lead in product(KNEELING, ("right", "left")):
            choice = side, base, behind, lead
            if choice in self._refused:
                continue
            at = along + behind * self._size
            held = self._contacts(way, (at, at + base * self._size))
            stages = held if isinstance(held, str) else self._got_up(held, feet, lead)
            if not isinstance(stages, str):
                return _Rise(stages, standing.q, at, base * self._size, choice)
            reason = reason or stages
        return f"cannot kneel down at {_text(middle)}: {reason or 'a later stage refused it'}"

    def _got_up(self, held: dict[str, Contact], feet: Contacts, lead: str) -> list[Stage] | str:
        """From four contacts onto two feet, the leading one first."""
        other = "left" if lead == "right" else "right"
        posed = self._postures.pose(held, held, self._postures.over(held))
        if posed.q is None:
            return f"there is no posture on hands and knees: {posed.reason}"
        changes = [
            (f"{lead}_knee", None), (None, f"{lead}_foot"), (f"{other}_knee", None), (None, f"{other}_foot"),
            *((hand, None) for hand in HANDS),
        ]  # fmt: skip
        contacts, stages = dict(held), [Stage.of(self._body, held, posed.q, self._settings.shift_duration)]
        for leaving, landing in changes:
            after = {name: contact for name, contact in contacts.items() if name != leaving}
            if landing is not None:
                after[landing] = feet[landing]
            both = {**contacts, **after}
            staying = {name: contact for name, contact in after.items() if name in contacts}
            # Hands leave one after the other, the first of them staying near.
            near = {name: held[name] for name in HANDS if name not in both}
            guide = self._postures.squatting(feet) if all(foot in both for foot in FEET) else None
            before, posed = posed.q, self._postures.pose(both, staying, posed.q, guide, near)
            if posed.q is None:
                return f"{leaving or landing} cannot {'be put down' if landing else 'leave'}: {posed.reason}"
            if np.abs(posed.q - before)[7:].max() > WIDEST:
                return f"a joint turns too far as {leaving or landing} {'lands' if landing else 'leaves'}"
            ways, via = [before, posed.q], None
            if landing is not None:
                start = Configuration(self._body, before).effector_placement(landing)[1]
                middle = 0.5 * (start + feet[landing].position) + STEP * feet[landing].normal
                via = self._postures.between(contacts, (before, posed.q), {landing: middle})
                if via is None:
                    return f"{landing} finds no way to {_text(feet[landing].position)}"
            elif len(stages) > 1 and self._postures.finder.crossing(*ways):
                # A broad trunk keeps clear of the thighs half-way. The first stage is joined to the crawl.
                via = self._postures.between(contacts, (before, posed.q))
            if via is not None:
                stages[-1] = Stage.of(self._body, contacts, before, TURNING, via=via)
                ways.insert(1, via)
            if crossed := self._postures.finder.crossing(*ways):
                return f"{crossed} pass through each other as {leaving or landing} moves"
            contacts = after
            stages.append(Stage.of(self._body, contacts, posed.q, self._settings.reach_duration))
        return stages

    # --- on hands and knees -----------------------------------------------------------------------

    def _on_hands_and_knees(
        self, way: _Way, down: "_Rise", up: "_Rise", style: CrawlStyle, gait: tuple[float, float]
    ) -> list[Stage] | str:
        """Stages from one place on hands and knees to another, or why there are none."""
        stride, base = (self._size * value for value in gait)
        stages, goal = down.stages[:1], up.stages[0].contacts
        total, contacts, q = up.along - down.along, dict(stages[0].contacts), stages[0].q
        begin = {"knee": down.along, "wrist": down.along + base}
        end = {"knee": up.along, "wrist": up.along + up.base}
        reached = {name: down.along + down.base * name.endswith("wrist") for name in CRAWLERS}
        for number in range(4 * (2 + math.ceil(total / (0.5 * stride)))):
            name = CRAWLERS[number % 4]
            part = name.partition("_")[2]
            ahead = begin[part] + 0.25 * (number + 1) * stride
            target = goal[name] if ahead >= end[part] else None
            if contacts[name] is not target:
                ends = reached[name], min(ahead, end[part])
                step = self._stepped(way, name, ends, target, contacts, q, style)
                if isinstance(step, str):
                    return step
                reached[name], *made = step
                stages += made
                q, contacts = made[-1].q, dict(made[-1].contacts)
            if all(contacts[each] is goal[each] for each in CRAWLERS):
                return stages
        return "does not arrive on hands and knees"

    def _stepped(
        self, way: _Way, name: str, ends: tuple[float, float], target: Contact | None,
        contacts: Contacts, q: FloatArray, style: CrawlStyle,
    ) -> tuple[float, Stage, Stage] | str:  # fmt: skip
        """New place and stages of a limb that goes to a contact, where the way has it, or near there."""
        staying = {other: contact for other, contact in contacts.items() if other != name}
        lifted = self._crawling.pose(contacts, staying, q, style=style)
        if lifted.q is None:
            return f"{name} cannot leave {_text(contacts[name].position)}: {lifted.reason}"
        reason = f"there is nothing to put {name} on beyond {_text(contacts[name].position)}"
        spots = ((ends[0] + share * (ends[1] - ends[0]), out) for share, out in NEARBY)
        offers = ((along, self._contact(way, name, along, style, out)) for along, out in spots)
        for along, contact in chain([(ends[1], target)], offers):
            if contact is None:
                continue
            landed = {**staying, name: contact}
            landing = self._crawling.pose(landed, staying, lifted.q, style=style)
            if landing.q is None:
                reason = f"{name} cannot be put down at {_text(contact.position)}: {landing.reason}"
                continue
            middle = 0.5 * (contacts[name].position + contact.position) + LIFT * contact.normal
            via = self._crawling.between(staying, (lifted.q, landing.q), {name: middle})
            if via is None:
                reason = f"{name} finds no way to {_text(contact.position)}"
                continue
            if crossed := self._crawling.finder.crossing(q, lifted.q, via, landing.q):
                reason = f"{crossed} pass through each other as {name} moves"
                continue
            flight = PACES.flight(contacts[name], contact)
            flying = Stage.of(self._body, staying, lifted.q, flight, ON_FOURS_ROOM, via)
            return along, flying, Stage.of(self._body, landed, landing.q, PACES.shift_duration, ON_FOURS_ROOM)
        return reason

    # --- contacts -----------------------------------------------------------------------------------

    def _contacts(self, way: _Way, ends: tuple[float, float]) -> dict[str, Contact] | str:
        """Knees and hands at two places along the way."""
        found: dict[str, Contact] = {}
        for name in CRAWLERS:
            contact = self._contact(way, name, ends[name.endswith("wrist")], STYLES[0], 0.0)
            if contact is None:
                return f"there is nothing for {name} at {_text(way.at(ends[0])[0])}"
            found[name] = contact
        return found

    def _contact(self, way: _Way, name: str, along: float, style: CrawlStyle, out: float) -> Contact | None:
        """Contact of a limb beside the way, on the surface that is nearest to its height."""
        place, heading = way.at(along)
        side, _, part = name.partition("_")
        turn = rotation_from_yaw(heading)
        beside = style.apart[part == "wrist"] * self._size + out
        wanted = place + (beside if side == "left" else -beside) * turn[:, 1]
        best: Contact | None = None
        least = 0.25 * self._size
        for surface in self._surfaces:
            base = surface.polygon[0]
            height = base[2] - float((wanted - base)[:2] @ surface.normal[:2]) / surface.normal[2]
            spot = np.array([wanted[0], wanted[1], height])
            around = spot + INSET * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
            if abs(height - wanted[2]) < least and surface.outside(around).max() <= 0.0:
                least, frame = abs(height - wanted[2]), onto_normal(turn @ fingers_out(name), surface.normal)
                best = point(name, spot, friction=self._friction, rotation=frame)
        return best


class _Rise(NamedTuple):
    """Getting up: on hands and knees, then up to two feet, with the posture (nq,) at the end.

    The knees are at ``along`` on the way, the hands ``base`` before them [m]; ``choice`` made it so.
    """

    stages: list[Stage]
    q: FloatArray
    along: float
    base: float
    choice: _Choice


def _backwards(body: BodyModel, rise: _Rise) -> list[Stage]:
    """Kneeling down: the stages of getting up in the other order of time."""
    begins = [*(stage.q for stage in rise.stages[1:]), rise.q]
    stages = zip(reversed(rise.stages), reversed(begins), strict=True)
    return [Stage.of(body, stage.contacts, q, stage.min_duration, via=stage.via) for stage, q in stages]


def _text(place: FloatArray) -> str:
    return f"{np.round(place, 2).tolist()} m"
