"""Bodies in their scene as a shaded picture in perspective, over which a figure draws paths and names."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.contact import Contact
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures import style
from manikin.reports.figures.raster import Camera, Window, hiding, nearness, picture
from manikin.reports.solids import DrawnSolid, body_solid, contact_solids, scene_solids
from manikin.runtime.display import colours_of, readable
from manikin.scene import Scene

AZIMUTH, ELEVATION = np.deg2rad(-62.0), np.deg2rad(16.0)
"""Direction of the eye where no body says which is better [rad]."""
AROUND = 1.0
"""Farther than this from the motion obstacles are cut off [m]."""
PICTURE = 900
"""Pixels along the longer side of a picture."""
_DIRECTIONS = 16
_POINTS, _EVERY = 90, 12
_NAMED = 12


@dataclass(frozen=True, eq=False)
class Space:
    """What stands in a picture, and how it is seen.

    Attributes:
        bodies: Each in one posture.
        headings: (k, 3) unit vectors to where the bodies look.
        scene: Their surroundings, or None.
        contacts: Drawn as sheets on the surfaces.
        seen: (n, 3) points that must be in the picture [m].
        direction: Azimuth and elevation of the eye [rad]; the best for the bodies when None.
    """

    bodies: Sequence[DrawnSolid]
    headings: FloatArray
    scene: Scene | None
    contacts: Sequence[Contact]
    seen: FloatArray
    direction: tuple[float, float] | None = None

    @staticmethod
    def of(
        scene: Scene | None, seen: Iterable[FloatArray], *, contacts: Sequence[Contact] = (),
        body: BodyModel | None = None, postures: Iterable[FloatArray] = (),
    ) -> "Space":  # fmt: skip
        """A body in some configurations (nq,), with further points (..., 3) that must be in the picture."""
        known = [] if body is None or body.is_point_mass else list(postures)
        drawn = [] if body is None else [(q, body_solid(body, q)) for q in known]
        bodies = [solid for _, solid in drawn if solid is not None]
        turned = [Rotation.from_quat(q[3:7]).as_matrix()[:, 0] for q, solid in drawn if solid is not None]
        points = [np.asarray(item).reshape(-1, 3) for item in seen]
        points += [contact.points_in_world for contact in contacts]
        points += [solid.vertices for solid in bodies]
        return Space(bodies, np.reshape(turned, (-1, 3)), scene, contacts, np.vstack(points))

    @cached_property
    def _box(self) -> tuple[FloatArray, FloatArray]:
        return self.seen.min(axis=0) - AROUND, self.seen.max(axis=0) + AROUND

    @cached_property
    def obstacles(self) -> list[DrawnSolid]:
        """Obstacles near the motion, cut where they leave it."""
        return [] if self.scene is None else scene_solids(self.scene, *self._box)

    @cached_property
    def camera(self) -> Camera:
        """The eye that sees most of the bodies, rather from before them."""
        low, high = self.seen.min(axis=0), self.seen.max(axis=0)
        target, distance = (low + high) / 2.0, 2.2 * float(np.linalg.norm(high - low)) + 1.5
        if self.direction is not None:
            return Camera.at(*self.direction, target, distance)
        first = Camera.at(AZIMUTH, ELEVATION, target, distance)
        if not self.bodies:
            return first
        turns = AZIMUTH + np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
        return max((Camera.at(turn, ELEVATION, target, distance) for turn in turns), key=self._score)

    def _score(self, camera: Camera) -> float:
        window = self._window(camera)
        left, right, bottom, top = window
        scale = _POINTS / max(right - left, top - bottom)
        hidden, taken, most = nearness(self.obstacles, camera, window, scale), [], []
        for body in self.bodies:
            points = camera.seen(body.vertices[::_EVERY])
            row = ((top - points[:, 1]) * scale).astype(int).clip(0, hidden.shape[0] - 1)
            column = ((points[:, 0] - left) * scale).astype(int).clip(0, hidden.shape[1] - 1)
            most.append(float(np.mean(points[:, 2] >= hidden[row, column])))
            taken.append(np.unique(row * hidden.shape[1] + column))
        each = np.concatenate(taken)
        overlap = 1.0 - len(np.unique(each)) / len(each)
        return float(
            np.mean(most) + 0.5 * min(most) - overlap + 0.25 * np.mean(self.headings @ camera.towards)
        )

    def _window(self, camera: Camera) -> Window:
        places = [camera.project(self.seen), *(camera.project(item.vertices) for item in self.obstacles)]
        places = np.vstack(places)
        low, high = places.min(axis=0), places.max(axis=0)
        near = camera.project(self.seen)
        # Of long obstacles only what is beside the motion.
        low, high = np.maximum(low, near.min(axis=0) - 0.7), np.minimum(high, near.max(axis=0) + 0.7)
        room = 0.04 * float((high - low).max())
        return low[0] - room, high[0] + room, low[1] - room, high[1] + room

    @cached_property
    def window(self) -> Window:
        """What of the camera's plane is shown [m]."""
        return self._window(self.camera)

    @property
    def shape(self) -> float:
        """Height of the picture over its width."""
        left, right, bottom, top = self.window
        return (top - bottom) / (right - left)

    def draw(self, axes: Axes, points: float | None = None) -> None:
        """Draw the picture on axes to scale without ticks, :data:`PICTURE` pixels wide or high if None."""
        left, right, bottom, top = self.window
        clear = hiding(self.bodies, self.obstacles, self.camera, self.window)
        image = picture(
            [*self.bodies, *self.obstacles, *contact_solids(self.contacts)], self.camera, self.window,
            (points or PICTURE) / max(right - left, top - bottom), clear=clear,
            floor=None if self.scene is None else self.scene.floor_height,
        )  # fmt: skip
        axes.imshow(image, extent=self.window, interpolation="antialiased", zorder=0)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        axes.set_axis_off()

    def draw_points(self, axes: Axes) -> None:
        """Draw the contacts that have no area as squares."""
        contacts = [contact for contact in self.contacts if len(contact.points) <= 2]
        colours = colours_of(contact.effector for contact in contacts)
        for contact in contacts:
            look = {"color": colours[contact.effector], "markersize": 5.0, "zorder": 7}
            self.plot(axes, contact.position[None], "s", **look)

    def name_obstacles(self, labels: style.Labels) -> None:
        """Write the names of the obstacles beside a corner that is seen, where there is room."""
        left, right, bottom, top = self.window
        scale = _POINTS / max(right - left, top - bottom)
        near = nearness([*self.bodies, *self.obstacles], self.camera, self.window, scale)
        for solid in self.obstacles if len(self.obstacles) <= _NAMED else ():
            places = self.camera.seen(solid.vertices)
            row, column = (
                ((top - places[:, 1]) * scale).astype(int),
                ((places[:, 0] - left) * scale).astype(int),
            )
            inside = (row >= 0) & (row < near.shape[0]) & (column >= 0) & (column < near.shape[1])
            places, row, column = places[inside], row[inside], column[inside]
            seen = places[places[:, 2] > near[row, column] - 1e-3]
            if len(seen):
                x, y, _ = seen[np.argmax(seen[:, 0] + 0.5 * seen[:, 1])].tolist()
                labels.write(readable(solid.name), (x, y), (2.0, 0.0), size=7.0, color="#666C77")

    def plot(self, axes: Axes, path: FloatArray, *marker: str, **look: Any) -> None:
        """Draw a path (n, 3) [m]."""
        axes.plot(*self.camera.project(path).T, *marker, **look)
