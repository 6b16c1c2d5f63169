"""Which segments of a body are its trunk, head, arms and legs, and how they are turned, frame by frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel, limb_named
from manikin.errors import BodyError
from manikin.spatial import FloatArray

SIDES = ("left", "right")


@dataclass(frozen=True)
class Parts:
    """Names of the segments that postures are judged by.

    Attributes:
        trunk: From the free root to the segment that carries the arms.
        neck: From there to the head, without the former.
        arms: Upper arm, forearm and hand of each side.
        legs: Thigh, shank and foot of each side.
    """

    trunk: tuple[str, ...]
    neck: tuple[str, ...]
    arms: dict[str, tuple[str, str, str]]
    legs: dict[str, tuple[str, str, str]]


def parts_of(body: BodyModel) -> Parts:
    """Find the parts of a human body.

    Raises:
        BodyError: If it has not two arms and two legs of three segments each, and a head.
    """
    limbs = {}
    for name in (f"{side}_{limb}" for limb in ("arm", "leg") for side in SIDES):
        segments = limb_named(body, name).segments
        if len(segments) != 3:
            raise BodyError(f"limb {name!r} has {len(segments)} segments; valid: 3, as a human's")
        limbs[name] = (segments[0], segments[1], segments[2])
    carriers = {body.segment(limbs[f"{side}_arm"][0]).parent for side in SIDES}
    trunk = _chain(body, carriers.pop() or "")
    head = _chain(body, body.effector("head").segment)
    if carriers or head[: len(trunk)] != trunk or len(head) == len(trunk):
        raise BodyError(f"body {body.name!r} has no trunk with both arms and a neck; valid: a human")
    arms, legs = ({side: limbs[f"{side}_{kind}"] for side in SIDES} for kind in ("arm", "leg"))
    return Parts(trunk, head[len(trunk) :], arms, legs)


def _chain(body: BodyModel, name: str) -> tuple[str, ...]:
    """Segments from the root to one of them."""
    chain: list[str] = []
    following: str | None = name
    while following is not None:
        chain.insert(0, following)
        following = body.segment(following).parent
    return tuple(chain)


def joint_rotation(body: BodyModel, q: FloatArray, segment: str) -> FloatArray:
    """(n, 3, 3) rotation of a segment in its parent, for all frames at once.

    Each hinge turns about a constant axis, so that Rodrigues' formula needs only its sines and cosines.

    Args:
        body: The body.
        q: (n, nq) configurations.
        segment: Not the root.
    """
    found = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    for hinge in body.segment(segment).hinges:
        angle = q[:, 7 + body.joint_index(hinge.name)][:, None, None]
        x, y, z = hinge.axis
        turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        found = found @ (np.eye(3) + np.sin(angle) * turn + (1.0 - np.cos(angle)) * (turn @ turn))
    return found


def root_rotation(q: FloatArray) -> FloatArray:
    """(n, 3, 3) rotation of the root in the world."""
    x, y, z, w = (q[:, 3:7] / np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def placements(
    body: BodyModel, q: FloatArray, segments: Sequence[str], rotation: FloatArray, place: FloatArray
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Rotations (n, 3, 3) and origins (n, 3) [m] of a chain of segments.

    Args:
        body: The body.
        q: (n, nq) configurations.
        segments: Each the parent of the next.
        rotation: (n, 3, 3) of the first one's parent, in the frame that is asked for.
        place: (n, 3) or (3,) its origin there [m].
    """
    rotations, places = [], []
    for name in segments:
        place = place + rotation @ body.segment(name).origin
        rotation = rotation @ joint_rotation(body, q, name)
        rotations.append(rotation)
        places.append(place)
    return rotations, places


def twist_about_z(rotation: FloatArray) -> FloatArray:
    """(n,) turn about z that rotations (n, 3, 3) are left with without the shortest swing of z [rad]."""
    return np.arctan2(rotation[:, 1, 0] - rotation[:, 0, 1], rotation[:, 0, 0] + rotation[:, 1, 1])
