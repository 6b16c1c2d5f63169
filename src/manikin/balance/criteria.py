"""The classical criteria beside W_p: CoM projection, ZMP and CoP, FRI, CMP and ZRAM.

Each is a point of a horizontal plane, to be held inside the support polygon; W_p is more
general, as these know neither friction nor walls nor grasps ([Qiu2012]_ 4.1.2, 4.2.8).
"""

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.wrench import WrenchPolytope, pseudo_wrench
from manikin.contact import ContactKind, Stance
from manikin.errors import InputError
from manikin.numerics.polygon import convex_polygon, polygon_of_halfplanes
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number, frozen_array, skew


def support_polygon(stance: Stance) -> FloatArray:
    """(k, 2) hull of all soles' corners and points from above, counter-clockwise, without grasps [m]."""
    points = [c.points_in_world[:, :2] for c in stance if c.kind is not ContactKind.GRASP]
    return convex_polygon(np.vstack([np.zeros((0, 2)), *points]))


def support_height(stance: Stance) -> float:
    """Mean height of the soles and points, the plane on which ZMP and CMP are looked for [m]."""
    heights = [c.position[2] for c in stance if c.kind is not ContactKind.GRASP]
    return float(np.mean(heights)) if heights else 0.0


def zero_moment_point(
    wrench: ArrayLike, plane_height: float = 0.0, reference: ArrayLike | None = None
) -> FloatArray:
    """(..., 2) point of a level plane about which the contacts' moment is vertical [m]; NaN without load.

    General form of [Qiu2012]_ 4.43-4.44, any CoM height and rate of angular momentum, from the pseudo-wrench:
    ``x = o + (r_z f_x - tau_y) / f_z`` with ``r_z = plane_height - o_z``. With all contacts in that plane it
    is the CoP.

    Args:
        wrench: (..., 6) pseudo-wrench [N, N.m].
        plane_height: [m].
        reference: (..., 3) point ``o`` of the wrench's moments [m]; the world origin when omitted.
    """
    w = np.asarray(wrench, dtype=np.float64)
    o = np.zeros(3) if reference is None else np.asarray(reference, dtype=np.float64)
    drop = plane_height - o[..., 2]
    vertical = np.where(np.abs(w[..., 2]) > 0, w[..., 2], np.nan)
    x = o[..., 0] + (drop * w[..., 0] - w[..., 4]) / vertical
    y = o[..., 1] + (drop * w[..., 1] + w[..., 3]) / vertical
    return np.stack([x, y], axis=-1)


def center_of_pressure(points: ArrayLike, normal_forces: ArrayLike) -> FloatArray:
    """(..., d) mean of contact points (n, d) [m] weighted by normal forces (..., n) [N]; NaN without load."""
    f = np.asarray(normal_forces, dtype=np.float64)
    total = f.sum(axis=-1, keepdims=True)
    return f @ np.asarray(points, dtype=np.float64) / np.where(total > 0, total, np.nan)


def foot_rotation_indicator(
    wrench: ArrayLike,
    plane_height: float = 0.0,
    foot_wrench: ArrayLike | None = None,
    reference: ArrayLike | None = None,
) -> FloatArray:
    """(..., 2) point at which the ground would have to push to keep the foot still (Goswami 1999) [m].

    It is the ZMP of the body with its supporting foot held at rest, and may leave the sole: by how much and
    where tells how the foot starts to rotate. Single support only. ``foot_wrench`` (..., 6) is the rate of
    change of the supporting foot's own momentum, 0 for a foot at rest; the other arguments are those of
    :func:`zero_moment_point`.
    """
    foot = 0.0 if foot_wrench is None else np.asarray(foot_wrench, dtype=np.float64)
    return zero_moment_point(np.asarray(wrench, dtype=np.float64) - foot, plane_height, reference)


def centroidal_moment_pivot(force: ArrayLike, com: ArrayLike, plane_height: float = 0.0) -> FloatArray:
    """(..., 2) point where the line along the force through the CoM meets the plane [m]; NaN without load.

    This CMP is also the ZRAM point (Goswami and Kallem 2004): a contact force acting there would leave the
    angular momentum as it is. Its distance to the ZMP is |Ldot| / f_z. The force ``m (a - g)`` is (..., 3)
    [N], as is the CoM [m].
    """
    f, x = np.asarray(force, dtype=np.float64), np.asarray(com, dtype=np.float64)
    vertical = np.where(np.abs(f[..., 2:]) > 0, f[..., 2:], np.nan)
    return x[..., :2] - (x[..., 2:] - plane_height) * f[..., :2] / vertical


def admissible_com_polygon(
    W: WrenchPolytope, mass: float, acceleration: ArrayLike = (0.0, 0.0, 0.0), height: float = 0.0
) -> FloatArray:
    """(k, 2) corners of the ground below admissible CoM positions, counter-clockwise ([Qiu2012]_ 4.41) [m].

    There are none when the stance cannot carry the body. At rest the height of the CoM does not matter.

    Raises:
        InputError: If the polygon is unbounded (free fall, ``acceleration = g``).
    """
    at_zero = pseudo_wrench(
        mass, (0.0, 0.0, height), frozen_array(acceleration, "acceleration", (3,)), None, W.reference
    )
    matrix = np.vstack([np.zeros((3, 2)), -skew(at_zero[:3])[:, :2]])
    return polygon_of_halfplanes(W.H @ matrix, W.h - W.H @ at_zero)


def admissible_zmp_polygon(
    W: WrenchPolytope,
    mass: float,
    com: ArrayLike,
    vertical_acceleration: float = 0.0,
    plane_height: float = 0.0,
) -> FloatArray:
    """(k, 2) corners of the admissible ZMP positions, counter-clockwise ([Qiu2012]_ 4.43-4.45) [m].

    The horizontal accelerations that W_p admits, carried to the ZMP by the (linear) ZMP formula; no angular
    momentum. Friction makes it smaller than the support polygon; without admissible acceleration it is empty.

    Args:
        W: Wrench polytope.
        mass: [kg].
        com: (3,) [m], above or below the plane.
        vertical_acceleration: Of the CoM [m/s^2], above ``-g``.
        plane_height: [m].

    Raises:
        InputError: If the CoM lies in the plane or falls freely: its ZMP is then fixed or undefined.
    """
    x = frozen_array(com, "com [m]", (3,))
    lift = finite_number(vertical_acceleration, "vertical_acceleration [m/s^2]", above=-GRAVITY) + GRAVITY
    drop = x[2] - plane_height
    if abs(drop) < 1e-9:
        raise InputError(f"CoM height {x[2]:g} m lies in the ZMP plane; valid: a CoM above or below it")
    weight = finite_number(mass, "mass [kg]", above=0.0) * lift
    arm = skew(x - W.reference)
    force_of_zmp = np.array([[-weight / drop, 0.0], [0.0, -weight / drop], [0.0, 0.0]])
    force_at_origin = np.array([x[0] * weight / drop, x[1] * weight / drop, weight])
    matrix = np.vstack([force_of_zmp, arm @ force_of_zmp])
    offset = np.concatenate([force_at_origin, arm @ force_at_origin])
    return polygon_of_halfplanes(W.H @ matrix, W.h - W.H @ offset)
