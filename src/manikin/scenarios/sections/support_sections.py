"""Sections of a scenario or stance file about contacts and the sequence of supports."""

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from manikin.scenarios.validation import (
    Duration,
    FrameMoves,
    NonNegative,
    Number,
    Positive,
    Section,
    Vector3,
    optional,
    preset,
    refuse,
    refuse_if,
    required,
    rule_error,
)

_POINT_KEYS = ("normal", "friction", "normal_force_cap_N")

_KIND_KEYS: dict[str, tuple[str, ...]] = {
    "sole": (*_POINT_KEYS, "sole", "polygon", "torsion_limit_Nm", "settle_s", "edge_radius_m"),
    "point": _POINT_KEYS,
    "grasp": ("max_force_N", "planning_max_force_N", "max_moment_Nm", "rpy_deg"),
}
"""Keys of a contact that only some kinds have."""


class SoleSection(Section):
    """A rectangular sole."""

    length_m: Positive = required("along the toes' direction [m]")
    width_m: Positive = required("across it [m]")


SOLE = SoleSection(length_m=0.28, width_m=0.12)
"""Sole where a file gives none."""


class ContactSection(Section):
    """One contact; what it leaves out comes from the section around it."""

    kind: Literal["sole", "point", "grasp"] | None = optional(
        "default: sole for a foot, grasp for a hand, point for a wrist or a knee"
    )
    position: Annotated[Vector3, FrameMoves.POINT] = required(
        "of the contact (centre of a sole) in the world [m]"
    )
    yaw_deg: Annotated[Number, FrameMoves.HEADING] = preset(
        0.0, "heading of the toes, or of the axes of a point's friction, counter-clockwise from world x [deg]"
    )
    normal: Annotated[Vector3 | None, FrameMoves.DIRECTION] = optional(
        "surface normal, into the body (default up)"
    )
    rpy_deg: Annotated[Vector3 | None, FrameMoves.ORIENTATION] = optional(
        "orientation of a grasping hand [deg]"
    )
    sole: SoleSection | None = optional("size of this sole")
    polygon: Annotated[list[tuple[Number, Number]], Field(min_length=3, max_length=8)] | None = optional(
        "corners (x, y) of what of the sole touches where it hangs over an edge, convex, from its centre "
        "along the toes' direction and to the left [m] (default: all of it)"
    )
    friction: Positive | None = optional("Coulomb coefficient")
    normal_force_cap_N: Positive | None = optional("largest normal force of this contact [N]")
    torsion_limit_Nm: Positive | None = optional("largest moment about the normal [N.m]")
    settle_s: NonNegative | None = optional(
        "time after the touch-down in which it may still slide to its place [s]"
    )
    edge_radius_m: Positive | None = optional(
        "radius of the front edge of the sole, on which it rolls (default: it lies flat) [m]"
    )
    max_force_N: Positive | None = optional(
        "grasp: largest force along each axis of the world, in a scenario of the task frame [N]"
    )
    planning_max_force_N: Positive | None = optional(
        "grasp: smaller limit that planning balances with (default: max_force_N)"
    )
    max_moment_Nm: NonNegative | None = optional("grasp: largest moment per axis [N.m]")

    @field_validator("normal")
    @classmethod
    def _nonzero(cls, normal: Any) -> Any:
        if normal is not None and not any(normal):
            raise rule_error("a direction that is not zero")
        return normal

    def kind_for(self, effector: str) -> str:
        """Kind of the contact when ``effector`` makes it."""
        usual = {"hand": "grasp", "wrist": "point", "knee": "point"}
        return self.kind or usual.get(effector.rpartition("_")[2], "sole")

    def check_for(self, effector: str, path: str = "") -> None:
        """Refuse keys that the contact's kind does not have, by their names under ``path``."""
        kind = self.kind_for(effector)
        for key in sorted({key for keys in _KIND_KEYS.values() for key in keys} - {*_KIND_KEYS[kind]}):
            if getattr(self, key) is not None:
                valid = ", ".join(("kind", "position", "yaw_deg", *_KIND_KEYS[kind]))
                raise refuse(f"{path}{key}", f"does not belong to a {kind}; valid: {valid}")
        if kind == "grasp" and self.max_force_N is None:
            raise refuse(f"{path}max_force_N", "is missing; valid: a number > 0 [N] for a grasp")


EFFECTORS = (
    "left_foot", "right_foot", "left_hand", "right_hand", "left_wrist", "right_wrist", "left_knee",
    "right_knee", "buttocks",
)  # fmt: skip
"""Effectors of a human that a phase may put in contact, in the order of the contact tables."""

MASSLESS_FEET = ("left_front_foot", "right_front_foot", "left_hind_foot", "right_hind_foot")
"""Feet that only a point mass has, besides those of a human."""


def contact_tag(value: Any) -> str:
    """Which of both an entry for an effector is: ``"same"`` or ``"contact"``."""
    return "same" if isinstance(value, str) else "contact"


ContactEntry = Annotated[
    Annotated[Literal["same"], Tag("same")] | Annotated[ContactSection, Tag("contact")],
    Discriminator(contact_tag),
]
"""A contact, or the word ``same`` for the one of the phase before."""

_MASSLESS = "contact of that foot of a point mass, or 'same'"


class CeilingSection(Section):
    """A plane that the centre of mass stays below."""

    position: Annotated[Vector3, FrameMoves.POINT] = required("of a point of the plane [m]")
    normal: Annotated[Vector3, FrameMoves.DIRECTION] = required("upward normal of the plane")

    @model_validator(mode="after")
    def _check(self) -> Self:
        refuse_if(self.normal[2] <= 0.0, "normal", f"is {list(self.normal)}; valid: one that points upwards")
        return self


class PhaseSection(Section):
    """The contacts of one phase and how long it may last; an effector left out is in the air."""

    left_foot: ContactEntry | None = optional("contact of the left foot, or 'same'")
    right_foot: ContactEntry | None = optional("contact of the right foot, or 'same'")
    left_hand: ContactEntry | None = optional("contact of the left hand, or 'same'")
    right_hand: ContactEntry | None = optional("contact of the right hand, or 'same'")
    left_wrist: ContactEntry | None = optional("contact of the heel of the left hand, or 'same'")
    right_wrist: ContactEntry | None = optional("contact of the heel of the right hand, or 'same'")
    left_knee: ContactEntry | None = optional("contact of the left knee, or 'same'")
    right_knee: ContactEntry | None = optional("contact of the right knee, or 'same'")
    left_front_foot: ContactEntry | None = optional(_MASSLESS)
    right_front_foot: ContactEntry | None = optional(_MASSLESS)
    left_hind_foot: ContactEntry | None = optional(_MASSLESS)
    right_hind_foot: ContactEntry | None = optional(_MASSLESS)
    buttocks: ContactEntry | None = optional("contact with a seat, or 'same'")
    min_duration_s: Duration = preset(0.1, "shortest duration [s]")
    max_duration_s: Duration | None = optional("longest duration [s]")
    com_near: Annotated[Vector3 | None, FrameMoves.POINT] = optional(
        "where the centre of mass should be when the phase begins [m]"
    )
    com_within_m: Vector3 = preset(
        (0.05, 0.05, 0.05),
        "how far it may be from there along x, y and z of the task frame, x being the heading "
        "at the start [m]",
    )
    com_lead_s: NonNegative = preset(
        0.0, "time after which it would still be as near if it went on at the velocity that it has then [s]"
    )
    com_below: CeilingSection | None = optional(
        "plane below which the centre of mass stays in this phase; where one is given, overhead obstacles "
        "bound it by nothing else"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        least, longest, room = self.min_duration_s, self.max_duration_s, list(self.com_within_m)
        if longest is not None and longest < least:
            problem = f"is {longest:g}; valid: at least min_duration_s = {least:g}"
            raise refuse("max_duration_s", problem)
        refuse_if(min(room) <= 0.0, "com_within_m", f"is {room}; valid: three numbers > 0 [m]")
        refuse_if(not self.entries(), "", f"has no contact; valid: at least one of {', '.join(EFFECTORS)}")
        for effector, entry in self.entries().items():
            if not isinstance(entry, str):
                entry.check_for(effector, f"{effector}.")
        return self

    def entries(self) -> dict[str, "ContactSection | Literal['same']"]:
        """Contacts by effector, those in the air left out."""
        result = {name: getattr(self, name) for name in (*EFFECTORS, *MASSLESS_FEET)}
        return {name: entry for name, entry in result.items() if entry is not None}


class SupportsSection(Section):
    """An explicit sequence of supports, with the defaults of its contacts."""

    friction: Positive = preset(0.7, "Coulomb coefficient of soles and points")
    sole: SoleSection = preset(SOLE, "size of the real soles")
    planning_sole: SoleSection | None = optional(
        "smaller soles that planning balances on, for robustness (default: the real ones)"
    )
    foot: Literal["flat", "rolling"] | None = optional(
        "whether a foot lands and leaves with its whole sole, or lands on its heel and leaves from its toes "
        "while another foot stands (default: flat, and rolling where a person cannot follow the plan so)"
    )
    planning_friction: Positive | None = optional(
        "smaller friction that planning balances with (default: the real one)"
    )
    normal_force_cap_N: Positive | None = optional(
        "largest sum of the normal forces of a stance [N] (default: 3 body weights)"
    )
    contact_normal_force_cap_N: Positive | None = optional(
        "largest normal force of each sole or point that gives none itself [N]"
    )
    planning_normal_force_cap_N: Positive | None = optional(
        "smaller cap that planning balances with (default: the real one)"
    )
    phases: Annotated[list[PhaseSection], Field(min_length=1)] = required("phases in order")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.planning_sole is not None:
            for key in ("length_m", "width_m"):
                ours, real = getattr(self.planning_sole, key), getattr(self.sole, key)
                problem = f"is {ours:g}; valid: at most sole.{key} = {real:g}"
                refuse_if(ours > real, f"planning_sole.{key}", problem)
        for real in ("friction", "normal_force_cap_N"):
            ours, limit = getattr(self, f"planning_{real}"), getattr(self, real)
            if ours is not None and limit is not None and ours > limit:
                raise refuse(f"planning_{real}", f"is {ours:g}; valid: at most {real} = {limit:g}")
        problem = "is given; valid: task.start.com says where the motion begins"
        refuse_if(self.phases[0].com_near is not None, "phases[0].com_near", problem)
        problem = "is 'same' but the phase before has no such contact; valid: a contact with a position"
        for number, phase in enumerate(self.phases):
            before = self.phases[number - 1].entries() if number else {}
            for effector, entry in phase.entries().items():
                missing = entry == "same" and effector not in before
                refuse_if(missing, f"phases[{number}].{effector}", problem)
        return self

    def resolved_phases(self) -> list[dict[str, ContactSection]]:
        """Contacts of each phase with every ``same`` replaced by what it stands for."""
        phases: list[dict[str, ContactSection]] = []
        for phase in self.phases:
            given = phase.entries().items()
            phases.append({name: phases[-1][name] if isinstance(e, str) else e for name, e in given})
        return phases
