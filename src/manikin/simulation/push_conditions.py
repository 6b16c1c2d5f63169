"""The conditions of push maps in words: what several have in common, and what tells them apart."""

from collections.abc import Mapping, Sequence
from typing import Any

from manikin.control.balance_recovery import RecoverySettings

USUAL = {
    "on both feet",
    "usual stance",
    "no step",
    "nothing locked",
    "with the program",
    "usual strength",
    "usual ankles",
}
"""What goes without saying."""


def told_apart(maps: Sequence[Mapping[str, Any]]) -> tuple[str, list[str]]:
    """What maps have in common, and a name for each that tells it from the others.

    Args:
        maps: Conditions of each, as in its JSON.

    Returns:
        Words for what is common, but for what goes without saying, and for each map those for what
        differs; empty where nothing does.
    """
    spoken = [_words(one) for one in maps]
    differ = [len({words[place] for words in spoken}) > 1 for place in range(len(spoken[0]))]
    common = [word for word, other in zip(spoken[0], differ, strict=True) if not other]
    names = [[word for word, other in zip(words, differ, strict=True) if other] for words in spoken]
    return ", ".join(word for word in common if word not in USUAL), [", ".join(name) for name in names]


def _words(one: Mapping[str, Any]) -> list[str]:
    """One text per condition, the same conditions in every list."""
    locked = " and ".join(one["locked"])
    apart = one.get("feet_apart_m")  # not in maps that were searched before there was a choice
    strength, ankles, steps = one["strength"], one["ankle_stiffness"], one["steps"]
    return [
        _body(one["body"]),
        f"feet {one['feet']}",
        "on both feet" if one["support"] == "both" else f"on the {one['support']} foot",
        f"feet {apart:g} m apart" if apart else "usual stance",
        f"up to {steps} step{'s' * (steps > 1)}" if steps else "no step",
        f"{locked} locked" if locked else "nothing locked",
        "posture control only" if one["posture_control_only"] else "with the program",
        "usual strength" if strength == 1.0 else f"{strength:g} times the strength",
        "usual ankles" if ankles == RecoverySettings.ankle_stiffness else f"ankles of {ankles:g} m g h",
        f"reaction after {one['delay_s']:g} s",
        f"push of {one['duration_s']:g} s",
    ]


def _body(body: Mapping[str, Any]) -> str:
    if body["model"] == "kudoh":
        return "body of Kudoh"
    return f"{body['sex']} of {body['stature_m']:g} m and {body['mass_kg']:g} kg"
