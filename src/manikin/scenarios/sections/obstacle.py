"""Sections of a scenario file: the things in the scene."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from manikin.scenarios.validation import Moves, Positive, Section, Size3, Text, Vector3, refuse

OBSTACLE_SHAPES = ("box", "cylinder", "capsule", "sphere", "plane", "half_space", "mesh")


class RoundSection(Section):
    """A cylinder or capsule along its z axis."""

    radius_m: Positive = Field(description="radius [m]")
    length_m: Positive = Field(description="length [m]; of a capsule, without its round ends")


class SphereSection(Section):
    """A sphere."""

    radius_m: Positive = Field(description="radius [m]")


class ObstacleSection(Section):
    """One thing in the scene: a name, one shape and a pose."""

    name: Text = Field(description="unique name")
    box: Size3 | None = Field(default=None, description="sizes along x, y, z [m]")
    cylinder: RoundSection | None = Field(default=None, description="cylinder along z")
    capsule: RoundSection | None = Field(default=None, description="capsule along z")
    sphere: SphereSection | None = Field(default=None, description="sphere")
    plane: Vector3 | None = Field(
        default=None, description="normal of an infinite two-sided plane through position, turned by rpy_deg"
    )
    half_space: Vector3 | None = Field(
        default=None, description="outward normal of a solid half-space at position, turned by rpy_deg"
    )
    mesh: Text | None = Field(
        default=None, description="STL, OBJ, PLY or DAE file, relative to this file's folder"
    )
    scale: Positive | None = Field(default=None, description="factor on the mesh's coordinates (default 1)")
    unit: Literal["m", "cm", "mm", "in"] | None = Field(
        default=None, description="unit of the mesh (default: a DAE file's own, else m)"
    )
    convex: Literal["no", "hull", "parts"] | None = Field(
        default=None, description="replace the mesh, or each connected part, by its convex hull"
    )
    padded: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="whether any part of the body may lean on it, as on a seat"
    )
    position: Annotated[Vector3, Moves.POINT] = Field(
        default=(0.0, 0.0, 0.0), description="origin in the world [m]"
    )
    rpy_deg: Annotated[Vector3, Moves.ORIENTATION] = Field(
        default=(0.0, 0.0, 0.0), description="fixed-axis roll, pitch, yaw [deg]"
    )

    @property
    def shape(self) -> str:
        """Key of the shape that is given."""
        return next(name for name in OBSTACLE_SHAPES if getattr(self, name) is not None)

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        given = [name for name in OBSTACLE_SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            found = f"has {' and '.join(given)}" if given else "has no shape"
            raise refuse("", f"{found}; valid: exactly one of {', '.join(OBSTACLE_SHAPES)}")
        for key in ("scale", "unit", "convex"):
            if getattr(self, key) is not None and given[0] != "mesh":
                raise refuse(key, f"is given for a {given[0]}; valid: only with mesh")
        for key in ("plane", "half_space"):
            normal = getattr(self, key)
            if normal is not None and not any(normal):
                raise refuse(key, f"is {list(normal)}; valid: a normal that is not zero")
        return self
