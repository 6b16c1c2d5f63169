"""Limbs of recorded cycles kept out of the reference body, which is wider than some recorded people."""

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.locomotion.fourier import fourier_basis
from manikin.locomotion.library import ROOT
from manikin.locomotion.turns import quaternions
from manikin.mocap.anatomy import SIDES
from manikin.spatial import FloatArray

INSTANTS = 24
"""Of a cycle that are looked at."""

ARM_STEP, LEG_STEP = np.deg2rad(2.5), np.deg2rad(0.75)
"""By how much limbs are spread at a time [rad]."""

MOST_STEPS = 5

ARMS, LEGS = 3 * ARM_STEP, 2 * LEG_STEP
"""By how much they are spread in every cycle, so that neighbours differ the less in it [rad]."""

_ARMS, _LEGS = ("upper_arm", "forearm", "hand"), ("thigh", "leg", "foot", "toes")


def spread(body: BodyModel, coefficients: FloatArray) -> FloatArray:
    """Coefficients with both arms, and both legs, abducted until they touch neither the body nor each other.

    By equal angles on both sides and the same throughout the cycle: 7.5 to 20 degrees for arms, 1.5 to 5.25
    for legs. Legs that cross in a turn may still touch.

    Args:
        body: The reference body.
        coefficients: (2 k + 1, s) of one cycle.
    """
    found = np.array(coefficients)
    data, geometry = body.pinocchio.createData(), pin.GeometryData(body.geometry)
    shoulders, hips = (
        [len(ROOT) + body.joint_index(f"{side}_{name}_abduction") for side in SIDES]
        for name in ("shoulder", "hip")
    )
    found[0, shoulders] += ARMS
    found[0, hips] += LEGS
    pairs = _pairs(body)
    for _ in range(MOST_STEPS):
        touching = _touching(body, found, data, geometry)
        arms, legs = (bool(np.any(touching[chosen])) for chosen in pairs)
        if not arms and not legs:
            break
        found[0, shoulders] += ARM_STEP * arms
        found[0, hips] += LEG_STEP * legs
    return found


def _pairs(body: BodyModel) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Pairs of shapes with an arm, and pairs of legs."""
    names = [shape.name.split("/")[0] for shape in body.geometry.geometryObjects]
    both = [(names[pair.first], names[pair.second]) for pair in body.geometry.collisionPairs]
    arms = np.array([any(name.endswith(_ARMS) for name in pair) for pair in both])
    legs = np.array([all(name.endswith(_LEGS) for name in pair) for pair in both])
    return arms, legs & ~arms


def _touching(body: BodyModel, coefficients: FloatArray, data: Any, geometry: Any) -> NDArray[np.bool_]:
    """(pairs,) whether they touch at any instant."""
    phase = np.arange(INSTANTS) / INSTANTS
    signals = fourier_basis(phase, (len(coefficients) - 1) // 2) @ coefficients
    turns = quaternions(signals[:, 5], signals[:, 4], signals[:, 3])
    angles = np.clip(signals[:, len(ROOT) :], body.lower, body.upper)
    found = np.zeros(len(body.geometry.collisionPairs), dtype=np.bool_)
    for posture in np.hstack([np.zeros((INSTANTS, 3)), turns, angles]):
        pin.computeCollisions(body.pinocchio, data, body.geometry, geometry, posture, False)
        found |= [result.isCollision() for result in geometry.collisionResults]
    return found
