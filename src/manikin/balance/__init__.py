"""Balance: admissible wrenches, margins and the classical criteria ([Qiu2012]_ chapter 4)."""

from manikin.balance.criteria import (
    admissible_com_polygon,
    admissible_zmp_polygon,
    center_of_pressure,
    centroidal_moment_pivot,
    foot_rotation_indicator,
    support_height,
    support_polygon,
    zero_moment_point,
)
from manikin.balance.evaluate import BalanceReport, GroundPoint, evaluate_balance
from manikin.balance.limiting import LimitingConstraint, LimitShare
from manikin.balance.limits import ContactLimits, LimitKind, contact_limits
from manikin.balance.margin import StabilityMargins, force_space, moment_space, stability_margins
from manikin.balance.motion_margin import MotionMargin, motion_margin
from manikin.balance.polygon import convex_polygon, polygon_of_halfplanes, signed_distance
from manikin.balance.support_plane import SupportPlane, least_zmp_distance, support_plane
from manikin.balance.wrench import WrenchPolytope, pseudo_wrench, wrench_polytope, wrench_polytopes
from manikin.callable_package import make_callable

__all__ = [
    "BalanceReport",
    "ContactLimits",
    "GroundPoint",
    "LimitKind",
    "LimitShare",
    "LimitingConstraint",
    "MotionMargin",
    "StabilityMargins",
    "SupportPlane",
    "WrenchPolytope",
    "admissible_com_polygon",
    "admissible_zmp_polygon",
    "center_of_pressure",
    "centroidal_moment_pivot",
    "contact_limits",
    "convex_polygon",
    "evaluate_balance",
    "foot_rotation_indicator",
    "force_space",
    "least_zmp_distance",
    "moment_space",
    "motion_margin",
    "polygon_of_halfplanes",
    "pseudo_wrench",
    "signed_distance",
    "stability_margins",
    "support_height",
    "support_plane",
    "support_polygon",
    "wrench_polytope",
    "wrench_polytopes",
    "zero_moment_point",
]

make_callable(__name__)
