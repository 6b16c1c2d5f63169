"""Whether contacts can hold a body at rest, or along a curve of its centre of mass: linear programs.

Forces act at the points of the contacts, inside Coulomb's circular cones: a pyramid of sixteen edges on the
cone stands for it, whatever pyramid planning used (it loses up to 1.9 %). The place of the centre of mass may
be unknown: weight acts along one direction, so that its moment is linear in the place.

A dynamic phase is tested as a whole as CROC does (Fernbach, Tonneau and others 2018): the centre of mass
follows a polynomial with given ends and one free control point, in which the wrench is linear.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog
from scipy.sparse import block_diag, csr_array, hstack, vstack

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind, default_normal_force_cap
from manikin.numerics.spatial import GRAVITY, FloatArray, skew

EDGES = 16
"""Edges of the pyramid on a friction cone."""

MAX_ACCELERATION = 6.0
"""Largest acceleration of the centre of mass in a dynamic phase, along each axis [m/s^2]; our choice."""

SAMPLES = 12
"""Instants of a dynamic phase at which its wrench is tested."""

_DIRECTIONS = 8


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces of a set of contacts as a linear image of bounded variables.

    Attributes:
        wrench: (6, k) force and moment about the origin per variable.
        rows: (r, k) rows of the limits that several variables share: ``rows @ x <= limits``.
        limits: (r,) [N] or [N.m].
        lower: (k,) smallest value of each variable.
        upper: (k,) largest value of each variable.
    """

    wrench: FloatArray
    rows: FloatArray
    limits: FloatArray
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class HandForce:
    """Force of both hands on what they touch: at least ``force`` [N] along a unit ``direction`` (3,)."""

    direction: FloatArray
    force: float


def forces_of(contacts: Sequence[Contact], mass: float, cap: float | None, origin: FloatArray) -> Forces:
    """Forces that contacts, at least one, can give.

    Args:
        mass: Of the body, for the cap where none is given [kg].
        cap: Largest sum of the normal forces of soles and points [N].
        origin: (3,) point of the moments [m].
    """
    blocks = [_block(contact, origin) for contact in contacts]
    counts = [0.0 if contact.kind is ContactKind.GRASP else 1.0 for contact in contacts]
    shared = np.repeat(counts, [len(block.lower) for block in blocks])
    own = block_diag([csr_array(block.rows) for block in blocks]).toarray()
    limit = default_normal_force_cap(mass) if cap is None else cap
    return Forces(
        np.concatenate([block.wrench for block in blocks], axis=1), np.vstack([own, shared]),
        np.append(np.concatenate([block.limits for block in blocks]), limit),
        np.concatenate([block.lower for block in blocks]), np.concatenate([block.upper for block in blocks]),
    )  # fmt: skip


def _acting(forces: Forces, contacts: Sequence[Contact], act: HandForce) -> Forces:
    """Forces of which those of the hands are at least what an act takes: the object pushes back."""
    sizes = [len(_block(contact, contact.position).lower) for contact in contacts]
    hands = np.repeat(["hand" in contact.effector for contact in contacts], sizes)
    row = np.where(hands, act.direction @ forces.wrench[:3], 0.0)
    rows, limits = np.vstack([forces.rows, row]), np.append(forces.limits, -act.force)
    return Forces(forces.wrench, rows, limits, forces.lower, forces.upper)


def _block(contact: Contact, origin: FloatArray) -> Forces:
    if contact.kind is ContactKind.GRASP:
        moments = 3 if contact.max_moment > 0.0 else 0
        wrench = np.zeros((6, 3 + moments))
        wrench[:3, :3], wrench[3:, :3] = np.eye(3), skew(contact.position - origin)
        wrench[3:, 3:] = np.eye(3)[:, :moments]
        bound = np.repeat([contact.max_force, contact.max_moment], [3, moments])
        return Forces(wrench, np.zeros((0, 3 + moments)), np.zeros(0), -bound, bound)
    turn = np.arange(EDGES) * 2.0 * np.pi / EDGES
    x, y, normal = contact.rotation_contact_to_world.T
    edges = normal + contact.friction * (np.outer(np.cos(turn), x) + np.outer(np.sin(turn), y))
    points = contact.points_in_world
    force, where = np.tile(edges, (len(points), 1)), np.repeat(points, EDGES, axis=0)
    count, rows, limits = len(force), [], []
    if contact.normal_force_cap is not None:
        rows.append(np.ones(count))
        limits.append(contact.normal_force_cap)
    if contact.torsion_limit is not None:
        turning = np.cross(where - contact.position, force) @ normal
        rows += [turning, -turning]
        limits += [contact.torsion_limit] * 2
    wrench = np.vstack([force.T, np.cross(where - origin, force).T])
    shared = np.array(rows).reshape(-1, count)
    return Forces(wrench, shared, np.array(limits), np.zeros(count), np.full(count, np.inf))


@dataclass(frozen=True, eq=False)
class Rest:
    """Where a body can be at rest on some contacts.

    Attributes:
        shift: Level distance by which the centre of mass would have to move for rest, or infinite [m].
        room: How far it may move any way along the level and still rest [m]; 0 where it cannot.
        place: (2,) x and y of the centre of mass at rest that is nearest [m], or None.
    """

    shift: float
    room: float
    place: FloatArray | None


def rest(
    contacts: Sequence[Contact], mass: float, cap: float | None, com: FloatArray,
    within: Mapping[int, float] | None = None, act: HandForce | None = None,
) -> Rest:  # fmt: skip
    """Equilibrium of a body at rest on contacts.

    Args:
        contacts: Those that carry.
        mass: [kg].
        cap: Largest sum of the normal forces of soles and points [N]; the body's default when None.
        com: (3,) centre of mass, or where one is looked for first [m].
        within: Largest level distance of the centre of mass from single contacts, by their number [m].
        act: What the hands do meanwhile.
    """
    if not contacts:
        return Rest(np.inf, 0.0, None)
    level = float(np.mean([contact.position[2] for contact in contacts]))
    forces = forces_of(contacts, mass, cap, np.array([com[0], com[1], level]))
    if act is not None:
        forces = _acting(forces, contacts, act)
    weight, count = mass * GRAVITY, len(forces.lower)
    # Variables: forces, level shift of the centre of mass (2), its size. Scaled by the weight.
    push = np.zeros((6, 3))
    push[3, 1], push[4, 0] = -1.0, 1.0
    equality = np.hstack([forces.wrench, push])
    target = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    rows, limits = [np.hstack([forces.rows, np.zeros((len(forces.rows), 3))])], [forces.limits / weight]
    # From a direction that turns with the contacts, so that results do not depend on the world's axes.
    forward = contacts[0].rotation_contact_to_world[:2, 0]
    turn = float(np.arctan2(forward[1], forward[0])) + np.arange(2 * _DIRECTIONS) * np.pi / _DIRECTIONS
    sides = np.column_stack([np.cos(turn), np.sin(turn)])
    bound = np.zeros((len(sides), count + 3))
    bound[:, count : count + 2] = sides
    rows += [bound - np.eye(1, count + 3, count + 2), *[bound] * len(within or ())]
    limits.append(np.zeros(len(sides)))
    for number, reach in (within or {}).items():
        limits.append(reach + sides @ (contacts[number].position[:2] - com[:2]))
    lower = np.concatenate([forces.lower / weight, [-np.inf, -np.inf, 0.0]])
    upper = np.concatenate([forces.upper / weight, [np.inf, np.inf, np.inf]])
    solved = linprog(
        np.append(np.zeros(count + 2), 1.0), A_ub=np.vstack(rows), b_ub=np.concatenate(limits),
        A_eq=equality, b_eq=target, bounds=np.column_stack([lower, upper]), method="highs",
    )  # fmt: skip
    if solved.x is None:
        return Rest(np.inf, 0.0, None)
    place, shift = com[:2] + solved.x[count : count + 2], float(solved.x[-1])
    if shift > 1e-6:
        return Rest(shift, 0.0, place)
    return Rest(0.0, _room(forces, weight, sides[::2]), place)


def _room(forces: Forces, weight: float, sides: FloatArray) -> float:
    """How far the centre of mass may move along each of some directions (d, 2) at once [m]."""
    count, copies = len(forces.lower), len(sides)
    blocks = block_diag([csr_array(forces.wrench)] * copies)
    moment = np.zeros((6 * copies, 1))
    for number, (x, y) in enumerate(sides):
        moment[6 * number + 3], moment[6 * number + 4] = -y, x
    limits = block_diag([csr_array(forces.rows)] * copies)
    bounds = np.column_stack([
        np.append(np.tile(forces.lower / weight, copies), 0.0),
        np.append(np.tile(forces.upper / weight, copies), 10.0),
    ])  # fmt: skip
    solved = linprog(
        np.append(np.zeros(count * copies), -1.0),
        A_ub=hstack([limits, csr_array((len(forces.rows) * copies, 1))]),
        b_ub=np.tile(forces.limits / weight, copies), A_eq=hstack([blocks, csr_array(moment)]),
        b_eq=np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], copies), bounds=bounds, method="highs",
    )  # fmt: skip
    return 0.0 if solved.x is None else float(solved.x[-1])


def torque_share(body: BodyModel, q: FloatArray, contacts: Sequence[Contact], cap: float | None) -> float:
    """Smallest share of the joints' torque limits with which a posture (nq,) can be held at rest.

    The largest share of any joint, as small as the forces of the contacts that carry can make it, normal ones
    up to a cap as of :func:`rest`; infinite where they cannot hold the posture.
    """
    if not contacts:
        return np.inf
    model, data = body.pinocchio, body.pinocchio.createData()
    gravity = np.array(pin.computeGeneralizedGravity(model, data, q))
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    columns, axes = [], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for contact in contacts:
        jacobian = pin.getFrameJacobian(model, data, body.effector_frame(contact.effector), axes)
        columns.append(jacobian.T @ forces_of([contact], body.mass, cap, contact.position).wrench)
    forces = forces_of(contacts, body.mass, cap, np.zeros(3))
    held, count = np.concatenate(columns, axis=1), len(forces.lower)
    # Joint torques are gravity less what the contact forces give: between the limits times the share.
    above = np.column_stack([-held[6:], -body.torque_upper])
    below = np.column_stack([held[6:], body.torque_lower])
    shared = np.column_stack([forces.rows, np.zeros(len(forces.rows))])
    solved = linprog(
        np.append(np.zeros(count), 1.0), A_ub=np.vstack([above, below, shared]),
        b_ub=np.concatenate([-gravity[6:], gravity[6:], forces.limits]),
        A_eq=np.column_stack([held[:6], np.zeros(6)]), b_eq=gravity[:6],
        bounds=np.column_stack([np.append(forces.lower, 0.0), np.append(forces.upper, np.inf)]),
        method="highs",
    )  # fmt: skip
    return np.inf if solved.x is None else float(solved.x[-1])


@dataclass(frozen=True, eq=False)
class CentreState:
    """Centre of mass at an instant: position (3,) [m] and velocity (3,) [m/s]."""

    position: FloatArray
    velocity: FloatArray


def dynamic_shortfall(
    contacts: Sequence[Contact], mass: float, cap: float | None, start: CentreState, end: CentreState,
    duration: float,
) -> float:  # fmt: skip
    """Share of the weight that contacts lack at worst on the way between two states; 0 where it is possible.

    The centre of mass follows a Bezier curve of degree four with one free control point, without angular
    momentum about it, and accelerates by no more than :data:`MAX_ACCELERATION` along each axis.

    Args:
        contacts: Those that carry during the phase.
        duration: Of the phase [s].
    """
    if not contacts:
        return 1.0
    weight = mass * GRAVITY
    fixed = [
        start.position, start.position + 0.25 * duration * start.velocity, np.zeros(3),
        end.position - 0.25 * duration * end.velocity, end.position,
    ]  # fmt: skip
    origin = 0.5 * (start.position + end.position)
    forces, ends = forces_of(contacts, mass, cap, origin), np.array(fixed) - origin
    count, ends[2] = len(forces.lower), 0.0
    width = 4 + count * SAMPLES  # free point from the origin (3), shortfall, forces of each instant
    equality, target, limits, bound = [], [], [], []
    for number, share in enumerate(np.linspace(0.0, 1.0, SAMPLES)):
        weights, second = _bernstein(4, share), _bernstein_second(share) / duration**2
        # c = base + w u and c'' = a + s u: without u x u the moment c x (c'' + g) is linear in u.
        base, acceleration = weights @ ends, second @ ends
        pull = acceleration + np.array([0.0, 0.0, GRAVITY])
        own = slice(4 + number * count, 4 + (number + 1) * count)
        rows = np.zeros((6, width))
        rows[:3, :3] = second[2] * np.eye(3)
        rows[3:, :3] = second[2] * skew(base) - weights[2] * skew(pull)
        rows[:, own] = -GRAVITY * forces.wrench
        equality.append(rows)
        target.append(-np.concatenate([pull, np.cross(base, pull)]))
        level = np.zeros((6, width))
        level[:3, :3], level[3:, :3] = second[2] * np.eye(3), -second[2] * np.eye(3)
        shared = np.zeros((len(forces.rows), width))
        shared[:, own] = forces.rows
        limits += [level, shared]
        bound += [MAX_ACCELERATION - acceleration, MAX_ACCELERATION + acceleration, forces.limits / weight]
    # The smallest size of the wrench that is missing at the worst instant, relative to the weight (and 1 m).
    matrix, wanted, cost = np.concatenate(equality), np.concatenate(target), np.eye(1, width, 3)[0]
    upper = csr_array(np.vstack([matrix - GRAVITY * cost, -matrix - GRAVITY * cost]))
    low = np.concatenate([[-np.inf] * 3, [0.0], np.tile(forces.lower / weight, SAMPLES)])
    high = np.concatenate([[np.inf] * 4, np.tile(forces.upper / weight, SAMPLES)])
    solved = linprog(
        cost, A_ub=vstack([upper, csr_array(np.vstack(limits))]),
        b_ub=np.concatenate([wanted, -wanted, *bound]), bounds=np.column_stack([low, high]), method="highs",
    )  # fmt: skip
    return 1.0 if solved.x is None else float(solved.x[3])


def _bernstein(degree: int, share: float) -> FloatArray:
    powers = range(degree + 1)
    return np.array([comb(degree, k) * share**k * (1.0 - share) ** (degree - k) for k in powers])


def _bernstein_second(share: float) -> FloatArray:
    """Second derivatives of the five Bernstein polynomials of degree four."""
    return 12.0 * np.diff(np.pad(_bernstein(2, share), 2), n=2)
