"""Sections of a scenario or stance file: one contact."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from manikin.scenarios.validation import (
    Moves,
    NonNegative,
    Number,
    Positive,
    Section,
    Vector3,
    refuse,
    rule_error,
)

_KIND_KEYS: dict[str, tuple[str, ...]] = {
    "sole": ("normal", "sole", "friction", "normal_force_cap_N", "torsion_limit_Nm", "settle_s"),
    "point": ("normal", "friction", "normal_force_cap_N"),
    "grasp": ("max_force_N", "planning_max_force_N", "max_moment_Nm", "rpy_deg"),
}
"""Keys of a contact that only some kinds have."""


class SoleSection(Section):
    """A rectangular sole."""

    length_m: Positive = Field(description="along the toes' direction [m]")
    width_m: Positive = Field(description="across it [m]")


class ContactSection(Section):
    """One contact; what it leaves out comes from the section around it."""

    kind: Literal["sole", "point", "grasp"] | None = Field(
        default=None, description="default: sole for a foot, grasp for a hand"
    )
    position: Annotated[Vector3, Moves.POINT] = Field(
        description="of the contact (centre of a sole) in the world [m]"
    )
    yaw_deg: Annotated[Number, Moves.HEADING] = Field(
        default=0.0,
        description="heading of the toes, or of the axes of a point's friction, counter-clockwise from "
        "world x [deg]",
    )
    normal: Annotated[Vector3 | None, Moves.DIRECTION] = Field(
        default=None, description="surface normal, into the body (default up)"
    )
    rpy_deg: Annotated[Vector3 | None, Moves.ORIENTATION] = Field(
        default=None, description="orientation of a grasping hand [deg]"
    )
    sole: SoleSection | None = Field(default=None, description="size of this sole")
    friction: Positive | None = Field(default=None, description="Coulomb coefficient")
    normal_force_cap_N: Positive | None = Field(
        default=None, description="largest normal force of this contact [N]"
    )
    torsion_limit_Nm: Positive | None = Field(
        default=None, description="largest moment about the normal [N.m]"
    )
    settle_s: NonNegative | None = Field(
        default=None, description="time after the touch-down in which it may still slide to its place [s]"
    )
    max_force_N: Positive | None = Field(
        default=None,
        description="grasp: largest force along each axis of the world, in a scenario of the task frame [N]",
    )
    planning_max_force_N: Positive | None = Field(
        default=None, description="grasp: smaller limit that planning balances with (default: max_force_N)"
    )
    max_moment_Nm: NonNegative | None = Field(
        default=None, description="grasp: largest moment per axis [N.m]"
    )

    @field_validator("normal")
    @classmethod
    def _nonzero(cls, normal: Any) -> Any:
        if normal is not None and not any(normal):
            raise rule_error("a direction that is not zero")
        return normal

    def kind_for(self, effector: str) -> str:
        """Kind of the contact when ``effector`` makes it."""
        return self.kind or ("grasp" if "hand" in effector else "sole")

    def check_for(self, effector: str, path: str = "") -> None:
        """Refuse keys that the contact's kind does not have.

        Raises:
            PydanticCustomError: Naming the key under ``path``.
        """
        kind = self.kind_for(effector)
        for key in sorted({key for keys in _KIND_KEYS.values() for key in keys} - {*_KIND_KEYS[kind]}):
            if getattr(self, key) is not None:
                valid = ", ".join(("kind", "position", "yaw_deg", *_KIND_KEYS[kind]))
                raise refuse(f"{path}{key}", f"does not belong to a {kind}; valid: {valid}")
        if kind == "grasp" and self.max_force_N is None:
            raise refuse(f"{path}max_force_N", "is missing; valid: a number > 0 [N] for a grasp")
