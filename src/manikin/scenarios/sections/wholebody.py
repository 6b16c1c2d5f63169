"""Section of a scenario file: how the whole body's motion is found."""

from typing import Annotated, Literal

from pydantic import Field

from manikin.scenarios.validation import Positive, Section


class WholebodySection(Section):
    """How the whole body's motion is found."""

    method: Literal["follow", "refine"] = Field(
        default="follow",
        description="follow: contacts, swings and a planned centre of mass; refine: smooth the postures at "
        "the changes of contact into a motion that keeps to physics, with no centre of mass prescribed",
    )
    pace: Positive = Field(
        default=1.0,
        description="refine: speed relative to that of the contact plan, or of the planned centre of mass; "
        "below 1 every phase lasts longer",
    )
    speed_share: Annotated[float, Field(strict=True, gt=0.0, le=1.0)] | None = Field(
        default=None,
        description="refine: share of the joints' velocity limits up to which phases are shortened, as far "
        "as balance, clearance and strength allow (default: phases last as long as they are given)",
    )
    contact_variables: Annotated[bool, Field(strict=True)] = Field(
        default=True,
        description="refine: whether contacts are let go that the motion does not need and that are not "
        "made, else all of the sequence are held",
    )
