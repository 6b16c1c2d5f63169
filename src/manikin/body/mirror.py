"""Reflection of postures in the sagittal plane: left becomes right."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body.limbs import REFLECTION
from manikin.body.model import BodyModel
from manikin.errors import BodyError
from manikin.spatial import FloatArray

_OTHER = {"left_": "right_", "right_": "left_"}


def mirrored_name(name: str) -> str:
    """Name of the same part on the other side; one in the middle keeps its name."""
    for prefix, other in _OTHER.items():
        if name.startswith(prefix):
            return other + name[len(prefix) :]
    return name


def mirrored_hinges(body: BodyModel) -> tuple[NDArray[np.int64], FloatArray]:
    """Where each hinge finds its angle in the mirrored posture, and the factor of the angle.

    Returns:
        (nv - 6,) indices of hinges on the other side and (nv - 6,) factors, 1 or -1: ``mirrored =
        factors * angles[..., indices]``.

    Raises:
        BodyError: If a hinge has no counterpart with a reflected axis.
    """
    names = list(body.joint_names)
    indices, factors = np.empty(len(names), dtype=np.int64), np.empty(len(names))
    for place, hinge in enumerate(body.hinges):
        other = mirrored_name(hinge.name)
        if other not in names:
            raise BodyError(f"hinge {hinge.name!r} has no counterpart; valid: a body of two equal sides")
        indices[place] = names.index(other)
        # An axis of rotation keeps its y component under the reflection and changes the others' signs.
        along = float(-REFLECTION * body.hinges[indices[place]].axis @ hinge.axis)
        if abs(abs(along) - 1.0) > 1e-9:
            raise BodyError(f"axes of {hinge.name!r} and {other!r} are no reflections of each other")
        factors[place] = np.sign(along)
    return indices, factors


def mirrored(body: BodyModel, q: ArrayLike) -> FloatArray:
    """Postures reflected in the world's plane y = 0, for a body of two equal sides.

    Args:
        body: The body.
        q: (..., nq) postures.

    Returns:
        (..., nq).

    Raises:
        BodyError: If the shape does not fit or the body's sides differ.
    """
    posture = np.asarray(q, dtype=np.float64)
    if posture.ndim == 0 or posture.shape[-1] != body.nq:
        raise BodyError(f"posture has shape {posture.shape}; valid: (..., {body.nq})")
    indices, factors = mirrored_hinges(body)
    found = posture.copy()
    found[..., 1] *= -1.0
    found[..., [3, 5]] *= -1.0
    found[..., 7:] = factors * posture[..., 7:][..., indices]
    return found
