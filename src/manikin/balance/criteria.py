"""The classical criteria beside W_p (CoM projection, ZMP and CoP, FRI, CMP and ZRAM), and static equilibrium.

The former are points of a horizontal plane, to be held inside the support polygon; W_p is more general, as
these know neither friction nor walls nor grasps ([Qiu2012]_ 4.1.2, 4.2.8). Contact forces that hold a posture
at rest come from one linear program ([Bretl2008]_'s test, with grasps): unlike W_p it knows the posture, and
with it the torques of the joints.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from manikin.balance.contact_forces import ContactGenerators
from manikin.balance.wrench import WrenchPolytope, pseudo_wrench, wrench_polytope
from manikin.body import BodyModel, Configuration
from manikin.contact import ContactKind, Stance, default_normal_force_cap
from manikin.errors import InputError
from manikin.numerics.polytope import convex_polygon, inset_polygon, polygon_of_halfplanes, signed_distance
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number, frozen_array, skew

SHARE_PRICE, SHARE_WEIGHT, FORCE_WEIGHT = 10.0, 1e-3, 1e-4
"""Price of a share of the strength against half the square of a motion [rad^2], and the weights that make
shares and forces over the weight unique; our choice."""


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


def foot_rotation_indicator(
    wrench: ArrayLike, plane_height: float = 0.0, foot_wrench: ArrayLike | None = None,
    reference: ArrayLike | None = None,
) -> FloatArray:  # fmt: skip
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
    InputError if the polygon is unbounded (free fall, ``acceleration = g``).
    """
    given = frozen_array(acceleration, "acceleration", (3,))
    at_zero = pseudo_wrench(mass, (0.0, 0.0, height), given, None, W.reference)
    matrix = np.vstack([np.zeros((3, 2)), -skew(at_zero[:3])[:, :2]])
    return polygon_of_halfplanes(W.H @ matrix, W.h - W.H @ at_zero)


def admissible_zmp_polygon(
    W: WrenchPolytope, mass: float, com: ArrayLike, vertical_acceleration: float = 0.0,
    plane_height: float = 0.0,
) -> FloatArray:  # fmt: skip
    """(k, 2) corners of the admissible ZMP positions, counter-clockwise ([Qiu2012]_ 4.43-4.45) [m].

    The horizontal accelerations that W_p admits, carried to the ZMP by the (linear) ZMP formula; no angular
    momentum. Friction makes it smaller than the support polygon; without admissible acceleration it is empty.

    Args:
        mass: [kg].
        com: (3,) [m], above or below the plane; InputError in it, where the ZMP is fixed.
        vertical_acceleration: Of the CoM [m/s^2], above ``-g``; InputError otherwise.
        plane_height: [m].
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


@dataclass(frozen=True, eq=False)
class StaticRegion:
    """Ground below the places of the centre of mass at which a stance carries the body at rest.

    Its polygon has vertices (k, 2) counter-clockwise [m]; none when the stance cannot carry the body.
    """

    polygon: FloatArray

    @classmethod
    def of(cls, stance: Stance, mass: float) -> "StaticRegion":
        """Region of a stance ([Qiu2012]_ 4.41), without caps with the default one of a body's mass [kg]."""
        return cls(admissible_com_polygon(wrench_polytope(stance.bounded(mass)), mass))

    @property
    def is_empty(self) -> bool:
        """Whether the body can stand still nowhere on this stance."""
        return len(self.polygon) < 3

    def nearest(self, point: FloatArray, inset: float) -> FloatArray | None:
        """(2,) nearest point to a (2,) point [m] with a distance to the region's edges, or None.

        The distance is ``inset`` [m], or half or a quarter of it where the region is too narrow.
        """
        for distance in (inset, 0.5 * inset, 0.25 * inset):
            inner = self.polygon if self.is_empty else inset_polygon(self.polygon, distance)
            if len(inner) >= 3:
                return _onto(inner, point)
        return None


def _onto(polygon: FloatArray, point: FloatArray) -> FloatArray:
    """Nearest point of a convex polygon."""
    if signed_distance(point, polygon) >= 0.0:
        return np.array(point, dtype=np.float64)
    edges = np.roll(polygon, -1, axis=0) - polygon
    squares = np.maximum(np.einsum("ni,ni->n", edges, edges), 1e-18)
    shares = np.einsum("ni,ni->n", point - polygon, edges) / squares
    points = polygon + np.clip(shares, 0.0, 1.0)[:, None] * edges
    return points[int(np.argmin(np.linalg.norm(points - point, axis=1)))]


def static_torque_share(
    body: BodyModel, q: FloatArray, stance: Stance, acceleration: FloatArray | None = None
) -> float:
    """Smallest share of the joints' torque limits with which a posture is held at rest; infinite if none is.

    Args:
        q: (nq,) posture that holds the contacts.
        stance: The contacts that carry it; a sum of normal forces without a cap has the default one.
        acceleration: (3,) of the whole body, which moves as one [m/s^2]; none when omitted.
    """
    return RestingTorques(body, q, stance, acceleration).share


class RestingTorques:
    """Joint torques ``tau = g(q) - sum J^T w`` of a posture at rest, the six rows of the root in equilibrium.

    Attributes:
        share: Their largest share of a torque limit, the smallest over all contact forces; infinite where no
            forces hold the posture.
    """

    def __init__(
        self, body: BodyModel, q: FloatArray, stance: Stance, acceleration: FloatArray | None = None
    ) -> None:
        """Share the weight; the arguments are those of :func:`static_torque_share`."""
        self.share, self._body, self._stance, self._q = np.inf, body, stance, np.asarray(q)
        if not len(stance):
            return
        self._state, self._generators = Configuration(body, q), ContactGenerators.of(stance)
        origins = np.array([contact.position for contact in stance])[self._generators.contact]
        self._wrenches = self._generators.about(origins).T
        model, moving = body.pinocchio, np.zeros(body.nv)
        if acceleration is not None:
            moving[:3] = pin.XYZQUATToSE3(self._q[:7]).rotation.T @ acceleration
        self._gravity = pin.rnea(model, model.createData(), self._q, np.zeros(body.nv), moving)
        jacobians = [self._state.effector_jacobian(contact.effector) for contact in stance]
        pairs = zip(self._generators.contact, self._wrenches, strict=True)
        self._columns = np.column_stack([jacobians[number].T @ wrench for number, wrench in pairs])
        count, (level, most) = len(self._wrenches), _level_limits(stance, self._generators)
        # Rows of the forces that are bounded from above: those of grasps, and the sum of the normal ones.
        self._bounded, self._most = (
            np.vstack([level, self._generators.normal]),
            np.append(most, _cap(stance, body.mass)),
        )
        above = np.column_stack([self._columns[6:], body.torque_lower])
        below = np.column_stack([-self._columns[6:], -body.torque_upper])
        solution = linprog(
            np.append(np.zeros(count), 1.0),
            A_ub=np.vstack([above, below, np.column_stack([self._bounded, np.zeros(len(self._most))])]),
            b_ub=np.concatenate([self._gravity[6:], -self._gravity[6:], self._most]),
            A_eq=np.column_stack([self._columns[:6], np.zeros(6)]), b_eq=self._gravity[:6],
            bounds=[*((0.0, limit) for limit in self._generators.upper), (0.0, None)], method="highs",
        )  # fmt: skip
        if solution.success:
            self.share, self._forces = float(solution.x[-1]), solution.x[:-1]

    def easing(
        self, still: FloatArray, bounds: tuple[FloatArray, FloatArray], wanted: float
    ) -> tuple[FloatArray, float] | None:
        """Motion (nv,) towards a posture that asks for less, and the share that it leads to to first order.

        A quadratic program in the motion, the contact forces and the share: the smallest motion that takes
        the share to the wanted one, or a little more where that is dear. As the forces are free in it, all
        joints that limit the posture are eased at once.

        Args:
            still: (m, nv) rows along which the body does not move: Jacobians of contacts that are held.
            bounds: (nv,) lower and (nv,) upper bounds of the motion.
            wanted: Share of the limits at which it aims.

        Returns:
            None where no forces hold the posture, or no motion keeps ``still`` and the bounds.
        """
        if not np.isfinite(self.share):
            return None
        body, count, weight, gravity = self._body, len(self._forces), self._body.mass * GRAVITY, self._gravity
        # Unknowns: motion, forces over the weight, share beyond the wanted one.
        torques = np.column_stack([self._slopes(), -weight * self._columns])
        rows = [
            np.column_stack([still, np.zeros((len(still), count + 1))]),
            np.column_stack([torques[:6] / weight, np.zeros(6)]),
        ]
        fixed = np.concatenate([np.zeros(len(still)), -gravity[:6] / weight])
        upper = []
        for limit in (body.torque_upper, body.torque_lower):  # torques over their limits, one side at a time
            rows.append(np.column_stack([torques[6:] / limit[:, None], -np.ones(len(limit))]))
            upper.append(wanted - gravity[6:] / limit)
        number = len(self._most)
        rows.append(np.column_stack([np.zeros((number, body.nv)), self._bounded, np.zeros(number)]))
        upper.append(self._most / weight)
        weights = np.repeat([1.0, FORCE_WEIGHT, SHARE_WEIGHT], [body.nv, count, 1])
        towards = np.concatenate([np.zeros(body.nv), -FORCE_WEIGHT * self._forces / weight, [SHARE_PRICE]])
        low = np.concatenate([bounds[0], np.zeros(count + 1)])
        high = np.concatenate([bounds[1], self._generators.upper / weight, [np.inf]])
        most = np.concatenate(upper)
        program = solve_qp(
            np.diag(weights), towards, np.vstack(rows), np.append(fixed, np.full(len(most), -np.inf)),
            np.append(fixed, most), (low, high), equalities=len(fixed),
        )  # fmt: skip
        return (program.x[: body.nv], wanted + float(program.x[-1])) if program.solved else None

    def _slopes(self) -> FloatArray:
        """(nv, nv) derivatives of the torques along motions that keep the contacts, under constant forces."""
        model = self._body.pinocchio
        forces = pin.StdVec_Force([pin.Force.Zero()] * model.njoints)
        for number, contact in enumerate(self._stance):
            mine = self._generators.contact == number
            frame = model.frames[self._body.effector_frame(contact.effector)]
            turn = pin.SE3(self._state.effector_placement(contact.effector)[0], np.zeros(3))
            wrench = turn.actInv(pin.Force(self._forces[mine] @ self._wrenches[mine]))
            forces[frame.parentJoint] += frame.placement.act(wrench)
        return pin.computeStaticTorqueDerivatives(model, model.createData(), self._q, forces)


SIDES = 8
"""Sides of the prism, in the cylinder of the largest force, in which level forces of a grasp are."""


def _level_limits(stance: Stance, generators: ContactGenerators) -> tuple[FloatArray, FloatArray]:
    """Rows (m, g) and limits (m,) by which level forces of grasps are in a circle of their largest force.

    What a posture asks for is then possible in the grasp's box of forces however that is turned about the
    vertical, and the scene with the world.
    """
    turn = (np.arange(SIDES) + 0.5) * 2.0 * np.pi / SIDES
    sides = np.column_stack([np.cos(turn), np.sin(turn)]) @ generators.force[:, :2].T
    held = [number for number, contact in enumerate(stance) if contact.kind is ContactKind.GRASP]
    rows = [np.where(generators.contact == number, sides, 0.0) for number in held]
    limits = [np.cos(np.pi / SIDES) * stance.contacts[number].max_force for number in held]
    return np.vstack([np.zeros((0, len(generators.contact))), *rows]), np.repeat(limits, SIDES)


def _cap(stance: Stance, mass: float) -> float:
    """Largest sum of the normal forces [N]."""
    return stance.normal_force_cap or default_normal_force_cap(mass)
