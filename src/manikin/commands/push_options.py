"""What is pushed and how, as the options of ``manikin push`` say it, turned into a scenario."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from manikin.errors import InputError

if TYPE_CHECKING:
    from manikin.scenarios import Scenario

_OPTIONS: dict[tuple[str | int, ...], str] = {
    ("push", "direction_deg"): "--direction",
    ("push", "duration_s"): "--duration",
    ("recovery", "duration_s"): "--duration",
    ("recovery", "delay_s"): "--delay",
    ("recovery", "feet"): "--feet",
    ("recovery", "support"): "--support",
    ("recovery", "feet_apart_m"): "--feet-apart",
    ("recovery", "steps"): "--steps",
    ("recovery", "ankle_stiffness"): "--ankle-stiffness",
    ("recovery", "locked"): "--locked",
    ("recovery", "strength"): "--strength",
    ("body", "model"): "--body",
    ("body", "stature_m"): "--stature",
    ("body", "mass_kg"): "--mass",
    ("body", "sex"): "--sex",
}
"""Where the values of the scenario come from, for messages."""

_NUMBERS: dict[str, tuple[str, type[int] | type[float]]] = {
    "steps": ("steps", int),
    "feet-apart": ("feet_apart", float),
    "delay": ("delay", float),
    "ankle-stiffness": ("ankle_stiffness", float),
    "strength": ("strength", float),
}
"""Settings of a comparison that are numbers, with their field and kind."""


@dataclass(frozen=True)
class PushOptions:
    """The options that a single push and a map have in common.

    Attributes:
        duration: Of the push [s].
        delay: From the beginning of the push until the body reacts [s]; None for the scenarios' own.
        feet: ``"held"`` or ``"free"``; None for the scenarios' own.
        support: ``"both"`` feet, or ``"left"`` or ``"right"``; None for the scenarios' own.
        feet_apart: Distance between the middles of both soles [m]; None for that of the body's posture.
        steps: How many steps may be taken; None for the scenarios' own.
        ankle_stiffness: Of both ankles before the body reacts, in ``m g h`` per radian; None for the
            scenarios' own.
        locked: Groups of joints that hold the posture.
        posture_control_only: Whether the quadratic program is left out.
        strength: Torque and speed limits relative to those of the body.
        body: ``"kudoh"`` or ``"human"``.
        stature, mass, sex: Of a human [m], [kg]; None for the scenarios' own.
    """

    duration: float = 0.1
    delay: float | None = None
    feet: str | None = None
    support: str | None = None
    feet_apart: float | None = None
    steps: int | None = None
    ankle_stiffness: float | None = None
    locked: tuple[str, ...] = ()
    posture_control_only: bool = False
    strength: float = 1.0
    body: str = "kudoh"
    stature: float | None = None
    mass: float | None = None
    sex: str | None = None

    def scenario(self, name: str, force: float = 1.0, direction: float = 0.0) -> "Scenario":
        """The scenario of one push.

        Args:
            name: Of the scenario.
            force: [N].
            direction: Of the force, counter-clockwise from the body's forward axis [deg].

        Raises:
            ScenarioError: If a value is not usable; the message names the option.
        """
        from manikin.scenarios.tasks import push_task
        from manikin.simulation.recover import STRONGEST
        from manikin.spatial import finite_number

        if self.body not in ("kudoh", "human"):
            raise InputError(f"--body is {self.body!r}; valid: kudoh or human")
        finite_number(force, "--force [N]", above=0.0, at_most=STRONGEST)
        body = {"model": self.body, "stature_m": self.stature, "mass_kg": self.mass, "sex": self.sex}
        recovery = {
            "feet": self.feet, "support": self.support, "feet_apart_m": self.feet_apart,
            "steps": self.steps, "delay_s": self.delay,
            "ankle_stiffness": self.ankle_stiffness, "locked": list(self.locked),
            "strength": self.strength, "posture_control_only": self.posture_control_only,
        }  # fmt: skip
        return push_task(
            force, direction, duration=self.duration, name=name, body=_given(body),
            recovery=_given(recovery), where=_OPTIONS,
        )  # fmt: skip

    def changed(self, text: str) -> "PushOptions":
        """The same with some options set as ``KEY=VALUE,KEY=VALUE`` says; several groups are ``arms+hips``.

        Raises:
            InputError: If that is not what the text is.
        """
        changes = dict(_setting(part.strip(), text) for part in text.split(","))
        return replace(self, **changes)


def conditions(scenario: "Scenario", tolerance: float) -> dict[str, Any]:
    """Plain values that say what a map is about, with every default.

    Args:
        scenario: Of any of its pushes.
        tolerance: Of its search [N.s].
    """
    assert scenario.recovery is not None
    assert scenario.push is not None
    recovery = scenario.recovery.model_dump(mode="json", exclude={"duration_s"})
    return {
        "body": scenario.file.body.model_dump(mode="json", exclude_none=True), **recovery,
        "duration_s": scenario.push.duration_s, "tolerance_Ns": tolerance,
    }  # fmt: skip


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _setting(part: str, text: str) -> tuple[str, Any]:
    """Field and value of one setting of a comparison."""
    key, equals, value = part.partition("=")
    if key == "posture-control-only" and value in ("", "yes", "no"):
        return "posture_control_only", value != "no"
    if key in ("feet", "support") and value:
        return key, value
    if key == "locked" and value:
        return key, () if value == "none" else tuple(value.split("+"))
    if key in _NUMBERS and equals:
        field, number = _NUMBERS[key]
        try:
            return field, number(value)
        except ValueError:
            pass
    raise InputError(
        f"--compare {text}: {part!r} is not a setting; valid: feet=free, support=left, steps=1, "
        "feet-apart=M, locked=arms+hips or none, delay=SECONDS, ankle-stiffness=X, strength=X, "
        "posture-control-only, or several with commas between"
    )
