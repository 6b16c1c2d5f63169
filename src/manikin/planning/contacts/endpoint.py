"""Where a task starts or ends: postures on contacts, from a place, a heading and a habit.

A start may also be on any limbs, each near where a posture has it (:func:`starts_on_limbs`).
"""

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import chain, product

import numpy as np

from manikin.body import Configuration
from manikin.body.limbs import stature_of
from manikin.body.segments import FEET
from manikin.contact import Contact
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.contact_plan import Stage
from manikin.planning.contacts.footholds import Footholds
from manikin.planning.contacts.limb_search import LimbHolds
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.planning.contacts.seat import Sitter, Sitting, hand_supports, leave_seat
from manikin.scene import Surface

SEAT_HEIGHTS = (0.12, 0.40)  # lowest and greatest height of a seat above the feet [statures]; our choice
FEET_BEFORE_SEAT = (0.15, 0.225, 0.3)  # places of a floor before the middle of the buttocks [statures]
LEANT = 0.057  # way of the weight of a body that leans down to put its hands beside it [statures]; our choice
SITTING_TIME = 0.35  # shortest time for which a body sits before it moves [s]
STEEP = np.deg2rad(80.0)  # slope up to which a surface is told as too steep, not as missing [rad]
CROUCH = 0.6  # height of a crouching body's root relative to a standing one's; our choice


class Habit(StrEnum):
    """Way in which a body is at rest."""

    STANDING = "standing"
    SEATED = "seated"
    CROUCHED = "crouched"


@dataclass(frozen=True, eq=False)
class Endpoint:
    """A start or goal: contacts and a posture at rest on them; or None, and the reason in one line."""

    stage: Stage | None
    failure: str | None = None


class Endpoints:
    """Finds starts and goals of a body on its feet or a seat in one scene."""

    def __init__(
        self, poser: PostureFinder, friction: float, *, rolls: bool = False, hands: bool = False
    ) -> None:
        """Prepare the scene of a finder of postures, of a body with soles.

        Args:
            friction: Coulomb coefficient of the soles.
            rolls: Whether a seated pelvis may roll forward on the front of the buttocks.
            hands: Whether hands push beside a seat wherever they can, not only where they have to.
        """
        self._poser, self._friction, self._rolls, self._hands = poser, friction, rolls, hands
        self._body, self._scene = poser.body, poser.scene
        self._stature = stature_of(poser.body)
        self._footholds = Footholds(self._body, self._scene)

    def find(self, at: FloatArray, heading: float, habit: Habit, height: float | None = None) -> Endpoint:
        """Posture at a place; the lowest surface on which one exists, where no height is given.

        Args:
            at: (2,) below the root, or of the middle of the buttocks on a seat, which are farther forward
                where the body can only rise from there [m].
            heading: Where to face [rad].
            height: Height of the surface to stand or sit on [m].
        """
        if habit is Habit.SEATED:
            return self._seated(np.asarray(at), heading, height)
        reasons: list[str] = []
        for contacts, guess in self._standing(np.asarray(at), heading, habit, height):
            posed = self._poser.pose(contacts, contacts, guess, guess[:7], restarts=True)
            if posed.q is not None:
                return Endpoint(Stage.of(self._body, contacts, posed.q, 0.35))
            reasons.append(posed.reason)
        why = reasons[0] if reasons else self._no_place(np.asarray(at), height)
        return Endpoint(None, f"no posture {habit} at {np.round(at, 3).tolist()} m: {why}")

    def _no_place(self, at: FloatArray, height: float | None) -> str:
        """Why both feet have no place: what is there is too steep, or too small."""
        slopes = [np.arccos(surface.normal[2]) for _, surface in self._surfaces(at, height, STEEP)]
        if not slopes or min(slopes) <= self._footholds.steepest:
            return "there is no surface with room for both feet"
        slope, most = np.rad2deg([min(slopes), self._footholds.steepest])
        return f"the surface there slopes by {slope:.0f} degrees; feet stand on {most:.0f} at most"

    def _standing(
        self, at: FloatArray, heading: float, habit: Habit, height: float | None
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        q = np.array(self._body.standing_posture())
        turn, state = rotation_from_yaw(heading), Configuration(self._body, q)
        for level in self._levels(at, height):
            contacts: dict[str, Contact] = {}
            for foot in FEET:
                wanted = np.array([*at, level]) + turn @ state.effector_placement(foot)[1]
                for contact in self._footholds.near(foot, wanted, heading, self._friction):
                    if abs(contact.position[2] - level) < 0.1:
                        contacts[foot] = contact
                        break
            if len(contacts) == 2:
                guess = q.copy()
                guess[:2], guess[3:7] = at, [0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)]
                guess[2] = level + q[2] * (CROUCH if habit is Habit.CROUCHED else 1.0)
                yield contacts, guess

    def _seated(self, at: FloatArray, heading: float, height: float | None) -> Endpoint:
        """The best way to sit near a place from which the body can rise.

        The buttocks are on the lowest seat there on which it can, at the place or before it.
        """
        reasons: list[str] = []
        for contacts, guess in self._sittings(at, heading, height):
            # A body that sits has its weight where its upright trunk puts it, not over the root.
            place = Configuration(self._body, guess).com[:2]
            posed = self._poser.pose(contacts, contacts, guess, guess[:7], place=place, restarts=True)
            if posed.q is None and len(contacts) > 1 + len(FEET):
                # Hands come to what is low as the trunk leans.
                place = place + LEANT * self._stature * rotation_from_yaw(heading)[:2, 0]
                posed = self._poser.pose(contacts, contacts, guess, guess[:7], place=place, restarts=True)
            if posed.q is None:
                reasons.append(posed.reason)
                continue
            start = Stage.of(self._body, contacts, posed.q, SITTING_TIME)
            leaving = leave_seat(self._poser, start, frozenset(FEET))
            if leaving.failure is None:
                return Endpoint(start)
            reasons.append(leaving.failure)
        nothing = "there is no surface at the height of a seat with room for both feet before it"
        why = "; ".join(dict.fromkeys([reasons[0], reasons[-1]])) if reasons else nothing
        return Endpoint(None, f"no posture seated at {np.round(at, 3).tolist()} m: {why}")

    def _sittings(self, at: FloatArray, heading: float, height: float | None) -> Iterator[Sitting]:
        """Ways to sit on each seat, the lowest first, with hands that push and without."""
        low, high = (share * self._stature for share in SEAT_HEIGHTS)
        sitter = Sitter(self._body, self._footholds, self._friction, rolls=self._rolls)
        # Below the seat there may be no floor: it is looked for where the feet may be.
        forward = self._stature * rotation_from_yaw(heading)[:2, 0]
        ahead = [at + distance * forward for distance in FEET_BEFORE_SEAT]
        for floor in sorted({level for place in ahead for level in self._levels(place, None)}):
            for level, seat in self._surfaces(at, height):
                if not low <= level - floor <= high:
                    continue
                bare = list(sitter.sittings(np.array([*at, level]), heading, seat, floor))
                rest = self._stature, self._friction, self._footholds.steepest
                hands = ((hand_supports(self._scene, on["buttocks"], *rest), on, guess) for on, guess in bare)
                pushing = (({**on, **beside}, guess) for beside, on, guess in hands if beside)
                yield from chain(pushing, bare) if self._hands else chain(bare, pushing)

    def _levels(self, at: FloatArray, height: float | None) -> list[float]:
        """Heights of the surfaces below and above a place, the lowest first; those near one given."""
        return sorted({round(level, 6) for level, _ in self._surfaces(at, height)})

    def _surfaces(
        self, at: FloatArray, height: float | None, steepest: float | None = None
    ) -> list[tuple[float, Surface]]:
        """Surfaces below and above a place with their heights, the lowest first; those near one given."""
        found: list[tuple[float, Surface]] = []
        for surface in self._scene.surfaces_facing((0.0, 0.0, 1.0), steepest or self._footholds.steepest):
            base, normal = surface.polygon[0], surface.normal
            level = base[2] - float((at - base[:2]) @ normal[:2]) / normal[2]
            near = height is None or abs(level - height) < 0.05
            if near and float(surface.outside(np.array([[at[0], at[1], level]]))[0]) <= 1e-9:
                found.append((level, surface))
        return sorted(found, key=lambda item: item[0])


PLACES = 6  # places of each limb among which a start is sought
TRIES = 40  # most of their combinations for which a posture is looked for; our choice


def starts_on_limbs(
    poser: PostureFinder, holds: Sequence[LimbHolds], q: FloatArray, duration: float
) -> Iterator[Endpoint]:
    """Starts near a posture that touches nothing, the best contacts first; one failure where there is none.

    Args:
        holds: Places of each limb.
        q: (nq,) where the body should be, each limb where it should be relative to the root.
        duration: Shortest time for which the contacts are held [s].
    """
    offered = {item.effector: found for item in holds if (found := item.nearest(q[:7], PLACES))}
    if not offered:
        yield Endpoint(None, "no limb has a contact")
        return
    reason, any_start, state = "", False, Configuration(poser.body, q)
    for contacts in best_first(offered, TRIES):
        near = q
        for item in holds:
            if item.effector in contacts:
                near = item.stretched(near, q[:7], contacts[item.effector], state)
        # Tips begin as they stand best; upright from the start an insect's legs meet on their way.
        posed = poser.pose(contacts, contacts, near, q[:7], upright=False)
        posed = poser.eased(posed, contacts, contacts, upright=False).at_rest
        reason = reason or posed.reason
        if posed.q is not None:
            any_start = True
            yield Endpoint(Stage.of(poser.body, contacts, posed.q, duration))
    if not any_start:
        yield Endpoint(None, reason)


def best_first(offered: Mapping[str, list[tuple[float, Contact]]], most: int) -> list[dict[str, Contact]]:
    """One contact for each limb in ``most`` ways, the least loss of score in all first."""
    choices = product(*offered.values())
    best = heapq.nsmallest(most, choices, key=lambda choice: sum(loss for loss, _ in choice))
    return [{contact.effector: contact for _, contact in choice} for choice in best]
