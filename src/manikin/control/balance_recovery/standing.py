"""A way to stand: which feet carry, where they are, and the posture to come back to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, sole
from manikin.control.balance_recovery.support_area import SupportArea
from manikin.errors import InputError
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Standing:
    """What the balance is kept about.

    Attributes:
        soles: The soles that carry; their effectors are the feet on the ground.
        area: Their hull, in which the ZMP may be.
        posture: (nv - 6,) joint angles to come back to [rad].
        com: (3,) centre of mass of that posture [m].
    """

    soles: tuple[Contact, ...]
    area: SupportArea
    posture: FloatArray
    com: FloatArray

    @classmethod
    def of(cls, body: BodyModel, q: ArrayLike, feet: Sequence[str], friction: float) -> "Standing":
        """Stand as in a posture.

        Args:
            body: The body.
            q: (nq,) the posture, the soles of the feet on one level plane.
            feet: Effectors of the feet that carry.
            friction: Of their soles.

        Raises:
            InputError: If no foot carries or the soles are not level.
        """
        if not feet:
            raise InputError("no foot is on the ground; valid: one foot or two")
        state = Configuration(body, np.array(q, dtype=np.float64))
        soles = tuple(sole_at(body, name, *state.effector_placement(name), friction) for name in feet)
        return cls(soles, SupportArea.of(soles), state.q[7:].copy(), state.com.copy())

    @property
    def feet(self) -> tuple[str, ...]:
        """Effectors of the feet that carry."""
        return tuple(contact.effector for contact in self.soles)

    @property
    def height(self) -> float:
        """Of the centre of mass above the ground [m]."""
        return float(self.com[2] - self.area.height)


def sole_at(
    body: BodyModel, effector: str, rotation: FloatArray, position: FloatArray, friction: float
) -> Contact:
    """Whole sole of a foot.

    Args:
        body: The body.
        effector: Of the foot.
        rotation: (3, 3) sole to world.
        position: (3,) middle of the sole [m].
        friction: Of the sole.
    """
    return sole(
        effector, position, rotation=rotation, length=float(body.sole_length or 0.0),
        width=float(body.sole_width or 0.0), friction=friction,
    )  # fmt: skip
