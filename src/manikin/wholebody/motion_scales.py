"""How much the residuals of every whole-body spline matter, and how long its fit iterates."""

from dataclasses import dataclass, replace
from typing import Self


@dataclass(frozen=True)
class MotionScales:
    """Size at which each residual costs one unit, and the iteration's limits.

    Attributes:
        position: Effector position [m].
        rotation: Effector orientation [rad].
        clearance: Missing clearance [m].
        safe_distance: Wanted clearance [m].
        softness: Width of the bend of the softened clearance penalty [m].
        joint_limit: Violation of a joint range, or of its buffer [rad].
        joint_buffer: Distance kept from the joint ranges [rad].
        joint_velocity: Violation of the velocity limits [rad/s].
        velocity_share: Share of the velocity limits that may be used.
        acceleration: Joint acceleration [rad/s^2].
        pelvis_acceleration: Linear [m/s^2] and angular [rad/s^2] pelvis acceleration.
        rest: Velocity at both ends [m/s, rad/s].
        max_iterations: Upper bound of Gauss-Newton steps.
        decrease: Relative decrease of the objective below which the iteration stops.
        stages: Factors by which the tasks' scales are loosened, one solution after the other.
        iterations_per_round: Steps between two updates of the multipliers.
        multiplier_rounds: Most updates of the multipliers of contacts and centre of mass.
        tolerance: Largest error of the contacts at convergence [m]; three times that for the
            centre of mass.
        turn_tolerance: Largest angle of a sole from its contact at convergence [rad].
    """

    position: float = 1.0e-3
    rotation: float = 4.0e-3
    clearance: float = 1.0e-3
    safe_distance: float = 0.028
    softness: float = 0.006
    joint_limit: float = 3.0e-3
    joint_buffer: float = 0.03
    joint_velocity: float = 0.1
    velocity_share: float = 0.9
    acceleration: float = 8.0
    pelvis_acceleration: float = 4.0
    rest: float = 1.0e-3
    max_iterations: int = 30
    decrease: float = 0.06
    stages: tuple[float, ...] = (3.0, 1.0, 0.3)
    iterations_per_round: int = 3
    multiplier_rounds: int = 12
    tolerance: float = 5.0e-4
    turn_tolerance: float = 3.5e-3

    def are_met(self, support_error: float, support_turn: float, com_error: float) -> bool:
        """Whether contacts and centre of mass are exact enough.

        Args:
            support_error: Of contacts [m].
            support_turn: Of soles [rad].
            com_error: Of the centre of mass [m].
        """
        return (
            support_error < self.tolerance
            and support_turn < self.turn_tolerance
            and com_error < 3.0 * self.tolerance
        )

    def loosened(self, factor: float) -> Self:
        """Return the same scales with contacts ``factor`` times looser."""
        return replace(self, position=self.position * factor, rotation=self.rotation * factor)
