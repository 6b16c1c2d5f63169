"""What makes one contact better than another: interchangeable scores of candidates."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.balance import pseudo_wrench, stability_margins, wrench_polytope
from manikin.body import BodyModel
from manikin.body.natural_range import NaturalRange
from manikin.contact import Contact, ContactKind, Stance
from manikin.errors import InputError
from manikin.kinematics import LimbKinematics, ReachVolume
from manikin.kinematics.efort import efort
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray, onto_normal
from manikin.planning.contacts.candidates import Candidates, Situation
from manikin.planning.contacts.contact_plan import ContactRules, make_contact


def cached_score(
    candidates: Candidates, spacing: float, value: Callable[[int], float],
    asked: NDArray[np.bool_] | None = None,
) -> FloatArray:  # fmt: skip
    """(n,) scores that hardly change within a small place: one for each surface and cell of a grid.

    Args:
        candidates: n of them.
        spacing: Size of the cells [m].
        value: Score of a candidate by its row, asked of the first one in each cell.
        asked: (n,) candidates whose score matters, all when omitted; 0 in cells that have none.
    """
    keys = np.column_stack([candidates.surfaces, np.round(candidates.points / spacing)])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    wanted = np.isin(np.arange(len(first)), group if asked is None else group[asked])
    return np.array([value(int(row)) if w else 0.0 for row, w in zip(first, wanted, strict=True)])[group]


def contact_at(
    situation: Situation, candidates: Candidates, row: int, kind: ContactKind, rules: ContactRules
) -> Contact:
    """The contact that one candidate makes, turned onto its surface the shortest way."""
    turn = onto_normal(situation.rotation @ candidates.rotations[row], candidates.normals[row])
    return make_contact(situation.state.body, situation.limb, kind, candidates.points[row], turn, rules)


class Heuristic(Protocol):
    """A score of candidate contacts; the largest is tried first."""

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """(n,) scores of the candidates, without NaN; larger is better."""
        ...


@dataclass(frozen=True)
class Efort:
    """Extended force transmission ratio ([Tonneau2015]_ 5.12, pulling 5.13) in the limb's own direction."""

    pulling: bool = False

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        direction = situation.reaction @ situation.rotation
        alpha = efort(candidates.products, direction, candidates.normals @ situation.rotation)
        return -alpha if self.pulling else alpha


@dataclass(frozen=True, eq=False)
class StrongEfort:
    """EFORT of joints of different strength; ours, the thesis lists it as open (5.4.2).

    The torques of unit norm that EFORT takes are each a share of the joint's torque limit in its weaker
    direction (an ellipsoid is symmetric), so that the force ellipsoid is ``f^T (J T^-2 J^T) f <= 1`` with
    ``T = diag(tau_max)``, and the ratio a force [N].

    Attributes:
        products: (n, 3, 3) ``J T^-2 J^T`` of the samples of each limb, by its name [N^-2].
        pulling: Whether the limb holds on and pulls at the surface (5.13).
    """

    products: Mapping[str, FloatArray]
    pulling: bool = False

    @staticmethod
    def of(body: BodyModel, samples: Mapping[str, LimbSamples], *, pulling: bool = False) -> "StrongEfort":
        """Prepare the samples of some limbs."""
        products = {}
        for name, item in samples.items():
            chain = LimbKinematics(body, item.limb)
            scaled = chain.place(item.angles).jacobians / np.minimum(-chain.torque_lower, chain.torque_upper)
            products[name] = scaled @ scaled.transpose(0, 2, 1)
        return StrongEfort(products, pulling)

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        products = self.products[situation.limb.name][candidates.samples]
        return Efort(self.pulling).score(situation, replace(candidates, products=products))


@dataclass(frozen=True)
class ClosestDistance:
    """Preference for little movement: minus the distance of the contact to the effector [m] (8.1.3)."""

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        _, place = situation.state.effector_placement(situation.limb.effector)
        return -np.linalg.norm(candidates.points - place, axis=1)


@dataclass(frozen=True)
class Manipulability:
    """Preference for freedom to move on: ``sqrt(det(J J^T))`` (5.6), whatever the task."""

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:  # noqa: ARG002
        """See :class:`Heuristic`."""
        return candidates.manipulability


@dataclass(frozen=True, eq=False)
class Comfort:
    """Preference for samples' angles far from the ends of a :class:`NaturalRange` ([Tonneau2015]_ 4.3.3)."""

    samples: Mapping[str, LimbSamples]

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        limb = situation.limb
        angles = self.samples[limb.name].angles[candidates.samples]
        return NaturalRange(situation.state.body, limb).normalised(angles)


@dataclass(frozen=True)
class Random:
    """No preference; the same for a seed and the same candidates."""

    seed: int = 0

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:  # noqa: ARG002
        """See :class:`Heuristic`."""
        return np.random.default_rng(self.seed).random(len(candidates))


HEURISTICS = ("efort", "distance", "manipulability", "random")
"""Names of the heuristics that need nothing but the request."""


def heuristic_named(name: str, seed: int = 0, *, pulling: bool = False) -> Heuristic:
    """Heuristic of a name in :data:`HEURISTICS`; a seed for the random one, EFORT of what pulls if asked for.

    Raises:
        InputError: If there is none of that name.
    """
    known: dict[str, Heuristic] = {
        "efort": Efort(pulling), "distance": ClosestDistance(), "manipulability": Manipulability(),
        "random": Random(seed),
    }  # fmt: skip
    if name not in known:
        raise InputError(f"heuristic is {name!r}; valid: {', '.join(HEURISTICS)}")
    return known[name]


@dataclass(frozen=True, eq=False)
class Duration:
    """Share of the way ahead on which a contact can be kept ([Tonneau2015]_ 7.1-7.4).

    The range of motion is the largest sphere inside the reach (7.1.1).

    Attributes:
        ahead: (rotation (3, 3) segment-to-world, position (3,) [m]) of the segment that carries the
            limb at the next configurations ``q_2 ... q_w``.
    """

    reach: ReachVolume
    ahead: Sequence[tuple[FloatArray, FloatArray]]

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:  # noqa: ARG002
        """See :class:`Heuristic`."""
        centre, radius = self.reach.inscribed_sphere
        centres = [place + rotation @ centre for rotation, place in self.ahead]
        inside = [np.linalg.norm(candidates.points - each, axis=1) <= radius for each in centres]
        return duration(np.array(inside).reshape(len(self.ahead), len(candidates)).T)


def duration(within: ArrayLike) -> FloatArray:
    """Share of the next configurations up to the first that cannot reach ([Tonneau2015]_ 7.4).

    The product of 7.3 stops at the first configuration out of reach, so later ones do not count.
    ``within`` (..., w - 1) says whether the contact is within reach at ``q_2 ... q_w``; the share (...) is in
    [0, 1], and 1 when nothing lies ahead.
    """
    reached = np.asarray(within, dtype=bool)
    if reached.shape[-1] == 0:
        return np.ones(reached.shape[:-1])
    return np.logical_and.accumulate(reached, axis=-1).mean(axis=-1)


@dataclass(frozen=True, eq=False)
class BalanceScore:
    """Balance with the contact added to those that are held ([Tonneau2015]_ 7.5-7.6).

    Ours is the true margin of the wrench polytope (:mod:`manikin.balance`), moments about the CoM, the
    centre of mass being where the body now has it. It depends on the place of a contact, not on the
    limb, so candidates of one surface within ``spacing`` share one margin. A polytope takes
    milliseconds: this is for planning, not for the real time request.

    Attributes:
        held: The other contacts, with what caps their forces.
        acceleration: (3,) acceleration of the CoM [m/s^2].
        binary: 1 where balanced and else 0, as printed (7.6), instead of the margin [N.m].
        spacing: Largest distance of candidates that share a margin [m].
        kind: How the new contact touches; the limb's own way when None.
    """

    held: Stance
    acceleration: ArrayLike = (0.0, 0.0, 0.0)
    binary: bool = False
    spacing: float = 0.1
    kind: ContactKind | None = None
    rules: ContactRules = field(default_factory=ContactRules)

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        values = cached_score(candidates, self.spacing, lambda row: self._margin(situation, candidates, row))
        return (values >= 0.0).astype(np.float64) if self.binary else values

    def _margin(self, situation: Situation, candidates: Candidates, row: int) -> float:
        body, limb = situation.state.body, situation.limb
        contact = contact_at(situation, candidates, row, self.kind or limb.kind, self.rules)
        others = [item for item in self.held if item.effector != limb.effector]
        W = wrench_polytope(self.held.with_contacts([*others, contact]))
        com = situation.state.com
        wrench = pseudo_wrench(body.mass, com, self.acceleration, np.zeros(3), W.reference)
        return float(stability_margins(W, wrench, com).wrench_about_com)


@dataclass(frozen=True, eq=False)
class WeightedSum:
    """Sum of scores of (weight, heuristic) terms ([Tonneau2015]_ 7.7); the weights carry the units."""

    terms: Sequence[tuple[float, Heuristic]]

    def score(self, situation: Situation, candidates: Candidates) -> FloatArray:
        """See :class:`Heuristic`."""
        total: NDArray[np.float64] = np.zeros(len(candidates))
        for weight, heuristic in self.terms:
            total = total + weight * heuristic.score(situation, candidates)
        return total
