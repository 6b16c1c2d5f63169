"""What a plan does not know of the world: stated uncertainties, and worlds drawn from them."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.control import StateNoise
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.scene import Obstacle, Scene
from manikin.scene.scene import FLOOR
from manikin.simulation.push_force import Push, push_on_the_way

PUSHED_MASS = 75.0
"""Mass up to which the push by default is in proportion to a creature's [kg]."""


@dataclass(frozen=True, eq=False)
class TrueWorld:
    """The world in which a plan is executed, where it is not the one that was planned in.

    Attributes:
        body: With its true masses.
        scene: With its obstacles at their true heights.
        friction: True friction relative to the believed one.
        delay: From a torque's command until it acts [s].
        noise: Of the state that control is told.
        torque_noise: Standard deviation of the joint torques that it feels, relative to the strength.
        joints: (nv - 6,) by how much the first hinge angles differ from the plan's [rad].
        pushes: Forces that disturb the body.
        seed: Of the noise.
    """

    body: BodyModel
    scene: Scene
    friction: float
    delay: float
    noise: StateNoise
    torque_noise: float
    joints: FloatArray
    pushes: tuple[Push, ...]
    seed: int


@dataclass(frozen=True)
class Uncertainty:
    """How far a true world may be from the believed one.

    Attributes:
        mass_share: Largest deviation of each segment's mass, relative to it.
        com_m: Largest deviation of the centre of mass along each axis, standing [m].
        friction_share: Largest share of the friction that is missing.
        height_m: Largest deviation of each obstacle's height [m].
        delay_s: Longest delay of the torques [s].
        angle_noise_deg: Standard deviation of the angles that control is told [deg].
        position_noise_m: The same of the root's position [m].
        velocity_noise_m_s: The same of its velocity [m/s].
        torque_noise_share: Standard deviation of the joint torques that control feels, relative to the
            strength.
        joints_deg: Largest error of each hinge at the beginning [deg].
        push_N: Force of a push on the thorax, or on the root of a body without one, in any level direction
            at any time [N].
        push_s: How long it lasts [s].
    """

    mass_share: float = 0.05
    com_m: float = 0.01
    friction_share: float = 0.2
    height_m: float = 0.005
    delay_s: float = 0.015
    angle_noise_deg: float = 0.1
    position_noise_m: float = 0.001
    velocity_noise_m_s: float = 0.005
    torque_noise_share: float = 0.01
    joints_deg: float = 1.0
    push_N: float = 50.0
    push_s: float = 0.1

    def __post_init__(self) -> None:
        for item in fields(self):
            finite_number(getattr(self, item.name), f"uncertainty {item.name}", at_least=0.0)
        for name in ("mass_share", "friction_share"):
            finite_number(getattr(self, name), f"uncertainty {name}", at_most=0.9)

    @classmethod
    def of(cls, body: BodyModel) -> "Uncertainty":
        """The defaults; creatures lighter than people are pushed in proportion to their mass."""
        default = cls()
        share = min(1.0, body.mass / PUSHED_MASS) if body.stature is None else 1.0
        return replace(default, push_N=share * default.push_N)

    @property
    def noise(self) -> StateNoise:
        """Noise of the state that control is told."""
        angle = float(np.deg2rad(self.angle_noise_deg))
        return StateNoise(angle, self.position_noise_m, self.velocity_noise_m_s)

    def scaled(self, factor: float) -> "Uncertainty":
        """All of them by a factor, but for how long a push lasts."""
        larger = {item.name: factor * getattr(self, item.name) for item in fields(self)}
        return Uncertainty(**larger | {"push_s": self.push_s})

    def draw(self, body: BodyModel, scene: Scene, motion: Motion, seed: int) -> TrueWorld:
        """A world for the execution of a motion; the same for the same seed."""
        rng = np.random.default_rng(seed)
        rub, delay = 1.0 - self.friction_share * rng.uniform(), self.delay_s * rng.uniform()
        joints = np.deg2rad(self.joints_deg) * rng.uniform(-1.0, 1.0, body.nv - 6)
        latest = max(float(motion.duration) - self.push_s, 0.0)
        way, start = rng.uniform(-180.0, 180.0), float(motion.time[0]) + latest * rng.uniform()
        pushed = self.push_N > 0.0 and self.push_s > 0.0
        push = push_on_the_way(motion, self.push_N, way, start, self.push_s)
        names = [segment.name for segment in body.segments]
        if push.segment not in names:  # a creature is pushed on its root
            push = replace(push, segment=names[0])
        pushes = (push,) if pushed else ()
        true, raised = self._weighed(body, rng), self._raised(scene, rng)
        return TrueWorld(true, raised, rub, delay, self.noise, self.torque_noise_share, joints, pushes, seed)

    def _weighed(self, body: BodyModel, rng: np.random.Generator) -> BodyModel:
        """The body with other masses, and its centre of mass elsewhere."""
        model: pin.Model = body.pinocchio
        data = model.createData()
        pin.framesForwardKinematics(model, data, body.standing_posture())
        away = self.com_m * rng.uniform(-1.0, 1.0, 3)
        shares = 1.0 + self.mass_share * rng.uniform(-1.0, 1.0, len(body.segments))
        segments = [
            replace(
                segment, mass=share * segment.mass, inertia=share * segment.inertia,
                com=segment.com + data.oMf[body.segment_frame(segment.name)].rotation.T @ away,
            ) for segment, share in zip(body.segments, shares.tolist(), strict=True)
        ]  # fmt: skip
        return replace(body, segments=tuple(segments), nominal_mass=sum(item.mass for item in segments))

    def _raised(self, scene: Scene, rng: np.random.Generator) -> Scene:
        """The scene with its obstacles higher or lower."""
        others = [item for item in scene if item.name != FLOOR]
        shifts = np.zeros((len(others), 3))
        shifts[:, 2] = self.height_m * rng.uniform(-1.0, 1.0, len(others))
        raised = [
            Obstacle(item.name, item.shape, item.rotation, item.translation + shift)
            for item, shift in zip(others, shifts, strict=True)
        ]
        return Scene(raised, scene.floor_height)
