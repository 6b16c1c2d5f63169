"""Colours and names that figures and pages share."""

from collections.abc import Iterable

COLOURS = {
    "recorded": "#6A51A3",
    "shifted": "#B3A2D6",
    "planned": "#0072B2",
    "executed": "#D55E00",
    "left_foot": "#009E73",
    "right_foot": "#CC79A7",
    "left_hand": "#56B4E9",
    "right_hand": "#E69F00",
    "left_knee": "#005F45",
    "right_knee": "#8E4770",
    "left_elbow": "#1F6FA3",
    "right_elbow": "#9A6700",
    "pelvis": "#6A51A3",
    "buttocks": "#6A51A3",
    "ink": "#222222",
    "soft": "#8A8A8A",
    "shade": "#EEF1F5",
    "obstacle": "#C9CED6",
    "trunk": "#6F7784",
    "one support": "#0072B2",
    "two supports": "#C0392B",
    "more supports": "#4D4D4D",
    "first run": "#0072B2",
    "second run": "#D55E00",
}
"""Okabe and Ito's palette, which colour-blind readers can tell apart."""

CYCLE = ("#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#6A51A3", "#8C564B")
"""Colours of effectors without one of their own."""


def readable(effector: str) -> str:
    """Name of an effector for people."""
    return effector.replace("_", " ")


def colours_of(effectors: Iterable[str]) -> dict[str, str]:
    """A colour for each effector: its own, or else the next free one."""
    names = list(dict.fromkeys(effectors))
    free = [colour for colour in CYCLE if colour not in {COLOURS.get(name) for name in names}]
    unknown = [name for name in names if name not in COLOURS]
    chosen = dict(zip(unknown, free * (len(unknown) // max(len(free), 1) + 1), strict=False))
    return {name: COLOURS.get(name) or chosen[name] for name in names}


def side_colour(name: str) -> str:
    """Colour of the body's side that a segment or effector belongs to."""
    for side in ("left", "right"):
        if name.startswith(side):
            return COLOURS[f"{side}_foot"]
    return COLOURS["trunk"]
