"""Places for the hands of a body that goes on its feet: bars to hold on to, level surfaces to lean on.

A hand closes round a bar and may pull; on a surface its heel only presses, at one point with friction.
Lengths are those of a body of 1.75 m and scale with the stature; they are our choice.
"""

import math
from collections.abc import Sequence
from itertools import islice

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import stature_of
from manikin.body.segments import HANDS
from manikin.contact import Contact, grasp, point
from manikin.numerics.spatial import FloatArray, onto_normal, rotation_from_yaw
from manikin.planning.contacts.best_first import heading_of
from manikin.planning.contacts.limb_places import PALM_ROOM
from manikin.scene import Scene

HEIGHTS = (0.5, 1.35)  # lowest and greatest height of a hold above the lower foot [m]
WANTED = (0.30, 0.30, 0.0)  # where a hand is best: ahead of the root, to its side, and above it [m]
SHOULDER, ARM = (0.05, 0.19, 0.45), 0.66  # shoulder from the root, and reach from there with some lean [m]
STOOP = (0.8, 1.0)  # how far shoulders go down to a hold that is low, of a body that squats then [m]
APART = 0.15  # distance between two places that are offered [m]
PALM = 0.05  # half the size of what has to be level below a palm [m]
LEVEL = math.radians(20.0)  # largest slope of a surface to lean on [rad]
_GRID = np.array([[i, j] for i in range(-5, 6) for j in range(-5, 6)]) * 0.08
_CORNERS = PALM * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])


class Handholds:
    """Offers holds for hands around places of the body in one scene, where any ``exist``."""

    def __init__(self, body: BodyModel, scene: Scene, friction: float, max_force: float = 400.0) -> None:
        """Prepare a scene, with a Coulomb coefficient of palms and a largest force of grasps by axis [N]."""
        self._size, self._friction, self._force = stature_of(body) / 1.75, friction, max_force
        self._bars = scene.grasp_lines
        self._level = [item for item in scene.surfaces_facing((0.0, 0.0, 1.0), LEVEL) if len(item.polygon)]
        heights = [float(item.polygon[:, 2].max()) for item in self._level]
        self.exist = bool(self._bars) or max(heights, default=0.0) - min(heights, default=0.0) >= HEIGHTS[0]

    def near(self, roots: Sequence[FloatArray], ground: float, most: int, low: bool = False) -> list[Contact]:
        """Holds of both hands that are in reach from all of some (7,) poses of the root, the best first.

        There are ``most`` at most, ``low`` ones if it may squat; the lower foot is at height ``ground`` [m].
        """
        size, offers = self._size, list[tuple[float, Contact]]()
        for hand, side in zip(HANDS, (1.0, -1.0), strict=True):
            frames = [(root[:3], rotation_from_yaw(heading_of(root))) for root in roots]
            mirror = np.array([1.0, side, 1.0])
            wanted, shoulders = (
                np.array([place + size * turn @ (np.array(away) * mirror) for place, turn in frames])
                for away in (WANTED, SHOULDER)
            )
            for contact in self._around(hand, wanted.mean(axis=0), frames[0], ground):
                place = contact.position
                away = shoulders - place
                away[:, 2] -= np.clip(away[:, 2], 0.0, STOOP[low] * size)
                far = np.linalg.norm(away, axis=1).max()
                if self._in_height(place, ground) and far <= ARM * size:
                    offers.append((float(np.linalg.norm(wanted - place, axis=1).max()), contact))
        chosen: list[Contact] = []
        for _, contact in sorted(offers, key=lambda item: item[0]):
            same = (item for item in chosen if item.effector[0] == contact.effector[0])  # of one side
            if all(np.linalg.norm(item.position - contact.position) >= APART * size for item in same):
                chosen.append(contact)
        return chosen[:most]

    def _in_height(self, place: FloatArray, ground: float) -> bool:
        return HEIGHTS[0] <= float(place[2] - ground) / self._size <= HEIGHTS[1]

    def _around(
        self, hand: str, wanted: FloatArray, frame: tuple[FloatArray, FloatArray], ground: float
    ) -> list[Contact]:
        """Contacts of a hand around a place (3,) of a body whose root has a place and heading."""
        (root, turn), found = frame, list[Contact]()
        for bar in self._bars:
            along = (bar.end - bar.start) / max(bar.length, 1e-9)
            for step in (0.0, APART, -APART):
                middle = bar.nearest(wanted + step * self._size * along)
                # From above, or from the body's side where the bar is upright.
                out = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 0.9 else root - middle
                out = out - (out @ along) * along
                place = middle + (bar.radius + PALM_ROOM) * out / max(float(np.linalg.norm(out)), 1e-9)
                found.append(grasp(hand, place, max_force=self._force))
        for surface in self._level:
            height = (wanted - surface.polygon[0]) @ surface.normal / surface.normal[2]
            flat = wanted - [0.0, 0.0, height]
            if not self._in_height(flat, ground):
                continue
            axes = surface.rotation[:, :2].T
            places = flat + self._size * _GRID @ axes
            places = places[np.argsort(np.linalg.norm(places - flat, axis=1), kind="stable")]
            corners = (places[:, None] + self._size * _CORNERS @ axes).reshape(-1, 3)
            inside = (surface.outside(corners).reshape(len(places), -1) <= 0.0).all(axis=1)
            flat, heel = onto_normal(turn, surface.normal), hand.replace("hand", "wrist")
            for place in islice(places[inside], 12):
                found.append(point(heel, place, friction=self._friction, rotation=flat))
        return found
