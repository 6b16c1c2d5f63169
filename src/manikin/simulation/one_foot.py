"""A posture on one foot, to be pushed in."""

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.control.balance_recovery import joint_groups, sole_at
from manikin.errors import InputError
from manikin.posture import Placement, PostureProblem, com_target, generate_posture
from manikin.spatial import FloatArray

RAISED = np.array([-0.1, 0.0, 0.12])
"""Where the other foot is held, from its place on the ground [m]: behind and clear of it."""


def one_foot_posture(body: BodyModel, foot: str) -> FloatArray:
    """Stand on one foot, the centre of mass over the middle of its sole.

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
        com=com_target(*contact.position[:2]),
    )  # fmt: skip
    found = generate_posture(problem)
    if not found.succeeded:
        raise InputError(
            f"body {body.name!r} does not stand on the {foot.replace('_', ' ')}: {found.failure}"
        )
    return found.q
