"""Planes beyond which the CoM must not be at one key instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.spatial import FloatArray, finite_number, frozen_array


@dataclass(frozen=True, eq=False)
class KeyPlane:
    """The CoM behind a plane at one key instant: ``normal . p(T_key) <= offset``.

    At a key instant the CoM is the last Bezier point of a phase, an unknown of the programme:
    the constraint is linear and met exactly, and nothing is asked of the rest of the motion.
    It is ours; [Qiu2012]_ 7.2.3 only says that "some constraints" are modified.

    Attributes:
        key: Index of the key instant; 1 is the end of the first phase.
        normal: (3,) unit vector out of the permitted half-space.
        offset: Distance of the plane from the world origin along the normal [m].
    """

    key: int
    normal: FloatArray
    offset: float

    def __init__(self, key: int, normal: ArrayLike, offset: float) -> None:
        """Normalise the normal, and the offset with it.

        Raises:
            InputError: If the key is not at least 1, or the normal vanishes.
        """
        vector = frozen_array(normal, "key plane normal", (3,))
        length = float(np.linalg.norm(vector))
        if length < 1e-9:
            raise InputError(f"key plane normal is {vector.tolist()}; valid: not zero")
        if isinstance(key, bool) or not isinstance(key, (int, np.integer)) or key < 1:
            raise InputError(f"key plane is at key instant {key!r}; valid: an integer >= 1")
        object.__setattr__(self, "key", int(key))
        object.__setattr__(self, "normal", frozen_array(vector / length, "key plane normal", (3,)))
        object.__setattr__(self, "offset", finite_number(offset, "key plane offset [m]") / length)

    @classmethod
    def towards(cls, key: int, start: ArrayLike, goal: ArrayLike, beyond: float = 0.0) -> "KeyPlane":
        """The plane through ``goal`` that cuts off ``start``, moved on by ``beyond`` [m].

        Where ``goal`` is the nearest point of a convex set, it cuts off none of the set (but for
        what ``beyond`` takes).
        """
        from_here, to_there = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
        normal = from_here - to_there
        length = float(np.linalg.norm(normal))
        if length < 1e-9:
            raise InputError(f"key plane is through its start {from_here.tolist()}; valid: another goal")
        return cls(key, normal / length, float(normal @ to_there) / length - beyond)

    def violation(self, position: FloatArray) -> FloatArray:
        """(...) how far (..., 3) positions are beyond the plane [m]; negative is room."""
        return np.asarray(position @ self.normal - self.offset, dtype=np.float64)
