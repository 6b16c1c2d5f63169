"""Contact model: what every contact of a stance may carry, as one value that travels with the stance."""

from dataclasses import dataclass
from typing import Literal, get_args

from manikin.errors import ContactError
from manikin.spatial import GRAVITY, finite_number

FrictionModel = Literal["outer", "inner", "cone"]
"""Pyramid that stands for the circular friction cone.

- ``outer``: four sides that touch the cone from outside ([Qiu2012]_ 4.18-4.19). It bounds each
  tangential component by ``mu f_n``, and holds tangential forces of up to ``sqrt(2) mu f_n``.
- ``inner``: four sides with the edges on the cone (``mu / sqrt(2)`` along each axis); forces are
  inside the cone. It loses up to 29.3 % of the friction.
- ``cone``: eight sides with the edges on the cone; forces are inside the cone. It loses up to 7.6 %
  (``1 - cos(pi / 8)``) of the friction, nothing along the contact's x and y axes.
"""

FRICTION_MODELS: tuple[FrictionModel, ...] = get_args(FrictionModel)
"""Names of the friction models."""

BODY_WEIGHTS_CAP = 3.0
"""Cap on the sum of normal forces of a stance where nothing else is given [body weights]."""


def default_normal_force_cap(mass: float) -> float:
    """Cap on the sum of normal forces of a body where nothing else is given [N].

    Args:
        mass: Of the body [kg].
    """
    return BODY_WEIGHTS_CAP * mass * GRAVITY


def friction_model(value: object) -> FrictionModel:
    """Check the name of a friction model; ``pyramid``, the older word for ``outer``, is accepted.

    Raises:
        ContactError: If there is no such model.
    """
    for name in FRICTION_MODELS:
        if value == name or (value == "pyramid" and name == "outer"):
            return name
    raise ContactError(f"friction_model is {value!r}; valid: {', '.join(map(repr, FRICTION_MODELS))}")


@dataclass(frozen=True)
class ContactModel:
    """How the contacts of a stance carry: the friction cone and the cap that they share.

    What differs between the contacts is with each :class:`~manikin.contact.Contact`: its coefficient of
    friction, its own normal-force cap, its torsion limit, and the force and moment limits of a grasp.

    Attributes:
        friction: Friction model.
        normal_force_cap: Largest sum of the normal forces of all soles and points [N];
            closes the wrench polytope ([Qiu2012]_ 4.26, summed along the normals so
            that walls are bounded too). None leaves it to the contacts' own caps.
    """

    friction: FrictionModel = "outer"
    normal_force_cap: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", friction_model(self.friction))
        if self.normal_force_cap is not None:
            cap = finite_number(
                self.normal_force_cap, "stance normal_force_cap [N]", above=0.0, error=ContactError
            )
            object.__setattr__(self, "normal_force_cap", cap)

    @classmethod
    def of_body(cls, mass: float, friction: FrictionModel = "outer") -> "ContactModel":
        """Model with the default cap of a body.

        Args:
            mass: Of the body [kg].
            friction: Friction model.
        """
        return cls(friction, default_normal_force_cap(mass))
