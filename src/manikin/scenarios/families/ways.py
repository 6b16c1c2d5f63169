"""Scenes on a level floor: where to go round, over, under, through and between."""

import numpy as np

from manikin.scenarios.families.family import Sketch

WIDE = 3.0
"""Half the width of what nobody shall walk round [m]."""

TALL = 2.2
"""Height of walls [m]."""

ROOM = 0.8
"""Least distance between any two boxes to walk round, and of them to start and goal [m]."""


def flat(sketch: Sketch) -> None:
    """Go to a place on a flat floor, anywhere around, to face anywhere.

    0.3 to 4 m away. Possible: nothing stands there.
    """
    way, direction = sketch.between(0.3, 4.0), np.deg2rad(sketch.between(-180.0, 180.0, 1))
    sketch.start(0.0, 0.0)
    sketch.goal(way * np.cos(direction), way * np.sin(direction), sketch.between(-180.0, 180.0, 1))


def around(sketch: Sketch) -> None:
    """Walk round 2 to 4 boxes, the first of which stands on the straight way.

    Boxes of 0.3 to 0.9 m, 0.4 to 1.8 m high, turned by any angle; the goal is 2.5 to 4 m away. Possible:
    circles around the boxes leave 0.8 m between any two, so there is a way that a person 0.5 m wide walks
    upright.
    """
    way = sketch.between(2.5, 4.0)
    ends = [np.array([0.0, 0.0]), np.array([way, 0.0])]
    placed: list[tuple[np.ndarray, float]] = []
    for number in range(sketch.whole(2, 4)):
        sizes = np.array([sketch.between(0.3, 0.9), sketch.between(0.3, 0.9)])
        radius = 0.5 * float(np.linalg.norm(sizes))
        for _ in range(100):
            aside = 0.1 if not placed else 1.2
            spread = 0.5 * way - radius - ROOM if not placed else 0.5 * way + 0.5
            x = 0.5 * way + sketch.between(-1.0, 1.0) * max(spread, 0.0)
            at = np.array([x, sketch.between(-aside, aside)])
            away = [np.linalg.norm(at - end) - radius - 0.6 for end in ends]
            apart = [np.linalg.norm(at - other) - radius - size - ROOM for other, size in placed]
            if min(away + apart) < 0.0:
                continue
            placed.append((at, radius))
            (x0, x1), (y0, y1) = ((at[k] - 0.5 * sizes[k], at[k] + 0.5 * sizes[k]) for k in (0, 1))
            height, turn = sketch.between(0.4, 1.8), sketch.between(-90.0, 90.0, 1)
            sketch.box(f"box_{number + 1}", (x0, x1), (y0, y1), (0.0, height), yaw_deg=turn)
            break
    sketch.start(0.0, 0.0)
    sketch.goal(way, 0.0)


def thresholds(sketch: Sketch) -> None:
    """Step over a threshold 0.1 to 0.4 m high and 0.03 to 0.3 m thick.

    Crossed at up to 20 degrees from the straight way. Possible: the crotch is at 0.47 of the stature, 0.70 m
    and more, and nothing is overhead.
    """
    height, thick, away = sketch.between(0.1, 0.4), sketch.between(0.03, 0.3), sketch.between(0.45, 0.9)
    turn = sketch.between(-20.0, 20.0, 1)
    sketch.box("threshold", (away, away + thick), (-WIDE, WIDE), (0.0, height), yaw_deg=turn)
    sketch.start(0.0, 0.0)
    sketch.goal(away + thick + sketch.between(0.6, 1.0), sketch.between(-0.2, 0.2))


def bars(sketch: Sketch) -> None:
    """Pass below a bar at 65 to 90 % of the stature.

    0.04 to 0.3 m high, 0.04 to 0.6 m deep. Possible: people squat and waddle at less than half their stature.
    """
    low = sketch.between(0.65, 0.90) * sketch.person.stature
    deep, high, away = sketch.between(0.04, 0.6), sketch.between(0.04, 0.3), sketch.between(0.6, 1.0)
    turn = sketch.between(-20.0, 20.0, 1)
    sketch.box("bar", (away, away + deep), (-WIDE, WIDE), (low, low + high), yaw_deg=turn)
    sketch.start(0.0, 0.0)
    sketch.goal(away + deep + sketch.between(0.6, 1.0), sketch.between(-0.3, 0.3))


def hatches(sketch: Sketch) -> None:
    """Go through a hatch in a wall: a sill 0.15 to 0.4 m high below a lintel.

    0.65 to 0.9 m wide, in a wall 0.04 to 0.2 m thick; from sill to lintel 55 to 75 % of the stature.
    Possible: that is more than a person is high who sits on the sill, 52 %, and wider than the shoulders.
    """
    sill, thick, away = sketch.between(0.15, 0.4), sketch.between(0.04, 0.2), sketch.between(0.5, 0.9)
    lintel = sill + sketch.between(0.55, 0.75) * sketch.person.stature
    side = 0.5 * sketch.between(0.65, 0.9)
    x = (away, away + thick)
    sketch.box("sill", x, (-side, side), (0.0, sill))
    sketch.box("lintel", x, (-side, side), (lintel, TALL))
    sketch.box("left_wall", x, (side, WIDE), (0.0, TALL))
    sketch.box("right_wall", x, (-WIDE, -side), (0.0, TALL))
    sketch.start(0.0, sketch.between(-0.15, 0.15))
    sketch.goal(away + thick + sketch.between(0.6, 1.0), sketch.between(-0.15, 0.15))


def gaps(sketch: Sketch) -> None:
    """Pass through a gap 0.40 to 0.75 m wide between two walls.

    The walls are 0.1 to 0.5 m thick. Possible: sideways, a trunk is at most 0.3 m deep.
    """
    side, thick, away = 0.5 * sketch.between(0.40, 0.75), sketch.between(0.1, 0.5), sketch.between(0.5, 1.0)
    aside = sketch.between(-0.3, 0.3)
    x = (away, away + thick)
    sketch.box("left_wall", x, (aside + side, WIDE), (0.0, TALL))
    sketch.box("right_wall", x, (-WIDE, aside - side), (0.0, TALL))
    sketch.start(0.0, 0.0)
    sketch.goal(away + thick + sketch.between(0.6, 1.0), sketch.between(-0.3, 0.3))


def tunnels(sketch: Sketch) -> None:
    """Crawl through a tunnel 0.55 to 0.8 m high.

    0.8 to 1.2 m wide and 1 to 2 m long, behind a hole in a wall. Possible: on hands and knees a back is at
    the height of the thighs, 0.25 of the stature, and half a trunk, 0.63 m at most; on forearms lower.
    """
    high, side = sketch.between(0.55, 0.8), 0.5 * sketch.between(0.8, 1.2)
    away, long = sketch.between(0.8, 1.2), sketch.between(1.0, 2.0)
    x = (away, away + long)
    sketch.box("left_side", x, (side, side + 0.1), (0.0, high))
    sketch.box("right_side", x, (-side - 0.1, -side), (0.0, high))
    sketch.box("ceiling", x, (-side - 0.1, side + 0.1), (high, high + 0.1))
    x = (away, away + 0.1)
    sketch.box("left_wall", x, (side + 0.1, WIDE), (0.0, TALL))
    sketch.box("right_wall", x, (-WIDE, -side - 0.1), (0.0, TALL))
    sketch.box("wall_above", x, (-side - 0.1, side + 0.1), (high + 0.1, TALL))
    sketch.start(0.0, 0.0)
    sketch.goal(away + long + sketch.between(0.9, 1.3), 0.0)
