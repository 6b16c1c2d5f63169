"""Force and moment spaces of W_p, the three stability margins, and a report on one stance and CoM state.

Sources: [Qiu2012]_ 4.2.7, 4.2.9.
"""

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
from manikin.balance.wrench import LimitingConstraint, WrenchPolytope, pseudo_wrench, wrench_polytope
from manikin.contact import ContactKind, Stance
from manikin.errors import InputError
from manikin.numerics.polytope import Polytope, least_change, signed_distance
from manikin.numerics.spatial import FloatArray, cross, frozen_array, skew
from manikin.runtime.display import Displayed

_BLOCK = 200_000
"""Distances looked at together: they stay in the processor's cache."""

_NO_LEVER = 1e-12


@dataclass(frozen=True, eq=False)
class StabilityMargins:
    """The smallest perturbations that end balance; negative when it is lost already.

    Attributes:
        force: (...) Ms1, a force at the CoM alone [N].
        moment: (...) Ms2, a moment alone [N.m].
        wrench: (...) Ms3, both, moments about the reference of W_p, alpha = 1 m [N.m].
        wrench_about_com: (...) Ms3 with moments about the CoM ([Qiu2012]_ 4.2.9, remark 2) [N.m].
    """

    force: FloatArray
    moment: FloatArray
    wrench: FloatArray
    wrench_about_com: FloatArray


def force_space(W: WrenchPolytope, com: ArrayLike) -> Polytope:
    """F_p: forces ``m (a - g)`` (3,) at a CoM (3,) [m], without angular momentum ([Qiu2012]_ 4.38) [N]."""
    arm = frozen_array(com, "com [m]", (3,)) - W.reference
    return W.preimage(np.vstack([np.eye(3), skew(arm)]))


def moment_space(W: WrenchPolytope, force: ArrayLike) -> Polytope:
    """T_p: moments (3,) about the reference [N.m] that W_p admits beside a force ``m (a - g)`` (3,) [N].

    The thesis projects F_p (4.39), which is flat; the right set is the slice ``{tau : H2 tau <= h - H1 f}``.
    """
    f = frozen_array(force, "force [N]", (3,))
    return W.preimage(np.vstack([np.zeros((3, 3)), np.eye(3)]), np.concatenate([f, np.zeros(3)]))


def stability_margins(W: WrenchPolytope, wrench: ArrayLike, com: ArrayLike) -> StabilityMargins:
    """All margins of pseudo-wrenches, each the smallest over the facets of a distance.

    Row ``i`` is reached after ``d_i = h_i - H_i w``; a unit force at the CoM covers
    ``|H1_i + H2_i (x - o)^|`` of it, a unit moment ``|H2_i|``. Off a flat W_p the least perturbation that
    leads back to the flat takes the place of its pairs of rows.

    Args:
        wrench: (..., 6) about ``W.reference``, of a point mass or a whole body.
        com: (..., 3) in the world [m]; InputError if the shapes do not fit.
    """
    w, x = np.asarray(wrench, dtype=np.float64), np.asarray(com, dtype=np.float64)
    if w.shape[-1:] != (6,) or x.shape[-1:] != (3,):
        raise InputError(f"wrench has shape {w.shape} and com {x.shape}; valid: (..., 6) and (..., 3)")
    shape = np.broadcast_shapes(w.shape[:-1], x.shape[:-1])
    w = np.broadcast_to(w, (*shape, 6)).reshape(-1, 6)
    x = np.broadcast_to(x, (*shape, 3)).reshape(-1, 3)
    margins = np.empty((4, len(w)))
    step = max(1, _BLOCK // max(1, len(W)))
    for start in range(0, len(w), step):
        part = slice(start, start + step)
        margins[:, part] = _margins(W, w[part], x[part] - W.reference)
    return StabilityMargins(*(row.reshape(shape) for row in margins))


def force_levers(H: FloatArray, arm: FloatArray) -> FloatArray:
    """(n, m) ``|H1 + H2 arm^|``: change of rows (m, 6) per newton at ``arm`` (n, 3) off the reference [m]."""
    force, (x, y, z) = H[:, :3], H[:, 3:].T
    zero = np.zeros_like(x)
    squares = np.zeros((len(arm), len(H)))
    for axis, turned in enumerate(((zero, -z, y), (z, zero, -x), (-y, x, zero))):
        squares += (force[:, axis] + arm @ np.array(turned)) ** 2
    return np.sqrt(squares)


def wrench_levers(H: FloatArray, arm: FloatArray) -> FloatArray:
    """(n, m) lengths of rows (m, 6) with moments about points ``arm`` (n, 3) from the reference [m]."""
    return np.hypot(force_levers(H, arm), np.linalg.norm(H[:, 3:], axis=1))


def _margins(W: WrenchPolytope, wrench: FloatArray, arm: FloatArray) -> FloatArray:
    """(4, n) margins in the order of :class:`StabilityMargins`."""
    distances = W.distances(wrench)
    margins = _row_margins(distances, W.H, arm)
    off, residual = W.off_flat(wrench)
    if len(off):
        rows = W.equalities[0]
        facets = slice(0, -2 * len(rows))
        at_com = rows[:, :3] + cross(np.broadcast_to(rows[:, 3:], (len(off), len(rows), 3)), arm[off, None])
        moment = np.broadcast_to(rows[:, 3:], at_com.shape)
        perturbed = (at_com, moment, rows, np.concatenate([at_com, moment], axis=-1))
        margins[:, off] = np.minimum(
            _row_margins(distances[off, facets], W.H[facets], arm[off]),
            np.stack([-least_change(matrix, residual) for matrix in perturbed]),
        )
    return margins


def _row_margins(distances: FloatArray, H: FloatArray, arm: FloatArray) -> FloatArray:
    """(4, n) margins by distances (n, m) to rows (m, 6) with the CoM at ``arm`` (n, 3) from the reference."""
    moment_lever = np.linalg.norm(H[:, 3:], axis=1)
    force_lever = force_levers(H, arm)
    return np.stack([
        _smallest(distances, force_lever),
        _smallest(distances, moment_lever),
        distances.min(axis=1, initial=np.inf),
        _smallest(distances, np.hypot(force_lever, moment_lever)),
    ])  # fmt: skip


def _smallest(distances: FloatArray, lever: FloatArray) -> FloatArray:
    """Smallest ``distance / lever``; rows without lever count only when they are broken."""
    still = lever < _NO_LEVER
    if not still.any():
        return (distances / lever).min(axis=1, initial=np.inf)
    ratio = distances / np.where(still, 1.0, lever)
    out_of_reach = np.where(distances < 0, -np.inf, np.inf)
    return np.where(still, out_of_reach, ratio).min(axis=1, initial=np.inf)


@dataclass(frozen=True, eq=False)
class GroundPoint:
    """A point (2,) of a classical criterion and its distance to the support polygon, negative outside [m]."""

    position: FloatArray
    distance: float

    @classmethod
    def of(cls, position: FloatArray, polygon: FloatArray) -> "GroundPoint":
        """Measure a point."""
        return cls(position, float(signed_distance(position, polygon)))

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready numbers."""
        position = [_number(float(value)) for value in self.position]
        return {"position_m": position, "distance_m": _number(self.distance)}


@dataclass(frozen=True, eq=False, repr=False)
class BalanceReport(Displayed):
    """Balance of one stance and CoM state.

    Attributes:
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
        plane_height: Height of the plane of ZMP, FRI and CMP, the mean one of the supports [m].
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
                "effector": self.limiting.effector, "kind": self.limiting.kind.value,
                "description": self.limiting.description, "direction": self.limiting.direction.tolist(),
                "all": [str(share) for share in self.limiting.shares],
            },
            "wrench": self.wrench.tolist(),
            "reference_m": self.W.reference.tolist(),
            "facets": {
                "wrench_polytope": len(self.W), "force_space": len(self.force_space),
                "moment_space": len(self.moment_space),
            },
            "support_polygon_m": self.support_polygon.tolist(),
            "static_com_polygon_m": self.com_polygon.tolist(),
            "plane_height_m": self.plane_height,
            "com_projection": self.com_projection.as_dict(),
            "zmp": self.zmp.as_dict(),
            "fri": None if self.fri is None else self.fri.as_dict(),
            "cmp": self.cmp.as_dict(),
        }  # fmt: skip
        if polytope:
            report["H"], report["h"] = self.W.H.tolist(), self.W.h.tolist()
        return report


def evaluate_balance(
    stance: Stance, mass: float, com: ArrayLike, acceleration: ArrayLike = (0.0, 0.0, 0.0),
    angular_momentum_rate: ArrayLike = (0.0, 0.0, 0.0), *, reference: ArrayLike = (0.0, 0.0, 0.0),
) -> BalanceReport:  # fmt: skip
    """Judge one stance and CoM state by W_p and by every classical criterion.

    Args:
        stance: Contacts and caps.
        mass: [kg], > 0.
        com: (3,) [m].
        acceleration: (3,) of the CoM [m/s^2].
        angular_momentum_rate: (3,) about the CoM [N.m].
        reference: (3,) point of the moments [m].

    Raises:
        InputError: If a number is not usable, or (ContactError) nothing caps a contact's force.
    """
    x = frozen_array(com, "com [m]", (3,))
    a = frozen_array(acceleration, "acceleration [m/s^2]", (3,))
    rate = frozen_array(angular_momentum_rate, "angular_momentum_rate [N.m]", (3,))
    W = wrench_polytope(stance, reference=reference)
    wrench = pseudo_wrench(mass, x, a, rate, W.reference)
    margins = stability_margins(W, wrench, x)
    polygon, height = support_polygon(stance), support_height(stance)
    zmp = zero_moment_point(wrench, height, W.reference)
    fri = foot_rotation_indicator(wrench, height, None, W.reference)
    single = len(stance) == 1 and stance.contacts[0].kind is ContactKind.SOLE
    try:
        com_polygon = admissible_com_polygon(W, mass)
    except InputError:
        com_polygon = np.zeros((0, 2))
    return BalanceReport(
        W, wrench, balanced=bool(margins.wrench >= -1e-9 * max(1.0, float(np.abs(W.h).max()))),
        margin=float(margins.wrench_about_com), margin_about_reference=float(margins.wrench),
        force_margin=float(margins.force), moment_margin=float(margins.moment),
        limiting=W.limiting(wrench, x), force_space=force_space(W, x),
        moment_space=moment_space(W, wrench[:3]), support_polygon=polygon, com_polygon=com_polygon,
        plane_height=height, com_projection=GroundPoint.of(x[:2], polygon), zmp=GroundPoint.of(zmp, polygon),
        fri=GroundPoint.of(fri, polygon) if single else None,
        cmp=GroundPoint.of(centroidal_moment_pivot(wrench[:3], x, height), polygon),
    )  # fmt: skip


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
