"""Other weights for a whole-body fit that has missed a requirement by a little.

The fit weighs everything that is wanted of a motion against everything else; what the certificate
finds broken gets more weight, and the fit goes on from where it was.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

from manikin.wholebody.fit_scales import FitScales
from manikin.wholebody.motion_scales import MotionScales

S = TypeVar("S", bound=MotionScales)

STRONGER = 0.5
"""Factor of the scales of what was missed."""

NEARER = 0.75
"""Factor of the wanted clearance where the required one is missed."""

LEAST_SAFE_DISTANCE = 0.014
"""Wanted clearance that this leaves [m]: more than the required one."""

MORE_ROUNDS = 12
"""Further rounds of the multipliers for contacts and centre of mass."""

FIRST_DECREASE = 0.02
"""Relative decrease of the objective below which the first repair stops."""

LATER_DECREASE = 0.005
"""The same where that did not help, or a fit begins anew: the harder, the more patience."""

_SCALES = MappingProxyType(
    {
        "max_support_error_m": ("tolerance",),
        "max_com_error_m": ("tolerance",),
        "max_meeting_error_m": ("position",),
        "min_clearance_m": ("clearance",),
        "max_joint_limit_violation_rad": ("joint_limit",),
        "max_velocity_share": ("joint_velocity",),
        "max_missing_wrench": ("force", "moment_share"),
        "max_torque_share": ("force", "moment_share"),
    }
)
"""Scales that decide each field of the certificate.  Contacts and the centre of mass have multipliers, which
are only updated until the tolerance is kept."""


def reweighed(
    scales: FitScales, broken: frozenset[str], *, narrow: bool = False, decrease: float = LATER_DECREASE
) -> FitScales:
    """Return scales at which the broken requirements weigh more.

    Args:
        scales: Those of the fit before.
        broken: Names of fields of the certificate, see :meth:`WholeBodyResiduals.broken`.
        narrow: Whether to count on less room where clearance is missed.
        decrease: Relative decrease of the objective below which the iteration stops.
    """
    if narrow and "min_clearance_m" in broken:
        scales = replace(scales, **_nearer(scales))
    return replace(stronger(scales, broken, _SCALES), multiplier_rounds=MORE_ROUNDS, decrease=decrease)


def stronger(scales: S, broken: frozenset[str], table: Mapping[str, tuple[str, ...]]) -> S:
    """Return scales at which what was missed weighs more.

    Args:
        scales: Those of the fit before.
        broken: Names of fields of a certificate.
        table: Scales that decide each field.
    """
    names = {scale for field in broken for scale in table.get(field, ())}
    return replace(scales, **{name: STRONGER * getattr(scales, name) for name in sorted(names)})


def _nearer(scales: FitScales) -> dict[str, float]:
    """Count on less room where there is little: what is far enough no longer pushes."""
    return {
        "safe_distance": max(NEARER * scales.safe_distance, LEAST_SAFE_DISTANCE),
        "softness": NEARER * scales.softness,
    }
