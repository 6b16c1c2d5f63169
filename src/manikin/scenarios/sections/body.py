"""Section of a scenario file: whose motion it is."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from manikin.body.strength import AGE_RANGE, DEFAULT_AGE
from manikin.scenarios.sections.contact import SoleSection
from manikin.scenarios.validation import Number, Positive, Section, Text, Vector3, refuse

_KEYS = {
    "human": ("stature_m", "mass_kg", "sex", "age", "strength", "load", "further_contacts"),
    "point_mass": ("mass_kg",),
    "kudoh": ("load",),
    "insect": ("length_m", "mass_kg"),
    "urdf": ("urdf", "limbs", "standing_deg", "sole"),
}
"""What each kind of body may be given."""

WORDS = {
    "human": "a human",
    "point_mass": "a point mass",
    "kudoh": "the body of Kudoh, who has his own size",
    "insect": "an insect",
    "urdf": "a creature from URDF",
}
"""Kinds of bodies in words."""

_INSECT_KG = 2.0


class LimbSection(Section):
    """A limb of a creature: where it ends and how it touches."""

    tip: Text = Field(description="link that touches")
    root: Text | None = Field(
        default=None, description="first link of the limb (default: the one that the root carries)"
    )
    contact: Literal["point", "sole", "grasp"] = Field(default="point", description="how it touches")
    position: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="where it touches, in the frame of the tip [m]"
    )
    normal: Vector3 | None = Field(
        default=None, description="normal of the contact, into the body, in the frame of the tip (default: "
        "straight up in the standing posture)"
    )  # fmt: skip


class LoadSection(Section):
    """What the hands carry during the whole motion."""

    mass_kg: Positive = Field(description="mass of the load [kg], a point at the middle of the palms")
    hand: Literal["left", "right", "both"] = Field(
        default="both", description="which hand carries it; both carry half each"
    )


class BodySection(Section):
    """Whose motion it is."""

    model: Literal["human", "kudoh", "point_mass", "insect", "urdf"] = Field(
        default="human",
        description="built-in body: a person; kudoh, the 15 segments of Kudoh (2002), 1.72 m and 70 kg; "
        "a point mass on massless feet, planned but not executed; an insect; or urdf, which goes without "
        "saying beside that key, for a creature from a file",
    )
    stature_m: Positive = Field(default=1.75, description="standing height [m], of a human only")
    mass_kg: Positive = Field(
        default=79.0, description="body mass [kg] (an insect's default: 2); a creature has its file's own"
    )
    sex: Literal["male", "female"] = Field(
        default="male", description="which anthropometric table, of a human only"
    )
    age: Annotated[Number, Field(ge=AGE_RANGE[0], le=AGE_RANGE[1])] = Field(
        default=DEFAULT_AGE,
        description="age [years], of a human only; its strength depends on it, nothing else",
    )
    strength: Positive = Field(
        default=1.0,
        description="torque limits relative to a healthy adult of that sex, size and age, of a human only",
    )
    load: LoadSection | None = Field(
        default=None, description="load in the hands during the whole motion, of a human or kudoh"
    )
    further_contacts: list[Literal["knees", "elbows", "pelvis"]] | None = Field(
        default=None,
        description="what of a human may touch beside hands and feet, as limbs left_knee, right_knee, "
        "left_elbow, right_elbow, pelvis",
    )
    length_m: Positive = Field(default=0.4, description="length of the trunk [m], of an insect only")
    urdf: Text | None = Field(
        default=None, description="robot description of a creature, relative to this file's folder"
    )
    limbs: dict[str, LimbSection] | None = Field(default=None, description="limbs of a creature, by name")
    standing_deg: dict[str, Number] | None = Field(
        default=None, description="joint angles of a creature's standing posture [deg]"
    )
    sole: SoleSection | None = Field(default=None, description="size of a creature's soles")

    @model_validator(mode="before")
    @classmethod
    def _implied(cls, data: Any) -> Any:
        """A file of a creature says which model it is; an insect does not weigh what a person does."""
        if not isinstance(data, Mapping):
            return data
        if "urdf" in data and "model" not in data:
            return {**data, "model": "urdf"}
        return {"mass_kg": _INSECT_KG, **data} if data.get("model") == "insect" else data

    @model_validator(mode="after")
    def _only_what_applies(self) -> Self:
        valid = _KEYS[self.model]
        for key in self.model_fields_set - {"model"}:
            if key not in valid and getattr(self, key) is not None:
                keys = ", ".join(("model", *valid))
                raise refuse(key, f"does not apply to {WORDS[self.model]}; valid: {keys}")
        if self.model == "urdf":
            for key in ("urdf", "limbs"):
                if not getattr(self, key):
                    raise refuse(key, "is missing; valid: urdf: FILE and limbs: {NAME: {tip: LINK}}")
        return self

    @model_serializer(mode="wrap")
    def _without_what_does_not_apply(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        kept = ("model", *_KEYS[self.model])
        return {key: value for key, value in write(self).items() if key in kept}
