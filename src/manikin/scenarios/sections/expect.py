"""Section of a scenario file: how a run of it should end."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from manikin.scenarios.validation import Section, Text, refuse


class ExpectSection(Section):
    """Success, or a failure with the stage in which it is expected and its reason."""

    outcome: Literal["success", "failure"] = Field(description="how a run should end")
    stage: Literal["walk", "contacts", "centroidal", "wholebody", "execution", "push"] | None = Field(
        default=None, description="stage that should fail; a failure of another one is not as expected"
    )
    because: Text | None = Field(default=None, description="why it is expected to fail")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for key in ("stage", "because"):
            if self.outcome == "success" and getattr(self, key) is not None:
                raise refuse(key, "is given beside outcome: success; valid: beside outcome: failure")
        return self


def _mapping(value: Any) -> Any:
    return {"outcome": value} if isinstance(value, str) else value


Expectation = Annotated[
    ExpectSection,
    BeforeValidator(_mapping, json_schema_input_type=Literal["success", "failure"] | ExpectSection),
]
"""``success``, ``failure``, or a mapping with the outcome, the stage and the reason."""
