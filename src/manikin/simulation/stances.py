"""Postures to be pushed in: on one foot, or with the feet nearer to each other or wider apart."""

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.control.balance_recovery import joint_groups, sole_at
from manikin.errors import InputError
from manikin.posture import Placement, PostureProblem, com_target, generate_posture
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray, finite_number

RAISED = np.array([-0.1, 0.0, 0.12])
"""Where the other foot is held, from its place on the ground [m]: behind and clear of it."""

APART = "distance between the feet [m]"
"""Its name in messages."""


def one_foot_posture(body: BodyModel, foot: str) -> FloatArray:
    """Stand on one foot, the centre of mass over the middle of its sole and no part of the body in another.

    Args:
        body: A body with two legs.
        foot: Effector of the foot that carries; it stays where it is in the standing posture.

    Returns:
        (nq,) configuration.

    Raises:
        InputError: If the body has no such foot, or cannot stand like that.
    """
    feet = joint_groups(body).feet
    if foot not in feet:
        raise InputError(f"foot to stand on is {foot!r}; valid: {', '.join(feet)}")
    other = next(name for name in feet if name != foot)
    start = Configuration(body, body.standing_posture())
    contact = sole_at(body, foot, *start.effector_placement(foot), friction=1.0)
    rotation, place = start.effector_placement(other)
    problem = PostureProblem(
        body, (contact,), placements={other: Placement(place + RAISED, rotation)},
        com=com_target(*contact.position[:2]), proximity=Proximity(body, Scene([], floor_height=None)),
    )  # fmt: skip
    return _standing(problem, f"on the {foot!r}")


def feet_apart_posture(body: BodyModel, distance: float) -> FloatArray:
    """Stand on both feet, as far apart as wanted and the centre of mass between them.

    Args:
        body: A body with two legs.
        distance: Between the middles of the soles, sideways [m].

    Returns:
        (nq,) configuration.

    Raises:
        InputError: If the soles would overlap, or the body cannot stand like that.
    """
    finite_number(distance, APART, at_least=0.0)
    start = Configuration(body, body.standing_posture())
    feet = joint_groups(body).feet
    placements = [start.effector_placement(foot) for foot in feet]
    middle = np.mean([place for _, place in placements], axis=0)
    soles = []
    for foot, (rotation, place) in zip(feet, placements, strict=True):
        side = np.array([place[0], middle[1] + 0.5 * distance * np.sign(place[1] - middle[1]), place[2]])
        soles.append(sole_at(body, foot, rotation, side, friction=1.0))
    width = max(float(np.ptp(sole.points_in_world[:, 1])) for sole in soles)
    finite_number(distance, APART, at_least=width)
    com = np.mean([sole.position[:2] for sole in soles], axis=0)
    problem = PostureProblem(body, tuple(soles), com=com_target(*com))
    return _standing(problem, f"with the feet {distance:g} m apart")


def _standing(problem: PostureProblem, how: str) -> FloatArray:
    found = generate_posture(problem)
    if not found.succeeded:
        raise InputError(f"body {problem.body.name!r} does not stand {how}: {found.failure}")
    return found.q
