"""Everything about the balance of one stance and one CoM state, in one report."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.criteria import (
    admissible_com_polygon,
    centroidal_moment_pivot,
    foot_rotation_indicator,
    support_height,
    support_polygon,
    zero_moment_point,
)
from manikin.balance.limiting import LimitingConstraint
from manikin.balance.margin import force_space, moment_space, stability_margins
from manikin.balance.polygon import signed_distance
from manikin.balance.wrench import WrenchPolytope, pseudo_wrench, wrench_polytope
from manikin.contact import ContactKind, FrictionModel, Stance
from manikin.display import Displayed
from manikin.errors import InputError
from manikin.polytope import Polytope
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False)
class GroundPoint:
    """A point of a classical criterion.

    Attributes:
        position: (2,) in the world [m].
        distance: To the support polygon's boundary, negative outside [m].
    """

    position: FloatArray
    distance: float


@dataclass(frozen=True, eq=False, repr=False)
class BalanceReport(Displayed):
    """Balance of one stance and CoM state.

    Attributes:
        W: The wrench polytope.
        wrench: (6,) pseudo-wrench about ``W.reference`` [N, N.m].
        balanced: Whether the wrench is in W_p (to a rounding of 1e-9 of its size).
        margin: Ms3 about the CoM, alpha = 1 m: the same wherever the scene stands [N.m].
        margin_about_reference: Ms3 about ``W.reference``, as the tables of [Qiu2012]_ have it [N.m].
        force_margin: Ms1, the smallest force at the CoM that ends balance [N].
        moment_margin: Ms2 [N.m].
        limiting: The facet of W_p that gives the margin, in words.
        force_space: F_p at the CoM.
        moment_space: T_p at the pseudo-force.
        support_polygon: (k, 2) [m].
        com_polygon: (k, 2) where the CoM may rest on these contacts [m].
        plane_height: Height of the plane of ZMP, FRI and CMP [m].
        com_projection: CoM on the ground.
        zmp: Zero moment point; the CoP when all contacts lie in the plane.
        fri: Foot rotation indicator; None unless one sole is the only support.
        cmp: Centroidal moment pivot, also the ZRAM point.
    """

    W: WrenchPolytope
    wrench: FloatArray
    balanced: bool
    margin: float
    margin_about_reference: float
    force_margin: float
    moment_margin: float
    limiting: LimitingConstraint
    force_space: Polytope
    moment_space: Polytope
    support_polygon: FloatArray
    com_polygon: FloatArray
    plane_height: float
    com_projection: GroundPoint
    zmp: GroundPoint
    fri: GroundPoint | None
    cmp: GroundPoint

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {
            "balanced": str(self.balanced), "margin": f"{self.margin:.1f} N.m",
            "force_margin": f"{self.force_margin:.0f} N", "limiting": self.limiting.description,
        }  # fmt: skip

    def as_dict(self, *, polytope: bool = False) -> dict[str, Any]:
        """JSON-ready numbers (SI); ``polytope`` adds H and h. Infinite or undefined becomes None."""
        report: dict[str, Any] = {
            "balanced": self.balanced,
            "margin_Nm": _number(self.margin),
            "margin_about_com_Nm": _number(self.margin),
            "margin_about_reference_Nm": _number(self.margin_about_reference),
            "force_margin_N": _number(self.force_margin),
            "moment_margin_Nm": _number(self.moment_margin),
            "limiting": {
                "effector": self.limiting.effector,
                "kind": self.limiting.kind.value,
                "description": self.limiting.description,
                "direction": self.limiting.direction.tolist(),
                "all": [str(share) for share in self.limiting.shares],
            },
            "wrench": self.wrench.tolist(),
            "reference_m": self.W.reference.tolist(),
            "facets": {
                "wrench_polytope": len(self.W),
                "force_space": len(self.force_space),
                "moment_space": len(self.moment_space),
            },
            "support_polygon_m": self.support_polygon.tolist(),
            "static_com_polygon_m": self.com_polygon.tolist(),
            "plane_height_m": self.plane_height,
            "com_projection": _ground(self.com_projection),
            "zmp": _ground(self.zmp),
            "fri": None if self.fri is None else _ground(self.fri),
            "cmp": _ground(self.cmp),
        }
        if polytope:
            report["H"], report["h"] = self.W.H.tolist(), self.W.h.tolist()
        return report


def evaluate_balance(
    stance: Stance,
    mass: float,
    com: ArrayLike,
    acceleration: ArrayLike = (0.0, 0.0, 0.0),
    angular_momentum_rate: ArrayLike = (0.0, 0.0, 0.0),
    *,
    friction_model: FrictionModel | None = None,
    reference: ArrayLike = (0.0, 0.0, 0.0),
    plane_height: float | None = None,
) -> BalanceReport:
    """Judge one stance and CoM state by W_p and by every classical criterion.

    Args:
        stance: Contacts and caps.
        mass: [kg], > 0.
        com: (3,) [m].
        acceleration: (3,) of the CoM [m/s^2].
        angular_momentum_rate: (3,) about the CoM [N.m].
        friction_model: Replaces that of the stance.
        reference: (3,) point of the moments [m].
        plane_height: Of ZMP, FRI and CMP [m]; the mean height of the supports when omitted.

    Raises:
        InputError: If a number is not usable, or (ContactError) nothing caps a contact's force.
    """
    x = frozen_array(com, "com [m]", (3,))
    a = frozen_array(acceleration, "acceleration [m/s^2]", (3,))
    rate = frozen_array(angular_momentum_rate, "angular_momentum_rate [N.m]", (3,))
    W = wrench_polytope(stance, friction_model=friction_model, reference=reference)
    wrench = pseudo_wrench(mass, x, a, rate, W.reference)
    margins = stability_margins(W, wrench, x)
    polygon = support_polygon(stance)
    height = support_height(stance) if plane_height is None else plane_height
    zmp = zero_moment_point(wrench, height, W.reference)
    return BalanceReport(
        W=W,
        wrench=wrench,
        balanced=bool(margins.wrench >= -1e-9 * max(1.0, float(np.abs(W.h).max()))),
        margin=float(margins.wrench_about_com),
        margin_about_reference=float(margins.wrench),
        force_margin=float(margins.force),
        moment_margin=float(margins.moment),
        limiting=W.limiting(wrench, x),
        force_space=force_space(W, x),
        moment_space=moment_space(W, wrench[:3]),
        support_polygon=polygon,
        com_polygon=_static_polygon(W, mass),
        plane_height=height,
        com_projection=_point(x[:2], polygon),
        zmp=_point(zmp, polygon),
        fri=_point(foot_rotation_indicator(wrench, height, None, W.reference), polygon)
        if _single(stance)
        else None,
        cmp=_point(centroidal_moment_pivot(wrench[:3], x, height), polygon),
    )


def _single(stance: Stance) -> bool:
    return len(stance) == 1 and stance.contacts[0].kind is ContactKind.SOLE


def _static_polygon(W: WrenchPolytope, mass: float) -> FloatArray:
    try:
        return admissible_com_polygon(W, mass)
    except InputError:
        return np.zeros((0, 2))


def _point(position: FloatArray, polygon: FloatArray) -> GroundPoint:
    return GroundPoint(position, float(signed_distance(position, polygon)))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _ground(point: GroundPoint) -> dict[str, Any]:
    return {
        "position_m": [_number(float(value)) for value in point.position],
        "distance_m": _number(point.distance),
    }
