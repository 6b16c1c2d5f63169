"""How the physics engine is set up.

Also here. MuJoCo without its log file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import mujoco

from manikin.errors import InputError
from manikin.numerics.spatial import finite_number


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Context in which a simulation that diverges leaves no ``MUJOCO_LOG.TXT`` in the working directory.

    :attr:`manikin.simulation.world.World.divergence` says the same.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_nobody)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _nobody(_message: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class PhysicsOptions:
    """Settings of the compiled physics model.

    Attributes:
        timestep: [s]; 1 ms as in [Qiu2012]_ 6.1.
        friction: Coulomb coefficient between the body and the scene and of the body with itself.
        segment_friction: Pairs of a segment and the coefficient that holds instead between it and
            whatever it touches; such a segment is soft, see ``soft_time_constant``.
        cone: Shape of the friction cones.
        impratio: Stiffness of friction relative to the normal direction; above 1 holds feet
            still under sideways load.
        contact_time_constant: How fast a contact pushes penetration out [s]; at least two
            time steps.
        soft_time_constant: The same for segments with their own friction: flesh on a cushion [s].
        contact_damping_ratio: 1 is critically damped.
        joint_damping: Passive torque per speed on each hinge [N.m.s/rad].
        armature: Inertia added to each hinge's own axis [kg.m^2]; 0 keeps the mass matrix that
            of the planning model.
        joint_limits: Whether hinges stop at the ends of their ranges.
        self_collision: Whether the body's own :attr:`~manikin.body.BodyModel.collision_pairs`
            may touch.
    """

    timestep: float = 1e-3
    friction: float = 0.7
    segment_friction: tuple[tuple[str, float], ...] = ()
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    impratio: float = 10.0
    contact_time_constant: float = 5e-3
    soft_time_constant: float = 0.012
    contact_damping_ratio: float = 1.0
    joint_damping: float = 0.0
    armature: float = 0.0
    joint_limits: bool = True
    self_collision: bool = True

    def __post_init__(self) -> None:
        positive = (
            "timestep",
            "friction",
            "impratio",
            "contact_time_constant",
            "soft_time_constant",
            "contact_damping_ratio",
        )
        for name in positive:
            finite_number(getattr(self, name), f"physics {name}", above=0.0, error=InputError)
        for segment, value in self.segment_friction:
            finite_number(value, f"physics friction of {segment}", above=0.0, error=InputError)
        for name in ("joint_damping", "armature"):
            finite_number(getattr(self, name), f"physics {name}", at_least=0.0, error=InputError)
        if self.cone not in ("elliptic", "pyramidal"):
            raise InputError(f"physics cone is {self.cone!r}; valid: elliptic, pyramidal")
