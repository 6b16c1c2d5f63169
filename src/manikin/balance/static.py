"""Contact forces that hold a posture at rest, by one linear program ([Bretl2008]_'s test, with grasps).

Unlike the wrench polytope it knows the posture, and with it the torques of the joints; it costs a few
milliseconds and shares no code with the polytope. The region where the centre of mass may rest comes from
the polytope.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

from manikin.balance.contact_forces import ContactGenerators
from manikin.balance.criteria import admissible_com_polygon
from manikin.balance.wrench import wrench_polytope
from manikin.body import BodyModel, Configuration
from manikin.contact import Stance, default_normal_force_cap
from manikin.numerics.polygon import polygon_of_halfplanes, signed_distance
from manikin.numerics.spatial import GRAVITY, FloatArray


@dataclass(frozen=True, eq=False)
class StaticRegion:
    """Ground below the places of the centre of mass at which a stance carries the body at rest.

    Attributes:
        polygon: (k, 2) vertices counter-clockwise [m]; none when the stance cannot carry the body.
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
            inner = self._inset(distance)
            if len(inner) >= 3:
                return _onto(inner, point)
        return None

    def _inset(self, distance: float) -> FloatArray:
        if self.is_empty:
            return self.polygon
        edges = np.roll(self.polygon, -1, axis=0) - self.polygon
        lengths = np.linalg.norm(edges, axis=1)
        edges, start = edges[lengths > 1e-9], self.polygon[lengths > 1e-9]
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[lengths > 1e-9, None]
        return polygon_of_halfplanes(normals, np.einsum("ni,ni->n", normals, start) - distance)


def _onto(polygon: FloatArray, point: FloatArray) -> FloatArray:
    """Nearest point of a convex polygon."""
    if signed_distance(point, polygon) >= 0.0:
        return np.array(point, dtype=np.float64)
    edges = np.roll(polygon, -1, axis=0) - polygon
    shares = np.einsum("ni,ni->n", point - polygon, edges) / np.maximum(
        np.einsum("ni,ni->n", edges, edges), 1e-18
    )
    points = polygon + np.clip(shares, 0.0, 1.0)[:, None] * edges
    return points[int(np.argmin(np.linalg.norm(points - point, axis=1)))]


def static_room(stance: Stance, mass: float, com: FloatArray, directions: int = 8) -> float:
    """Distance that the centre of mass may move in any horizontal direction while held at rest [m].

    One linear program for each direction; the room is exact in these directions.

    Args:
        stance: The contacts that carry the body; a sum of normal forces without a cap has the default one.
        mass: Of the body [kg].
        com: (3,) centre of mass [m].
        directions: Number of directions.

    Returns:
        Distance [m]; minus infinity where the contacts cannot hold the body as it is.
    """
    if not len(stance):
        return -np.inf
    generators, cap = ContactGenerators.of(stance), _cap(stance, mass)
    bounds = [(0.0, limit) for limit in generators.upper]
    about_origin = generators.about(np.zeros(3))
    weight = mass * GRAVITY
    room = np.inf
    for angle in 2.0 * np.pi * np.arange(directions) / directions:
        step = np.array([np.cos(angle), np.sin(angle), 0.0])
        column = np.concatenate([np.zeros(3), -np.cross(step, [0.0, 0.0, weight])])
        wanted = np.concatenate([[0.0, 0.0, weight], np.cross(com, [0.0, 0.0, weight])])
        solution = linprog(
            np.append(np.zeros(len(bounds)), -1.0),
            A_ub=np.append(generators.normal, 0.0)[None], b_ub=[cap],
            A_eq=np.column_stack([about_origin, column]), b_eq=wanted,
            bounds=[*bounds, (0.0, 1e3)], method="highs",
        )  # fmt: skip
        if not solution.success:
            return -np.inf
        room = min(room, float(solution.x[-1]))
    return room


def static_torque_share(body: BodyModel, q: FloatArray, stance: Stance) -> float:
    """Smallest share of the joints' torque limits with which a posture is held at rest.

    Minimises the largest share of a torque limit over the contact forces, with
    ``tau = g(q) - sum J^T w`` and the six rows of the root in equilibrium.

    Args:
        body: The body.
        q: (nq,) posture that holds the contacts.
        stance: The contacts that carry it, with a cap as in :func:`static_room`.

    Returns:
        The share; infinite where the contacts cannot hold the posture.
    """
    if not len(stance):
        return np.inf
    generators, state = ContactGenerators.of(stance), Configuration(body, q)
    origins = np.array([contact.position for contact in stance])[generators.contact]
    wrenches = generators.about(origins).T
    model = body.pinocchio
    gravity = pin.computeGeneralizedGravity(model, model.createData(), np.asarray(q))
    jacobians = [state.effector_jacobian(contact.effector) for contact in stance]
    columns = np.column_stack(
        [jacobians[number].T @ wrench for number, wrench in zip(generators.contact, wrenches, strict=True)]
    )
    count = len(wrenches)
    above = np.column_stack([columns[6:], body.torque_lower])
    below = np.column_stack([-columns[6:], -body.torque_upper])
    solution = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([above, below, np.append(generators.normal, 0.0)]),
        b_ub=np.concatenate([gravity[6:], -gravity[6:], [_cap(stance, body.mass)]]),
        A_eq=np.column_stack([columns[:6], np.zeros(6)]), b_eq=gravity[:6],
        bounds=[*((0.0, limit) for limit in generators.upper), (0.0, None)], method="highs",
    )  # fmt: skip
    return float(solution.x[-1]) if solution.success else np.inf


def _cap(stance: Stance, mass: float) -> float:
    """Largest sum of the normal forces [N]."""
    return stance.normal_force_cap or default_normal_force_cap(mass)
