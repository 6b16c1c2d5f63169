"""Which contact and which of its limits a facet of W_p stands for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.balance.friction import edge_wrenches
from manikin.balance.limits import ContactLimits, LimitKind, contact_limits
from manikin.contact import Contact, ContactKind
from manikin.errors import ContactError
from manikin.spatial import FloatArray, frozen_array

if TYPE_CHECKING:
    from manikin.balance.wrench import WrenchPolytope

NEGLIGIBLE = 1e-6
"""Shares of a facet smaller than this are rounding."""


@dataclass(frozen=True, eq=False)
class LimitShare:
    """One limit that a facet stands for.

    Attributes:
        effector: Whose limit; ``"stance"`` for the cap on the sum of normal forces.
        kind: What gives way.
        phrase: How.
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
        kind: What gives way there.
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


def limiting_constraint(
    W: WrenchPolytope, wrench: ArrayLike, about: ArrayLike | None = None
) -> LimitingConstraint:
    """Explain the facet of W_p that gives the margin of a wrench.

    The facet's normal is a combination, with multipliers >= 0, of the limits met on it
    (linear-programming duality); the multiplier of a limit is how much the margin grows
    when that limit is relaxed, and the largest one names the constraint. Contacts that
    carry no force on the facet are lifting off: they are named only when no other is.

    Args:
        W: The polytope.
        wrench: (6,) about ``W.reference``.
        about: (3,) point of the margin's moments, in general the CoM [m]; ``W.reference`` when omitted.

    Raises:
        ContactError: If the wrench is not six finite numbers.
    """
    w = frozen_array(wrench, "wrench", (6,), ContactError)
    if about is not None:
        point = frozen_array(about, "point of the moments [m]", (3,), ContactError)
        moment = w[3:] - np.cross(point - W.reference, w[:3])
        return limiting_constraint(W.at_reference(point), np.concatenate([w[:3], moment]))
    distances = W.distances(w)
    row = int(np.argmin(distances))
    shares = facet_shares(W, row)
    first = shares[0]
    return LimitingConstraint(
        row, first.effector, first.kind, str(first), W.H[row], float(distances[row]), shares
    )


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
    total: dict[tuple[str, str], LimitShare] = {}
    for share in shares:
        key = (share.effector, share.phrase)
        before = total[key].share if key in total else 0.0
        total[key] = replace(share, share=before + share.share)
    return list(total.values())


def _contact_shares(contact: Contact, W: WrenchPolytope, normal: FloatArray, cap: float) -> list[LimitShare]:
    limits = contact_limits(contact, W.friction_model)
    if contact.kind is ContactKind.GRASP:
        return _grasp_shares(contact, limits, _twist_at(contact.position - W.reference, normal))
    rotation = contact.rotation_contact_to_world
    contact = _centred(contact)
    in_world = _twist_at(contact.position - W.reference, normal)
    twist = np.concatenate([rotation.T @ in_world[:3], rotation.T @ in_world[3:]])
    twist[2] -= cap
    size = float(np.linalg.norm(twist[:3] if contact.kind is ContactKind.POINT else twist))
    if size < NEGLIGIBLE:
        return []
    if (
        contact.torsion_limit is None
        and (edge_wrenches(contact, W.friction_model) @ twist).max() < -NEGLIGIBLE
    ):
        return [LimitShare(contact.effector, LimitKind.LIFTING, "lifting off", size)]
    weights = _multipliers(limits, twist, 3 if contact.kind is ContactKind.POINT else 6)
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


def _twist_at(arm: FloatArray, normal: FloatArray) -> FloatArray:
    """A facet normal, as a twist, at a point ``arm`` away from the reference (world axes)."""
    return np.concatenate([normal[:3] + np.cross(normal[3:], arm), normal[3:]])


def _grasp_shares(contact: Contact, limits: ContactLimits, twist: FloatArray) -> list[LimitShare]:
    weights = np.maximum(limits.A @ twist, 0.0)
    if contact.max_moment == 0:
        weights[[kind is LimitKind.GRASP_MOMENT for kind in limits.kinds]] = 0.0
    return [
        LimitShare(contact.effector, limits.kinds[i], limits.phrases[i], float(weights[i]))
        for i in np.flatnonzero(weights > NEGLIGIBLE)
    ]


def _multipliers(limits: ContactLimits, twist: FloatArray, components: int) -> FloatArray:
    """Fewest-weight multipliers >= 0 with ``A.T @ multipliers == twist``."""
    A = limits.A[:, :components]
    answer = linprog(np.ones(len(A)), A_eq=A.T, b_eq=twist[:components], method="highs")
    if answer.x is None:
        return np.maximum(A @ twist[:components], 0.0)
    return answer.x
