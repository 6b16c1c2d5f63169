"""Where a task starts or ends: a posture on its contacts, from a place, a heading and a habit."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import Contact, FrictionModel, sole
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.contact_plan import Stage
from manikin.planning.contacts.limb_places import Footholds, stature_of
from manikin.planning.contacts.posture_finder import PostureFinder, PostureFinderSettings
from manikin.scene import Scene, Surface

SEAT_FRICTION = 0.3
"""Of clothes on a seat; our choice."""

SEAT_HEIGHTS = (0.12, 0.40)
"""Lowest and greatest height of a seat above the feet [statures]; our choice."""

FEET_BEFORE_SEAT = tuple(np.linspace(0.15, 0.30, 11))
"""Distances from the middle of the buttocks to that of the soles that are tried [statures]."""

CROUCH = 0.6
"""Height of a crouching body's root relative to a standing one's; our choice."""


class Habit(StrEnum):
    """How a body is at rest."""

    STANDING = "standing"
    SEATED = "seated"
    CROUCHED = "crouched"


@dataclass(frozen=True, eq=False)
class Endpoint:
    """A start or goal, or why there is none.

    Attributes:
        stage: Contacts and posture, or None.
        failure: None, or the reason in one line.
    """

    stage: Stage | None
    failure: str | None = None


class Endpoints:
    """Finds starts and goals in one scene."""

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        friction: float,
        reference: FloatArray | None = None,
        *,
        natural: bool = False,
        friction_model: FrictionModel = "outer",
    ) -> None:
        """Prepare a scene.

        Args:
            body: A body with soles.
            scene: Its surroundings.
            friction: Coulomb coefficient of the soles.
            reference: (nq,) posture to be like where the task leaves freedom; standing when omitted.
            natural: Whether hips and shoulders keep to their learnt ranges.
            friction_model: Of the stances.
        """
        self._body, self._scene, self._friction = body, scene, friction
        self._stature = stature_of(body)
        settings = PostureFinderSettings(natural=natural, friction_model=friction_model)
        self._poser = PostureFinder(body, scene, reference, settings)
        self._footholds = Footholds(body, scene)

    def find(self, at: FloatArray, heading: float, habit: Habit, height: float | None = None) -> Endpoint:
        """Posture at a place; the lowest surface on which one exists, where no height is given.

        Args:
            at: (2,) below the root, or of the middle of the buttocks on a seat [m].
            heading: Where to face [rad].
            habit: Standing, seated or crouched.
            height: Of the surface to stand or sit on [m].
        """
        reasons: list[str] = []
        tried = self._seated if habit is Habit.SEATED else self._standing
        for contacts, guess in tried(np.asarray(at), heading, habit, height):
            # A body that sits has its weight where its upright trunk puts it, not over the root.
            place = Configuration(self._body, guess).com[:2] if habit is Habit.SEATED else None
            posed = self._poser.pose(contacts, contacts, guess, guess[:7], place=place, restarts=True)
            if posed.q is not None:
                return Endpoint(Stage.of(self._body, contacts, posed.q, 0.35))
            reasons.append(posed.reason)
        where = f"{habit} at {np.round(at, 3).tolist()} m"
        why = reasons[0] if reasons else _NOWHERE[habit]
        return Endpoint(None, f"no posture {where}: {why}")

    def risen(self, stage: Stage) -> Endpoint:
        """Where a body is when it has left all contacts of a start but those of its feet."""
        feet = {name: contact for name, contact in stage.contacts.items() if name.endswith("foot")}
        posed = self._poser.pose(feet, feet, stage.q, restarts=True)
        if posed.q is None:
            return Endpoint(None, f"no posture on {', '.join(feet) or 'feet'} alone: {posed.reason}")
        return Endpoint(Stage.of(self._body, feet, posed.q, 0.3))

    def _standing(
        self, at: FloatArray, heading: float, habit: Habit, height: float | None
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        q = np.array(self._body.standing_posture())
        turn = rotation_from_yaw(heading)
        state = Configuration(self._body, q)
        for level in self._levels(at, height):
            contacts: dict[str, Contact] = {}
            for foot in ("left_foot", "right_foot"):
                own = state.effector_placement(foot)[1]
                wanted = np.array([*at, level]) + turn @ own
                holds = [h for h in self._footholds.near(wanted, heading) if abs(h.position[2] - level) < 0.1]
                if holds:
                    size = self._footholds.length, self._footholds.width
                    contacts[foot] = holds[0].contact(foot, *size, self._friction)
            if len(contacts) == 2:
                guess = q.copy()
                guess[:2], guess[3:7] = at, _level_turn(heading)
                guess[2] = level + q[2] * (CROUCH if habit is Habit.CROUCHED else 1.0)
                yield contacts, guess

    def _seated(
        self, at: FloatArray, heading: float, _habit: Habit, height: float | None
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        size = self._stature
        low, high = (share * size for share in SEAT_HEIGHTS)
        for floor in self._levels(at, None):
            for seat in self._levels(at, height):
                if not low <= seat - floor <= high:
                    continue
                place = np.array([*at, seat])
                buttocks = sole(
                    "buttocks", place, heading, length=SEAT_LENGTH * size, width=SEAT_WIDTH * size,
                    friction=SEAT_FRICTION,
                )  # fmt: skip
                yield from self._feet_before(buttocks, floor, heading)

    def _feet_before(
        self, buttocks: Contact, floor: float, heading: float
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        """Feet on the floor before a seat, the nearest to it first."""
        turn, size = rotation_from_yaw(heading), self._stature
        q = self._body.posture({**self._body.standing_angles, **_SITTING})
        q[3:7] = _level_turn(heading)
        q[:3] += buttocks.position - Configuration(self._body, q).effector_placement("buttocks")[1]
        for distance in FEET_BEFORE_SEAT:
            contacts = {"buttocks": buttocks}
            for foot, side in (("left_foot", 0.07), ("right_foot", -0.07)):
                wanted = buttocks.position + turn @ np.array([distance * size, side * size, 0.0])
                wanted[2] = floor
                holds = [
                    h for h in self._footholds.near(wanted, heading) if abs(h.position[2] - floor) < 0.02
                ]
                close = [h for h in holds if np.linalg.norm(h.position - wanted) < 0.05]
                if close:
                    sizes = self._footholds.length, self._footholds.width
                    contacts[foot] = close[0].contact(foot, *sizes, self._friction)
            if len(contacts) == 3:
                yield contacts, q

    def _levels(self, at: FloatArray, height: float | None) -> list[float]:
        """Heights of the surfaces below and above a place, the lowest first; those near one given."""
        found: set[float] = set()
        for surface in self._scene.surfaces_facing((0.0, 0.0, 1.0), self._footholds.settings.steepest):
            level = _height_at(surface, at)
            if level is not None and (height is None or abs(level - height) < 0.05):
                found.add(round(level, 6))
        return sorted(found)


_NOWHERE = {
    Habit.STANDING: "there is no surface with room for both feet",
    Habit.SEATED: "there is no surface at the height of a seat with room for both feet before it",
    Habit.CROUCHED: "there is no surface with room for both feet",
}

_SITTING = {
    f"{side}_{joint}": angle
    for side in ("left", "right")
    for joint, angle in (("hip_flexion", 1.4), ("knee_flexion", 1.6), ("ankle_dorsiflexion", 0.1))
}


def _level_turn(yaw: float) -> FloatArray:
    """(4,) quaternion xyzw of a turn about the vertical."""
    return np.array([0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])


def _height_at(surface: Surface, at: FloatArray) -> float | None:
    """Height of a surface above or below a place on the ground [m], or None beside it."""
    base = surface.polygon[0]
    height = base[2] - float((at - base[:2]) @ surface.normal[:2]) / surface.normal[2]
    point = np.array([[at[0], at[1], height]])
    return height if float(surface.outside(point)[0]) <= 1e-9 else None
