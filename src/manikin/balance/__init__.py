"""Balance: admissible wrenches, margins and the classical criteria ([Qiu2012]_ chapter 4)."""

from manikin.balance.criteria import (
    StaticRegion,
    admissible_com_polygon,
    admissible_zmp_polygon,
    centroidal_moment_pivot,
    foot_rotation_indicator,
    static_torque_share,
    support_height,
    support_polygon,
    zero_moment_point,
)
from manikin.balance.friction import LimitKind, contact_limits
from manikin.balance.margin import (
    BalanceReport,
    evaluate_balance,
    force_space,
    moment_space,
    stability_margins,
)
from manikin.balance.motion_margin import MotionMargin, motion_margin
from manikin.balance.wrench import (
    LimitingConstraint,
    WrenchPolytope,
    pseudo_wrench,
    wrench_polytope,
    wrench_polytopes,
)
from manikin.balance.zmp import least_zmp_distance, support_plane
from manikin.runtime.display import make_callable

__all__ = [
    "BalanceReport", "LimitKind", "LimitingConstraint", "MotionMargin", "StaticRegion", "WrenchPolytope",
    "admissible_com_polygon", "admissible_zmp_polygon", "centroidal_moment_pivot", "contact_limits",
    "evaluate_balance", "foot_rotation_indicator", "force_space", "least_zmp_distance", "moment_space",
    "motion_margin", "pseudo_wrench", "stability_margins", "static_torque_share",
    "support_height", "support_plane", "support_polygon", "wrench_polytope", "wrench_polytopes",
    "zero_moment_point",
]  # fmt: skip


make_callable(__name__)
