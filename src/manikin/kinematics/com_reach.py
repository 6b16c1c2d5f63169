"""Reach of the centre of mass over given contacts, from the body's own kinematics.

A stance leaves the centre of mass a region: a convex polytope with given normals, linear in a plan of the
centre of mass; how far it reaches along each of them is sampled, see :mod:`manikin.kinematics.reach_sampler`.

No obstacle and no balance is looked at.  Tonneau et al., "2PAC", ACM Trans. Graph. 37(5), 2018, have such
regions for each contact of a robot alone; the common sampling of all contacts, which couples them by heading
and lean of one trunk, is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactKind
from manikin.kinematics.reach_sampler import LocalContact, ReachBody, ReachSampler
from manikin.numerics.spatial import FloatArray, frozen_array, rotations

_CUBE = np.delete(np.array(list(product([-1.0, 0.0, 1.0], repeat=3))), 13, axis=0)  # without its middle
NORMALS = frozen_array(_CUBE / np.linalg.norm(_CUBE, axis=1)[:, None], "normals")
"""(26, 3) normals of a region in the heading frame of its stance."""

ROOM = 0.01
"""Room that is left to the faces of a region around places that are known to be reached [m]."""


@dataclass(frozen=True, eq=False)
class ComRegion:
    """Convex region of the centre of mass over a stance, in the world.

    Attributes:
        normals: (m, 3) unit outward normals.
        offsets: (m,) the region is ``normals @ p <= offsets`` [m].
        missed: Least violation found where no posture holds the contacts [rad, or 3 rad a metre]; 0 where
            there is one. An empty region has no rows.
    """

    normals: FloatArray
    offsets: FloatArray
    missed: float = 0.0

    @classmethod
    def everywhere(cls) -> "ComRegion":
        """The region without a face."""
        return cls(np.zeros((0, 3)), np.zeros(0))

    @property
    def empty(self) -> bool:
        """Whether no posture was found that holds the contacts."""
        return self.missed > 0.0

    def including(self, points: ArrayLike) -> "ComRegion":
        """The region with its faces moved out to :data:`ROOM` beyond points (..., 3) that are known [m]."""
        ends = np.reshape(np.asarray(points, dtype=np.float64), (-1, 3)) @ self.normals.T
        return replace(self, offsets=np.maximum(self.offsets, ends.max(axis=0, initial=-np.inf) + ROOM))

    @property
    def top(self) -> float:
        """Greatest height in the region [m]; infinite without a face above."""
        return float(self.offsets[self.normals[:, 2] > 1.0 - 1e-9].min(initial=np.inf))

    def above(self, height: float) -> "ComRegion":
        """The part of the region at least at a height [m]."""
        below = self.normals[:, 2] < -1.0 + 1e-9
        return replace(self, offsets=np.where(below, np.minimum(self.offsets, -height), self.offsets))

    def below(self, point: ArrayLike, normal: ArrayLike) -> "ComRegion":
        """The part of the region behind a plane through a point (3,) [m]."""
        out = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
        faces, ends = np.vstack([self.normals, out]), np.append(self.offsets, out @ np.asarray(point))
        return replace(self, normals=faces, offsets=ends)

    def violation(self, points: ArrayLike) -> FloatArray:
        """(...) largest distance of (..., 3) points beyond a face [m]; negative is room."""
        places = np.asarray(points, dtype=np.float64)
        if self.empty:
            return np.full(places.shape[:-1], np.inf)
        return np.max(places @ self.normals.T - self.offsets, axis=-1, initial=-np.inf)


class ComReach:
    """Regions of the centre of mass of one body over any of its stances; :meth:`of` keeps them."""

    def __init__(self, body: BodyModel) -> None:
        self.parts = ReachBody(body)
        self._regions: dict[tuple[object, ...], ComRegion] = {}
        standing = Configuration(body)
        self._standing = {
            name: np.array(standing.effector_placement(name)[1] - standing.q[:3]) for name in body.effectors
        }

    @staticmethod
    @lru_cache(maxsize=16)
    def of(body: BodyModel) -> "ComReach":
        """The regions of a body, prepared once."""
        return ComReach(body)

    def region(self, contacts: Sequence[Contact]) -> ComRegion:
        """Region of the centre of mass with all contacts held.

        Postures keep a little from the ends of the joint ranges; feet that stand on their toes or heels may
        pitch about them. Equal stances are computed once, wherever they stand. Contacts are those of one
        stance, one for each effector.
        """
        if not contacts:
            return ComRegion.everywhere()
        frame, origin = self._heading_frame(contacts)
        local = [_in_frame(contact, frame, origin) for contact in contacts]
        key = tuple(
            (c.effector, str(c.part), *np.round(c.position, 4), *np.round(c.rotation.ravel(), 4))
            for c in local
        )
        if key not in self._regions:
            held = ReachSampler(self.parts, local, NORMALS).held()
            self._regions[key] = (
                ComRegion(NORMALS, held.projections.max(axis=0))
                if held.missed <= 0.0
                else replace(ComRegion.everywhere(), missed=held.missed)
            )
        found = self._regions[key]
        normals = found.normals @ frame.T
        return replace(found, normals=normals, offsets=found.offsets + normals @ origin)

    def _heading_frame(self, contacts: Sequence[Contact]) -> tuple[FloatArray, FloatArray]:
        """Axes and origin of the stance: the middle of its contacts, heading as standing fits them best."""
        places = np.array([contact.position for contact in contacts])
        own = np.array([self._standing[contact.effector] for contact in contacts])
        origin = places.mean(axis=0)
        apart, own_apart = places - origin, own - own.mean(axis=0)
        turn = np.sum((apart @ [1.0, 1j, 0.0]) * np.conj(own_apart @ [1.0, 1j, 0.0]))
        for contact in contacts:
            if contact.kind is ContactKind.SOLE:
                turn += 0.3 * self.parts.scale**2 * np.exp(1j * contact.yaw)
        if abs(turn) < 1e-9:
            turn = np.exp(1j * contacts[0].yaw)
        yaw = float(np.angle(turn))
        return rotations(np.array(yaw), np.array(0.0), np.array(0.0)), origin


def _in_frame(contact: Contact, frame: FloatArray, origin: FloatArray) -> LocalContact:
    position = (contact.position - origin) @ frame
    rotation = frame.T @ contact.rotation_contact_to_world
    return LocalContact(contact.effector, contact.kind, contact.part, position, rotation, contact.length / 2)
