"""Scales of the residuals of a whole-body spline, planned or refined, and limits of its iteration."""

from dataclasses import dataclass, replace
from typing import Self

from manikin.body import BodyModel


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
        torque_share: Share of a joint's strength beyond ``strength_share``, where contact forces are held.
        strength_share: Share of the strength that may be used there; the rest is in reserve for control.
        acceleration: Joint acceleration [rad/s^2].
        pelvis_acceleration: Linear [m/s^2] and angular [rad/s^2] pelvis acceleration.
        rest: Velocity at both ends [m/s, rad/s].
        max_iterations: Upper bound of Gauss-Newton steps.
        decrease: Relative decrease of the objective below which the iteration stops.
        stages: Factors by which the tasks' scales are loosened, one solution after the other.
        constrained_steps: Upper bound of the steps that meet the contacts, after those.
        constrained_decrease: Relative decrease of the objective below which they stop.
        multiplier_rounds: Most updates of the multipliers of contacts and centre of mass in each of them.
        restoring_steps: Upper bound of the steps that only restore the contacts, after those.
        tolerance: Largest error of a constraint at convergence, in units of its own scale.
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
    torque_share: float = 0.01
    strength_share: float = 0.75
    acceleration: float = 24.0
    pelvis_acceleration: float = 4.0
    rest: float = 1.0e-3
    max_iterations: int = 30
    decrease: float = 0.06
    stages: tuple[float, ...] = (3.0, 1.0, 0.3)
    constrained_steps: int = 40
    constrained_decrease: float = 0.003
    multiplier_rounds: int = 20
    restoring_steps: int = 3
    tolerance: float = 0.1

    def loosened(self, factor: float) -> Self:
        """Return the same scales with contacts ``factor`` times looser."""
        return replace(self, position=self.position * factor, rotation=self.rotation * factor)


@dataclass(frozen=True)
class FitScales(MotionScales):
    """Size at which each residual of the whole-body fit along a planned centre of mass costs one unit.

    Attributes:
        com: Centre of mass [m].
        force: Rate of linear momentum, against the planned one [N].
        moment_share: Rate of angular momentum about the centre of mass that costs one unit, as
            a share of the planned margin: where balance is scarce, the body turns less.
    """

    com: float = 3.0e-3
    force: float = 20.0
    moment_share: float = 0.15

    def loosened(self, factor: float) -> Self:
        """Return the same scales with contacts and centre of mass ``factor`` times looser."""
        return replace(super().loosened(factor), com=self.com * factor)


@dataclass(frozen=True)
class RefineScales(MotionScales):
    """Size at which each residual of the refinement costs one unit.

    Attributes:
        missing_wrench: Wrench that no contact supplies, moments divided by :data:`ARM` [N].
        force: Contact force that costs one unit, relative to the body's weight, at a contact variable of 1.
        margin: Wanted margin of the wrench about the CoM [N.m].
        margin_violation: Missing margin [N.m].
        margin_softness: Width of the bend of its softened penalty [N.m].
        slide: Speed of an effector at a contact variable of 1 [m/s].
        approach: Distance to the normal through its contact at a contact variable of 1, in flight [m].
        efort: Square root of ``c / alpha`` (7.8).
        touching: Depth from which an effector is pushed out of what it leaves or reaches, at the ends of a
            flight [m].
        guide: Deviation of a joint from the input [rad].
        guide_position: Deviation of the pelvis from the input [m].
        knee_flexion: Least one that is wanted: a leg that is almost straight turns about its own axis in the
            execution at the slightest cause [rad].
        straight: What a knee lacks of it [rad].
        toes: Angle of the toes of what stands on soles [rad].
        end_position: Deviation of the pelvis from the input at both ends [m].
        end_angle: Deviation of a joint, or of the pelvis' attitude, there [rad].
    """

    stages: tuple[float, ...] = (3.0, 1.0)
    safe_distance: float = 0.02
    softness: float = 0.004
    acceleration: float = 6.0
    pelvis_acceleration: float = 3.0
    missing_wrench: float = 10.0
    force: float = 1.0
    margin: float = 22.0
    margin_violation: float = 1.0
    margin_softness: float = 3.0
    slide: float = 0.1
    approach: float = 0.02
    efort: float = 3.0
    touching: float = 8.0e-3
    guide: float = 0.4
    guide_position: float = 0.03
    knee_flexion: float = 0.35
    straight: float = 0.1
    toes: float = 0.02
    end_position: float = 0.01
    end_angle: float = 0.05

    @classmethod
    def of(cls, body: BodyModel) -> "RefineScales":
        """The scales for a body; a creature's are those of a person, brought to its size and mass.

        With lengths by ``l`` and masses by ``m``, at the same gravity, forces go by ``m``, moments by ``m l``
        and accelerations of the joints by ``1 / l``. Distances for safety shrink to a quarter at most.
        """
        plain = cls()
        if body.stature is not None:
            return plain
        # Height of the root [m] and mass [kg] of that person, and the least factor on distances for safety.
        length, force = float(body.standing_posture()[2]) / 0.92, body.mass / 75.0
        near = max(length, 0.25)
        return replace(
            plain,
            safe_distance=plain.safe_distance * near, softness=plain.softness * near,
            clearance=plain.clearance * near, touching=plain.touching * near, approach=plain.approach * near,
            acceleration=plain.acceleration / length, guide_position=plain.guide_position * near,
            missing_wrench=plain.missing_wrench * force, margin=plain.margin * force * length,
            margin_violation=plain.margin_violation * force * length,
            margin_softness=plain.margin_softness * force * length,
        )  # fmt: skip
