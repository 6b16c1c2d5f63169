"""Where the feet can stand against a load on the hands: a heuristic of the contact generator."""

from dataclasses import dataclass, field

import numpy as np

from manikin.balance import pseudo_wrench, stability_margins, support_plane, wrench_polytopes
from manikin.contact import Contact, ContactModel, FrictionModel, Stance
from manikin.numerics.spatial import GRAVITY, FloatArray, wrench_about
from manikin.planning.contacts import Candidates, ContactRules, Situation
from manikin.planning.contacts.heuristics import cached_score, contact_at

LEVEL = 0.7
"""Upward part of the normal from which on a surface is ground and no wall; our choice."""


@dataclass(frozen=True, eq=False)
class Loads:
    """Wrenches on the hands that feet have to stand against.

    Attributes:
        mass: Mass of the body [kg].
        wrenches: (k, 6) force and moment about the world origin on the hands [N, N.m], of each load.
        friction_model: Friction model of the feet.
    """

    mass: float
    wrenches: FloatArray
    friction_model: FrictionModel = "outer"

    def margins(self, feet: list[Contact], places: FloatArray) -> FloatArray:
        """(n,) least margin about the CoM of all loads at each place (n, 3) of it [N.m]; -inf without ZMP."""
        margins = np.full(len(places), -np.inf)
        if any(self._slides(feet, load) for load in self.wrenches):
            return margins
        stance = Stance(feet, model=ContactModel.of_body(self.mass, self.friction_model))
        needed = pseudo_wrench(self.mass, places, np.zeros(3)) - self.wrenches[:, None]
        plane, possible = support_plane(stance), np.ones(len(places), dtype=bool)
        if plane is not None:
            possible = (plane.zmp_distance(needed) >= 0.0).all(axis=0)
        if not possible.any():
            return margins
        (polytope,) = wrench_polytopes([stance])
        wrenches = (wrench_about(wrench[possible], polytope.reference) for wrench in needed)
        found = [stability_margins(polytope, wrench, places[possible]) for wrench in wrenches]
        margins[possible] = np.min([item.wrench_about_com for item in found], axis=0)
        return margins

    def _slides(self, feet: list[Contact], load: FloatArray) -> bool:
        """Whether feet on parallel surfaces slide under a load, wherever the centre of mass is."""
        normal = feet[0].normal
        if any(float(foot.normal @ normal) < 1.0 - 1e-9 for foot in feet):
            return False
        force = np.array([0.0, 0.0, self.mass * GRAVITY]) - load[:3]
        pressing = float(force @ normal)
        sideways = float(np.linalg.norm(force - pressing * normal))
        return sideways > max(foot.friction for foot in feet) * pressing

    def best_place(
        self, feet: list[Contact], near: FloatArray, reach: FloatArray
    ) -> tuple[FloatArray, float]:
        """(2,) place of the centre of mass on feet with the largest least margin, and that margin [N.m].

        The places are around a point (3,) at the height of the CoM, as far as (2,) along x and y [m].
        """
        x, y = (np.linspace(-r, r, 2 * int(np.ceil(r / 0.02)) + 1) for r in reach)
        grid = np.stack(np.meshgrid(near[0] + x, near[1] + y, indexing="ij"), axis=-1).reshape(-1, 2)
        margins = self.margins(feet, np.column_stack([grid, np.full(len(grid), near[2])]))
        best = int(np.argmax(margins))
        return grid[best], float(margins[best])


@dataclass(frozen=True)
class Natural:
    """A foot that points ahead, up on a wall, on its own side: 1 or 0; our choice.

    Attributes:
        yaw: Heading of the body [rad].
        turn: Largest angle between a foot and that heading [rad].
        aside: Least distance from the middle of the body to its own side [m].
        wall: Whether it is on a wall, or on the ground.
        highest: Largest height of its middle [m].
    """

    yaw: float
    turn: float = float(np.deg2rad(25.0))
    aside: float = 0.07
    wall: bool = False
    highest: float = np.inf

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`manikin.planning.contacts.Heuristic`."""
        ahead = np.array([np.cos(self.yaw), np.sin(self.yaw), 0.0])
        across = np.array([-ahead[1], ahead[0], 0.0])
        side = 1.0 if situation.limb.name.startswith("left") else -1.0
        toes, normals = (situation.rotation @ candidates.rotations)[:, :, 0], candidates.normals
        flat = toes - np.sum(toes * normals, axis=1)[:, None] * normals
        # What is ahead on the level, turned with it by the shortest way.
        steep = (normals @ ahead) / np.maximum(1.0 + normals[:, 2], 1e-9)
        ahead = ahead - steep[:, None] * (normals + np.array([0.0, 0.0, 1.0]))
        straight = np.sum(flat * ahead, axis=1) >= np.cos(self.turn) * np.linalg.norm(flat, axis=1)
        beside = side * ((candidates.points - situation.state.q[:3]) @ across) >= self.aside
        there = ((normals[:, 2] < LEVEL) == self.wall) & (candidates.points[:, 2] <= self.highest)
        return (straight & beside & there).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Mirrored:
    """A hand near where the other one is on the other side, on a face like its own: 1 or 0; our choice.

    Attributes:
        other: Contact of the other hand.
        middle: (3,) a point of the body's plane of symmetry [m].
        across: (3,) unit normal of that plane.
        within: Largest distance from the mirrored place [m].
        alike: Least cosine of the angle between the normal and the mirrored one.
    """

    other: Contact
    middle: FloatArray
    across: FloatArray
    within: float = 0.10
    alike: float = 0.7

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:  # noqa: ARG002
        """See :class:`manikin.planning.contacts.Heuristic`."""
        mirror = np.eye(3) - 2.0 * np.outer(self.across, self.across)
        image = self.middle + mirror @ (self.other.position - self.middle)
        near = np.linalg.norm(candidates.points - image, axis=1) <= self.within
        return (near & (candidates.normals @ (mirror @ self.other.normal) >= self.alike)).astype(np.float64)


@dataclass(frozen=True, eq=False)
class BraceFooting:
    """Balance of two natural feet under every load ([Tonneau2015]_ 7.5-7.6, forces on the hands): 1 or 0.

    Attributes:
        loads: What the feet stand against.
        other: Contact of the other foot.
        natural: Places that this foot may have; others count as 0.
        margin: Least margin that counts as balance [N.m].
        reach: (2,) how far the centre of mass may be moved from where the body has it [m].
        spacing: Largest distance of candidates on one surface that share an answer [m].
    """

    loads: Loads
    other: Contact
    natural: Natural
    margin: float
    reach: tuple[float, float] = (0.12, 0.08)
    spacing: float = 0.1
    rules: ContactRules = field(default_factory=ContactRules)

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`manikin.planning.contacts.Heuristic`."""

        def stands(row: int) -> bool:
            contact = contact_at(situation, candidates, row, situation.limb.kind, self.rules)
            feet, near = [self.other, contact], situation.state.com
            return self.loads.best_place(feet, near, np.array(self.reach))[1] >= self.margin

        asked = self.natural.score(situation, candidates) > 0.0
        return cached_score(candidates, self.spacing, stands, asked) * asked
