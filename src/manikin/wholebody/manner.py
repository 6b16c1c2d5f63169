"""How a body carries itself where the task leaves freedom."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.posture import Preferences
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Manner:
    """Preferred posture and how firmly each joint keeps to it; all numbers are our choice.

    Attributes:
        name: Short name, as in a scenario.
        angles: Joint angles that differ from the standing posture, by a part of the joint's name [rad].
        scales: Deviation of a joint from its preferred angle that costs one unit, by a part of
            the joint's name [rad].
        trunk_scale: The same of the pelvis' orientation [rad].
        arm_swing: Flexion of a shoulder per metre that the other side's foot is ahead [rad/m].
        moment_factor: How much more angular momentum than usual the limbs may carry without the
            trunk or the arms making up for it (:attr:`FitScales.moment_share` times this).
        preferences: Of the guide postures.
    """

    name: str
    angles: Mapping[str, float]
    scales: Mapping[str, float]
    trunk_scale: float = 0.3
    arm_swing: float = 0.0
    moment_factor: float = 1.0
    preferences: Preferences = field(default_factory=Preferences)

    def posture(self, body: BodyModel) -> FloatArray:
        """(nq,) standing posture with the preferred angles."""
        q = np.array(body.standing_posture())
        for index, name in enumerate(body.joint_names):
            for key, angle in self.angles.items():
                if key in name:
                    q[7 + index] = angle
        return q

    def scale(self, body: BodyModel) -> FloatArray:
        """(nv,) deviations of the tangent that cost one unit [rad]; infinite for the pelvis' place."""
        scale = np.full(body.nv, np.inf)
        scale[3:6] = self.trunk_scale
        for index, name in enumerate(body.joint_names):
            scale[6 + index] = next((s for key, s in self.scales.items() if key in name), 0.5)
        return scale


READY = Manner(
    "ready",
    MappingProxyType({
        "shoulder_flexion": np.deg2rad(20.0),
        "shoulder_abduction": np.deg2rad(25.0),
        "elbow_flexion": np.deg2rad(60.0),
    }),
    MappingProxyType({
        "toe": 0.01, "hip": 1.0, "knee": 1.5, "ankle": 1.0, "lumbar": 0.35, "thorax": 0.35, "neck": 0.25,
        "shoulder": 0.35, "elbow": 0.35, "wrist": 0.1,
    }),
)  # fmt: skip
"""Arms of a person who steps over something: slightly raised and bent, clear of the thighs."""

WALKING = Manner(
    "walking",
    MappingProxyType({"shoulder_flexion": np.deg2rad(3.0), "elbow_flexion": np.deg2rad(22.0)}),
    MappingProxyType({
        "toe": 0.01, "hip": 1.0, "knee": 1.5, "ankle": 1.0, "lumbar": 0.12, "thorax": 0.12, "neck": 0.1,
        "shoulder": 0.12, "elbow": 0.15, "wrist": 0.1,
    }),
    trunk_scale=0.15,
    arm_swing=0.7,
    moment_factor=1.6,
    preferences=Preferences(
        hinges=MappingProxyType({"shoulder": 0.5, **Preferences().hinges}),
        pelvis=2.0, trunk=2.0, head=1.0, arms=0.0,
    ),
)  # fmt: skip
"""An upright trunk and hanging arms that swing against the legs."""

CLOSE = Manner(
    "close",
    MappingProxyType(
        {
            "shoulder_flexion": np.deg2rad(25.0),
            "shoulder_abduction": np.deg2rad(15.0),
            "elbow_flexion": np.deg2rad(80.0),
        }
    ),
    MappingProxyType({**READY.scales, "shoulder": 0.15, "elbow": 0.2}),
    preferences=Preferences(
        hinges=MappingProxyType({"shoulder": 0.5, "elbow": 0.3, **Preferences().hinges}), arms=0.3
    ),
)
"""Arms kept close to the body, as in a narrow place."""

CLIMBING = Manner(
    "climbing",
    MappingProxyType(
        {
            "shoulder_flexion": np.deg2rad(115.0),
            "shoulder_abduction": np.deg2rad(20.0),
            "elbow_flexion": np.deg2rad(70.0),
            "hip_flexion": np.deg2rad(45.0),
            "hip_abduction": np.deg2rad(25.0),
            "hip_rotation": np.deg2rad(-20.0),
            "knee_flexion": np.deg2rad(65.0),
        }
    ),
    MappingProxyType({**READY.scales, "shoulder": 1.0, "elbow": 1.0, "wrist": 0.5}),
    preferences=Preferences(arms=0.0, grasp=0.0),
)  # fmt: skip
"""Raised arms and bent, spread legs of a person on a wall."""

HANGING = Manner(
    "hanging",
    MappingProxyType(
        {
            "shoulder_flexion": np.deg2rad(5.0),
            "shoulder_abduction": np.deg2rad(12.0),
            "elbow_flexion": np.deg2rad(25.0),
        }
    ),
    CLOSE.scales,
    preferences=CLOSE.preferences,
)
"""Arms that hang, as of a person who comes near to something."""

MANNERS: Mapping[str, Manner] = MappingProxyType(
    {manner.name: manner for manner in (READY, WALKING, CLOSE, HANGING, CLIMBING)}
)
"""Every manner by its name."""


def manner_of(name: str) -> Manner:
    """Return the manner of a name.

    Raises:
        InputError: If there is none.
    """
    if name not in MANNERS:
        raise InputError(f"manner is {name!r}; valid: {', '.join(MANNERS)}")
    return MANNERS[name]
