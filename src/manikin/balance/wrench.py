"""The admissible pseudo-wrench space W_p of a stance and the pseudo-wrench itself.

W_p is the sum over the contacts of the wrenches each can apply, under their own caps and the stance's cap on
the sum of normal forces. It is found from generators: every edge of a friction pyramid (every vertex, for a
sole with a torsion limit) is a ray of one cone whose slice at the caps is W_p, and every axis of a grasp box
is a segment added to it.

A stance with few contacts has a flat W_p (a point contact can give no moment about itself). Such a W_p
carries each equality as a pair of opposite rows at the end of H: the margin of a wrench is then 0 at best,
and at most the negative distance to the flat off it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.balance.friction import (
    ContactLimits,
    LimitKind,
    contact_limits,
    contact_to_world,
    edge_wrenches,
    pyramid_edges,
    pyramid_friction,
)
from manikin.contact import Contact, ContactKind, FrictionModel, Stance
from manikin.errors import ContactError
from manikin.numerics.facet_enumeration import fan_of_generators
from manikin.numerics.polytope import Polytope, vertices_around
from manikin.numerics.spatial import (
    GRAVITY_VECTOR,
    FloatArray,
    cross,
    finite_number,
    frozen_array,
    rows_about,
    wrench_about,
)
from manikin.runtime.display import Displayed

NEGLIGIBLE = 1e-6
"""Shares of a facet smaller than this are rounding."""


@dataclass(frozen=True, eq=False)
class LimitShare:
    """One limit that a facet stands for.

    Attributes:
        effector: Whose limit; ``"stance"`` for the cap on the sum of normal forces.
        kind: What gives way.
        phrase: How the contact moves.
        share: Growth of the margin per unit of relaxation of this limit (alpha = 1 m).
    """

    effector: str
    kind: LimitKind
    phrase: str
    share: float

    def __str__(self) -> str:
        return f"{self.effector}: {self.phrase}"


@dataclass(frozen=True, eq=False)
class LimitingConstraint:
    """The facet of W_p nearest to a wrench, in words.

    Attributes:
        row: Index of the facet in ``W.H``.
        effector: Whose limit weighs most.
        kind: What gives way at the facet.
        description: ``"left_foot: tipping over its outer edge"``.
        direction: (6,) the facet's unit normal: the wrench that would be needed and cannot be had;
            the body escapes along the twist ``-direction``.
        margin: Distance of the wrench to the facet [N.m].
        shares: Every limit met on the facet, the weightiest first.
    """

    row: int
    effector: str
    kind: LimitKind
    description: str
    direction: FloatArray
    margin: float
    shares: tuple[LimitShare, ...]


def facet_shares(W: WrenchPolytope, row: int) -> tuple[LimitShare, ...]:
    """Every limit met on one facet, the weightiest first, lifting contacts last."""
    if not len(W.stance):
        return (LimitShare("stance", LimitKind.UNSUPPORTED, "no contact", 1.0),)
    cap = float(W.stance_cap_multipliers[row])
    shares: list[LimitShare] = []
    for contact in W.stance:
        shares.extend(_contact_shares(contact, W, W.H[row], cap))
    if cap > NEGLIGIBLE:
        text = f"normal force cap of {W.stance.normal_force_cap:g} N"
        shares.append(LimitShare("stance", LimitKind.NORMAL_FORCE_CAP, text, cap))
    if not shares:
        return (LimitShare("stance", LimitKind.UNSUPPORTED, "no contact resists this motion", 1.0),)
    return tuple(sorted(_merged(shares), key=lambda s: (s.kind is LimitKind.LIFTING, -round(s.share, 6))))


def _merged(shares: list[LimitShare]) -> list[LimitShare]:
    """One share per phrase, several rows of one limit added up."""
    total: dict[str, LimitShare] = {}
    for share in shares:
        before = total[str(share)].share if str(share) in total else 0.0
        total[str(share)] = replace(share, share=before + share.share)
    return list(total.values())


def _contact_shares(contact: Contact, W: WrenchPolytope, normal: FloatArray, cap: float) -> list[LimitShare]:
    model = W.stance.friction_model
    limits = contact_limits(contact, model)
    if contact.kind is ContactKind.GRASP:
        weights = np.maximum(limits.A @ rows_about(normal[None], contact.position - W.reference)[0], 0.0)
        if contact.max_moment == 0:
            weights[[kind is LimitKind.GRASP_MOMENT for kind in limits.kinds]] = 0.0
    else:
        rotation = contact.rotation_contact_to_world
        contact = _centred(contact)
        in_world = rows_about(normal[None], contact.position - W.reference)[0]
        twist = np.concatenate([rotation.T @ in_world[:3], rotation.T @ in_world[3:]])
        twist[2] -= cap
        components = 3 if contact.kind is ContactKind.POINT else 6
        size = float(np.linalg.norm(twist[:components]))
        if size < NEGLIGIBLE:
            return []
        edges = edge_wrenches(contact, model)
        if contact.torsion_limit is None and (edges @ twist).max() < -NEGLIGIBLE:
            return [LimitShare(contact.effector, LimitKind.LIFTING, "lifting off", size)]
        weights = _multipliers(limits, twist, components)
    return [
        LimitShare(contact.effector, limits.kinds[i], limits.phrases[i], float(weights[i]))
        for i in np.flatnonzero(weights > NEGLIGIBLE)
    ]


def _centred(contact: Contact) -> Contact:
    """The same contact with its frame in the middle of its points, where its limits are symmetric."""
    if not contact.centre.any():
        return contact
    middle = contact.position + contact.rotation_contact_to_world @ contact.centre
    return replace(contact, position=middle, points=contact.points - contact.centre)


def _multipliers(limits: ContactLimits, twist: FloatArray, components: int) -> FloatArray:
    """Fewest-weight multipliers >= 0 with ``A.T @ multipliers == twist``."""
    A = limits.A[:, :components]
    answer = linprog(np.ones(len(A)), A_eq=A.T, b_eq=twist[:components], method="highs")
    if answer.x is None:
        return np.maximum(A @ twist[:components], 0.0)
    return answer.x


@dataclass(frozen=True, eq=False, repr=False)
class WrenchPolytope(Displayed, Polytope):
    """W_p: the wrenches that the scene can apply to the body ([Qiu2012]_ 4.36).

    Attributes:
        H: (m, 6) unit rows over [force; moment], world axes, alpha = 1 m.
        h: (m,) offsets [N, N.m].
        stance: The contacts, with their friction model and caps.
        reference: (3,) point of the moments [m].
        stance_cap_multipliers: (m,) growth of each offset per newton of the stance's ``normal_force_cap``.
    """

    stance: Stance
    reference: FloatArray
    stance_cap_multipliers: FloatArray

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        place = str(np.round(self.reference, 3).tolist())
        return {"effectors": " ".join(self.stance.effectors), "facets": str(len(self.h)), "reference": place}

    def __init__(
        self, H: ArrayLike, h: ArrayLike, stance: Stance, reference: ArrayLike, cap_multipliers: ArrayLike
    ) -> None:
        length = np.linalg.norm(np.asarray(H, dtype=np.float64), axis=1)
        super().__init__(H, h)
        object.__setattr__(self, "stance", stance)
        object.__setattr__(self, "reference", frozen_array(reference, "reference [m]", (3,), ContactError))
        multipliers = frozen_array(np.asarray(cap_multipliers) / length, "cap_multipliers", (len(self.h),))
        object.__setattr__(self, "stance_cap_multipliers", multipliers)

    def at_reference(self, reference: ArrayLike) -> WrenchPolytope:
        """The same set with moments about another point, with rows of unit length.

        The margin changes with the reference ([Qiu2012]_ 4.2.9, remark 2).
        """
        point = frozen_array(reference, "reference [m]", (3,), ContactError)
        H = rows_about(self.H, point - self.reference)
        return WrenchPolytope(H, self.h, self.stance, point, self.stance_cap_multipliers)

    def limiting(self, wrench: ArrayLike, about: ArrayLike | None = None) -> LimitingConstraint:
        """Explain the facet of W_p that gives the margin of a wrench.

        By linear-programming duality the facet is a combination, with multipliers >= 0, of the limits that
        are met on it; the multiplier of a limit is how much the margin grows when that limit is relaxed, and
        the largest one names the constraint. Contacts that carry no force on the facet are lifting off: they
        are named only when no other is.

        Args:
            wrench: (6,) pseudo-wrench about :attr:`reference`, finite (ContactError).
            about: (3,) point of the margin's moments, in general the CoM [m]; :attr:`reference` when omitted.
        """
        w = frozen_array(wrench, "wrench", (6,), ContactError)
        if about is not None:
            point = frozen_array(about, "point of the moments [m]", (3,), ContactError)
            return self.at_reference(point).limiting(wrench_about(w, point - self.reference))
        distances = self.distances(w)
        row = int(np.argmin(distances))
        shares = facet_shares(self, row)
        first = shares[0]
        margin = float(self.margin(w) if len(self.off_flat(w[None])[0]) else distances[row])
        return LimitingConstraint(row, first.effector, first.kind, str(first), self.H[row], margin, shares)


def pseudo_wrench(
    mass: float, com: ArrayLike, acceleration: ArrayLike, angular_momentum_rate: ArrayLike | None = None,
    reference: ArrayLike | None = None,
) -> FloatArray:  # fmt: skip
    """(..., 6) wrench that the scene must apply [N, N.m]: ``[m (a - g); (x - o) ^ m (a - g) + Ldot]``.

    [Qiu2012]_ 4.6 for the point mass, 4.51 with the rate of change of angular momentum.

    Args:
        mass: [kg], > 0 (InputError).
        com: (..., 3) [m].
        acceleration: (..., 3) of the CoM [m/s^2].
        angular_momentum_rate: (..., 3) about the CoM [N.m]; zero when omitted.
        reference: (..., 3) point ``o`` of the moments [m]; the world origin when omitted.
    """
    mass = finite_number(mass, "mass [kg]", above=0.0)
    force = mass * (np.asarray(acceleration, dtype=np.float64) - GRAVITY_VECTOR)
    arm = np.asarray(com, dtype=np.float64)
    if reference is not None:
        arm = arm - np.asarray(reference, dtype=np.float64)
    moment = cross(arm, force)
    if angular_momentum_rate is not None:
        moment = moment + np.asarray(angular_momentum_rate, dtype=np.float64)
    return np.concatenate(np.broadcast_arrays(force, moment), axis=-1)


def wrench_polytope(stance: Stance, *, reference: ArrayLike = (0.0, 0.0, 0.0)) -> WrenchPolytope:
    """Facets of W_p, each once ([Qiu2012]_ 4.36; ours are found from generators).

    Without any contact (flight) it is the single point 0; ``reference`` (3,) is the point of the moments [m].
    ContactError if the normal force of a contact is bounded by no cap.
    """
    origin = frozen_array(reference, "reference [m]", (3,), ContactError)
    local = _middle(stance) if len(stance) else origin
    pairs, total = _caps(stance)
    generators, levels = _generators(pairs, total, stance.friction_model, local)
    segments = [_grasp_segments(c, local) for c in stance if c.kind is ContactKind.GRASP]
    fan = fan_of_generators(generators, levels, np.ones(levels.shape[1], dtype=np.bool_))
    fan = fan.plus_segments(np.vstack([np.zeros((0, 6)), *segments]))
    H, h, multipliers = fan.facet_rows(max(1.0, float(np.abs(generators).max(initial=0.0))))
    of_stance = np.zeros(len(h)) if total is None else multipliers[:, -1] / total
    return WrenchPolytope(rows_about(H, origin - local), h, stance, origin, of_stance)


def wrench_polytopes(
    stances: Sequence[Stance], *, reference: ArrayLike | None = None
) -> tuple[WrenchPolytope, ...]:
    """W_p of several stances; a stance that is an earlier one moved elsewhere is not computed again.

    ``reference`` (3,) is the point of all moments [m]; when omitted, the middle of each stance's contacts.
    ContactError if the normal force of a contact is bounded by no cap.
    """
    known: dict[tuple[Any, ...], WrenchPolytope] = {}
    polytopes = []
    for stance in stances:
        centre = _middle(stance)
        shape = _shape_of(stance, centre)
        if shape not in known:
            known[shape] = wrench_polytope(stance, reference=centre)
        like = known[shape]
        local = WrenchPolytope(like.H, like.h, stance, centre, like.stance_cap_multipliers)
        polytopes.append(local if reference is None else local.at_reference(reference))
    return tuple(polytopes)


def _middle(stance: Stance) -> FloatArray:
    """(3,) mean of the contacts' origins; the world origin without any [m]."""
    return np.mean([contact.position for contact in stance] or [np.zeros(3)], axis=0)


def _shape_of(stance: Stance, centre: FloatArray) -> tuple[Any, ...]:
    """Values that a wrench polytope depends on but for the stance's position, lengths to a nanometre."""
    contacts = []
    for contact in stance:
        place = np.concatenate([contact.points_in_world - centre, contact.normal[None]])
        limits = (contact.friction, contact.normal_force_cap, contact.torsion_limit, contact.max_force)
        numbers = tuple((np.round(place, 9) + 0.0).ravel().tolist())
        contacts.append((str(contact.kind), numbers, *map(str, limits), contact.max_moment))
    return (stance.model, *sorted(contacts))


def _caps(stance: Stance) -> tuple[list[tuple[Contact, float | None]], float | None]:
    """Caps that matter: each frictional contact with its own, and on their sum.

    The first are None where only the sum bounds a contact, the last where the contacts' own caps imply it.
    """
    total = stance.normal_force_cap
    pairs: list[tuple[Contact, float | None]] = []
    for contact in stance:
        own = contact.normal_force_cap
        if contact.kind is ContactKind.GRASP:
            continue
        if own is None and total is None:
            raise ContactError(
                f"nothing bounds the normal force of {contact.effector!r}; "
                "valid: a normal_force_cap [N] for this contact or for the stance"
            )
        pairs.append((contact, own if total is None or own is None or own < total else None))
    known = [cap for _, cap in pairs if cap is not None]
    if not pairs or (total is not None and len(known) == len(pairs) and sum(known) <= total):
        total = None
    return pairs, total


def _generators(
    pairs: list[tuple[Contact, float | None]],
    total: float | None,
    model: FrictionModel,
    reference: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Generators (n, 6) and the share of each level that each one uses (n, k).

    The levels are one per contact with a cap or a torsion limit of its own, then the stance's cap.
    """
    has_level = [own is not None or contact.torsion_limit is not None for contact, own in pairs]
    columns = sum(has_level) + (total is not None)
    generators, levels = [np.zeros((0, 6))], [np.zeros((0, columns))]
    for i, (contact, own) in enumerate(pairs):
        local, bounded = _extreme_wrenches(contact, own, total, model)
        level = np.zeros((len(local), columns))
        if has_level[i]:
            level[:, sum(has_level[:i])] = bounded
        if total is not None:
            level[:, -1] = local[:, 2] / total
        generators.append(contact_to_world(contact, local, reference))
        levels.append(level)
    return np.vstack(generators), np.vstack(levels)


def _extreme_wrenches(
    contact: Contact, own: float | None, total: float | None, friction_model: FrictionModel
) -> tuple[FloatArray, FloatArray]:
    """Wrenches (n, 6) in the contact frame that generate the contact's set, and their weights.

    Combinations of weighted sum at most 1 make the set up to its own cap; weights of 0 mark rays.
    """
    cap = own if own is not None else total
    if contact.torsion_limit is None:
        wrenches = (1.0 if cap is None else cap) * edge_wrenches(contact, friction_model)
        return wrenches, np.ones(len(wrenches))
    if own is not None:
        vertices = _torsion_vertices(contact, own, friction_model)
        return vertices, np.ones(len(vertices))
    friction = pyramid_friction(contact, friction_model)
    # Above this normal force the torsion limit alone bounds the moment: no vertex is left.
    highest = contact.torsion_limit / (friction * min(contact.length, contact.width) / 2)
    vertices = _torsion_vertices(contact, 2.0 * highest, friction_model)
    vertices = vertices[vertices[:, 2] < 1.5 * highest]
    edges = pyramid_edges(contact, friction_model)
    rays = np.hstack([(1.0 if total is None else total) * edges, np.zeros((len(edges), 3))])
    return np.vstack([vertices, rays]), np.append(np.ones(len(vertices)), np.zeros(len(edges)))


def _torsion_vertices(contact: Contact, cap: float, friction_model: FrictionModel) -> FloatArray:
    """Vertices (n, 6), but for 0, of a sole with a torsion limit up to a normal force."""
    limits = contact_limits(replace(contact, normal_force_cap=cap), friction_model)
    unit = np.array([cap] * 3 + [cap * contact.length] * 3)
    inside = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    vertices = vertices_around(limits.A * unit, limits.b, inside)
    return vertices[np.abs(vertices).max(axis=1) > 1e-9] * unit


def _grasp_segments(contact: Contact, reference: FloatArray) -> FloatArray:
    """(3 or 6, 6) half axes of the grasp's box of forces and moments ([Qiu2012]_ 4.22)."""
    force = contact.max_force * np.eye(3)
    forces = np.hstack([force, cross((contact.position - reference)[None], force)])
    moments = np.hstack([np.zeros((3, 3)), contact.max_moment * np.eye(3)])
    return forces if contact.max_moment == 0 else np.vstack([forces, moments])
