"""Section of a scenario file: whose motion it is."""

from typing import Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from manikin.scenarios.validation import Positive, Section, refuse

_HUMAN_KEYS = ("stature_m", "sex")


class BodySection(Section):
    """Whose motion it is."""

    model: Literal["human", "point_mass"] = Field(
        default="human",
        description="built-in body: a person, or a point mass on massless feet, planned but not executed",
    )
    stature_m: Positive = Field(default=1.75, description="standing height [m], of a human only")
    mass_kg: Positive = Field(default=79.0, description="body mass [kg]")
    sex: Literal["male", "female"] = Field(
        default="male", description="which anthropometric table, of a human only"
    )

    @model_validator(mode="after")
    def _only_of_a_human(self) -> Self:
        for key in _HUMAN_KEYS if self.model != "human" else ():
            if key in self.model_fields_set:
                raise refuse(key, "does not apply to a point mass; valid: model, mass_kg")
        return self

    @model_serializer(mode="wrap")
    def _without_what_does_not_apply(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data = write(self)
        return data if self.model == "human" else {k: v for k, v in data.items() if k not in _HUMAN_KEYS}
