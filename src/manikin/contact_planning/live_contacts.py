"""Contacts of all limbs of a body that is moved by hand: what the viewer's interactive mode shows."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import ContactKind
from manikin.contact_planning.efort import Task
from manikin.contact_planning.generator import ContactGenerator, GeneratedContact
from manikin.contact_planning.heuristics import heuristic_named
from manikin.contact_planning.samples import sample_limbs
from manikin.contact_planning.single_contact import SOME_EFORT, Role, check_limbs, reached_efort
from manikin.contact_planning.touch import ContactRules
from manikin.scene import Scene
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False)
class LiveAnswer:
    """What every limb found.

    Attributes:
        q: (nq,) the body with each limb that found a contact in it.
        answers: The limbs' answers by their names, in the order in which they were asked.
        efforts: EFORT of each posture found [N per N.m].
        wall_s: Wall time of all requests [s].
    """

    q: FloatArray
    answers: dict[str, GeneratedContact]
    efforts: dict[str, float]
    wall_s: float


class LiveContacts:
    """The pose of a body, a task, and the contacts that follow from both.

    Attributes:
        body: The body.
        scene: Its surroundings.
        q: (nq,) the body as it was put, before any limb is moved.
        azimuth_deg: Of the task about the vertical, from world x [deg].
        elevation_deg: Of the task above the horizon [deg].
        limbs: Names of the limbs that are asked.
        heuristic: Name of the preference.
        role: What the limbs do with their contacts.
        pulling: Whether they hold on and pull.
    """

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        q: ArrayLike,
        *,
        samples: int = 10_000,
        seed: int = 0,
        rules: ContactRules | None = None,
    ) -> None:
        """Sample the limbs and prepare the scene.

        Args:
            body: A body with limbs.
            scene: Its surroundings.
            q: (nq,) where it begins.
            samples: Number of samples of each limb.
            seed: Of the samples.
            rules: What contacts can carry.

        Raises:
            BodyError: If the body has no limbs.
        """
        check_limbs(body)
        self.body, self.scene = body, scene
        self.q = np.array(q, dtype=np.float64)
        self.azimuth_deg, self.elevation_deg = 0.0, 90.0
        self.limbs: tuple[str, ...] = tuple(limb.name for limb in body.limbs)
        self.heuristic = "efort"
        self.role = Role.AUTO
        self.pulling = False
        self._generator = ContactGenerator(
            body, scene, sample_limbs(body, np.random.default_rng(seed), samples), rules=rules
        )

    def move(self, position: ArrayLike, quaternion: ArrayLike) -> None:
        """Put the root elsewhere.

        Args:
            position: (3,) of the root [m].
            quaternion: (4,) xyzw of the root; normalised here.
        """
        turn = frozen_array(quaternion, "quaternion", (4,))
        self.q[:3] = frozen_array(position, "position [m]", (3,))
        self.q[3:7] = turn / np.linalg.norm(turn)

    def aim(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Turn the task: azimuth about the vertical from world x, elevation above the horizon [deg]."""
        self.azimuth_deg, self.elevation_deg = float(azimuth_deg), float(elevation_deg)

    @property
    def direction(self) -> FloatArray:
        """(3,) unit direction of the task in the world."""
        azimuth, elevation = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        level = np.cos(elevation)
        return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])

    def ask(self, limbs: Sequence[str]) -> None:
        """Choose the limbs that are asked, in the body's own order."""
        self.limbs = tuple(limb.name for limb in self.body.limbs if limb.name in limbs)

    def answer(self) -> LiveAnswer:
        """Ask one limb after the other; each sees the postures of those before it."""
        started = time.perf_counter()
        heuristic = heuristic_named(self.heuristic, pulling=self.pulling)
        kind = ContactKind.GRASP if self.pulling else None
        q, answers, efforts = np.array(self.q), {}, {}
        for name in self.limbs:
            for role in self._roles(name):
                task = Task(self.direction, {name} if role is Role.OBJECT else ())
                found = self._generator.request(q, name, task, heuristic, kind=kind)
                effort = reached_efort(self.body, found, task, pulling=self.pulling)
                if name not in answers or (effort is not None and effort > efforts.get(name, -np.inf)):
                    answers[name] = found
                    efforts |= {} if effort is None else {name: effort}
                if (effort or 0.0) > SOME_EFORT:
                    break
            reached = answers[name].q
            q = q if reached is None else np.array(reached)
        return LiveAnswer(q, answers, efforts, time.perf_counter() - started)

    def _roles(self, name: str) -> tuple[Role, ...]:
        if self.role is not Role.AUTO:
            return (self.role,)
        feet = {limb.name for limb in self.body.limbs if limb.kind is ContactKind.SOLE}
        return (Role.BODY,) if name in feet else (Role.BODY, Role.OBJECT)
