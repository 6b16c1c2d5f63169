"""Postures of our human straight from joint centres, without search."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.ball_joint import ball_angles, ball_rotation
from manikin.mocap.anatomy import SIDES
from manikin.mocap.proportions import middle
from manikin.spatial import FloatArray

STRAIGHT = 0.15
"""Sine of the bend below which the carrier's left-right axis, too, tells a limb's turn about itself."""

_LIMBS = {
    "thigh": ("pelvis", "leg", "foot", "knee_flexion", 1.0),
    "upper_arm": ("thorax", "forearm", "hand", "elbow_flexion", -1.0),
}
"""Ball joint's segment: what carries it, the joints beyond, the hinge between, and its sense about y."""


def trunk_axes(centres: Mapping[str, FloatArray], part: str) -> FloatArray:
    """(n, 3, 3) axes of the pelvis (``"thigh"``) or thorax (``"upper_arm"``), to the world.

    y from the right joint to the left one, z from between the hips to between the shoulders.
    """
    y = centres[f"left_{part}"] - centres[f"right_{part}"]
    return frames(middle(centres, "upper_arm") - middle(centres, "thigh"), y, keep_y=True)


def closed_form(
    body: BodyModel, centres: Mapping[str, FloatArray], pelvis: FloatArray, thorax: FloatArray
) -> FloatArray:
    """Postures within the joints' limits, close to the recorded ones.

    The spine's turn is shared by lumbar and thorax, limbs point as recorded, their turn about
    themselves is told by the bend of knee and elbow; neck, wrists and ankles are at 0.

    Args:
        body: Our human.
        centres: (n, 3) joint centres [m].
        pelvis: (n, 3, 3) from the pelvis' axes to the world's.
        thorax: (n, 3, 3) from the thorax' axes to the world's.

    Returns:
        (n, nq).
    """
    q = np.tile(body.zero_posture(), (len(pelvis), 1))
    q[:, :3] = middle(centres, "thigh")
    q[:, 3:7] = Rotation.from_matrix(pelvis).as_quat()
    spine = Rotation.from_matrix(pelvis.transpose(0, 2, 1) @ thorax)
    half = Rotation.from_rotvec(0.5 * spine.as_rotvec()).as_matrix()
    carriers = {"pelvis": pelvis, "thorax": pelvis}
    for name in ("lumbar", "thorax"):
        carriers["thorax"] = carriers["thorax"] @ _set_ball(body, q, name, half)
    for part, (carrier, beyond, end, hinge, sign) in _LIMBS.items():
        for side in SIDES:
            upper = centres[f"{side}_{beyond}"] - centres[f"{side}_{part}"]
            lower = centres[f"{side}_{end}"] - centres[f"{side}_{beyond}"]
            upper, lower = _unit(upper), _unit(lower)
            cross = np.cross(upper, lower)
            bent = np.linalg.norm(cross, axis=1)
            y = sign * cross + np.maximum(STRAIGHT - bent, 0.0)[:, None] * carriers[carrier][:, :, 1]
            turns = frames(-upper, y, keep_y=False)
            _set_ball(body, q, f"{side}_{part}", carriers[carrier].transpose(0, 2, 1) @ turns)
            bend = np.arctan2(bent, np.sum(upper * lower, axis=1))
            q[:, 7 + body.joint_index(f"{side}_{hinge}")] = bend
    q[:, 7:] = np.clip(q[:, 7:], body.lower, body.upper)
    return q


def frames(z: FloatArray, y: FloatArray, *, keep_y: bool) -> FloatArray:
    """(n, 3, 3) with columns x, y, z of (n, 3) directions; the one kept is exact."""
    if keep_y:
        y = _unit(y)
        z = _unit(z - np.sum(z * y, axis=1, keepdims=True) * y)
    else:
        z = _unit(z)
        y = _unit(y - np.sum(y * z, axis=1, keepdims=True) * z)
    return np.stack([np.cross(y, z), y, z], axis=-1)


def _set_ball(body: BodyModel, q: FloatArray, segment: str, turns: FloatArray) -> FloatArray:
    """Write the angles of a ball joint, kept to its limits; the (n, 3, 3) turns that they make."""
    hinges = body.segment(segment).hinges
    axes = np.array([hinge.axis for hinge in hinges])
    lower, upper = (np.array([getattr(hinge, end) for hinge in hinges]) for end in ("lower", "upper"))
    angles = np.clip(ball_angles(axes, turns, 0.5 * (lower + upper)), lower, upper)
    first = 7 + body.joint_index(hinges[0].name)
    q[:, first : first + 3] = angles
    return ball_rotation(axes, angles)


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
