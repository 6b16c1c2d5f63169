"""Scenes on a level floor: where to go round, over, under and between."""

import numpy as np

from manikin.scenarios.families.family import Sketch

WIDE = 3.0
"""Half the width of what nobody shall walk round [m]."""


def flat(sketch: Sketch) -> None:
    """Go to a place on a flat floor, anywhere around, to face anywhere.

    0.3 to 4 m away. Possible: nothing stands there.
    """
    way, direction = sketch.between(0.3, 4.0), np.deg2rad(sketch.between(-180.0, 180.0, 1))
    sketch.start(0.0, 0.0)
    sketch.goal(way * np.cos(direction), way * np.sin(direction), sketch.between(-180.0, 180.0, 1))


def thresholds(sketch: Sketch) -> None:
    """Step over a threshold 0.1 to 0.4 m high and 0.03 to 0.3 m thick.

    Crossed at up to 20 degrees from the straight way. Possible: the crotch is at 0.47 of the stature, 0.70 m
    and more, and nothing is overhead.
    """
    height, thick, away = sketch.between(0.1, 0.4), sketch.between(0.03, 0.3), sketch.between(0.45, 0.9)
    turn = sketch.between(-20.0, 20.0, 1)
    middle = away + 0.5 * thick
    sketch.box(
        "threshold", (away, away + thick), (-WIDE, WIDE), (0.0, height), rpy_deg=(0.0, 0.0, turn)
    )  # fmt: skip
    sketch.start(0.0, 0.0)
    sketch.goal(middle + sketch.between(0.6, 1.0), sketch.between(-0.2, 0.2))


def bars(sketch: Sketch) -> None:
    """Pass below a bar at 65 to 90 % of the stature.

    0.04 to 0.3 m high, 0.04 to 0.6 m deep. Possible: people squat and waddle at less than half their stature.
    """
    low = round(sketch.between(0.65, 0.90) * sketch.person.stature, 3)
    deep, high, away = sketch.between(0.04, 0.6), sketch.between(0.04, 0.3), sketch.between(0.6, 1.0)
    turn = sketch.between(-20.0, 20.0, 1)
    sketch.box("bar", (away, away + deep), (-WIDE, WIDE), (low, low + high), rpy_deg=(0.0, 0.0, turn))
    sketch.start(0.0, 0.0)
    sketch.goal(away + deep + sketch.between(0.6, 1.0), sketch.between(-0.3, 0.3))
