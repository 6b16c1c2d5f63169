"""Scenes with several levels: stairs, platforms, blocks, stones, ramps and rubble."""

import numpy as np

from manikin.scenarios.families.family import Sketch


def stairs(sketch: Sketch) -> None:
    """Go up or down 2 to 5 steps, rise 0.12 to 0.20 m, tread 0.25 to 0.35 m.

    The steps are blocks side by side, or slabs on each other. Possible: what building codes allow, or a
    little more; the landing is 1.2 m deep.
    """
    draw_stairs(sketch, away=sketch.between(0.3, 0.8), landing=1.2, before=sketch.between(0.4, 0.8))


def draw_stairs(sketch: Sketch, *, away: float, landing: float, before: float) -> None:
    """Draw stairs and the way up or down.

    Args:
        away: From the lower end of the way to the first step [m].
        landing: Depth of the uppermost step [m].
        before: From the upper end of the way to the landing's end [m].
    """
    rise, tread = sketch.between(0.12, 0.20), sketch.between(0.25, 0.35)
    steps, side, slabs = sketch.whole(2, 5), 0.5 * sketch.between(0.9, 1.4), sketch.coin()
    end = away + (steps - 1) * tread + landing
    for step in range(steps):
        last = step == steps - 1
        near = away + step * tread
        far = end if slabs or last else near + tread
        below = step * rise if slabs else 0.0
        name = "landing" if last else f"step_{step + 1}"
        sketch.box(name, (near, far), (-side, side), (below, (step + 1) * rise))
    sketch.start(0.0, 0.0)
    sketch.goal(end - before, sketch.between(-0.1, 0.1))
    if sketch.coin():
        sketch.turn_back()


def platforms(sketch: Sketch) -> None:
    """Step onto a platform 0.15 to 0.45 m high, or down from one.

    It is turned by up to 30 degrees, 1 to 1.6 m deep and 1 to 2 m wide. Possible: no higher than the knee
    of the smallest person, 0.28 of the stature, by 0.03 m.
    """
    height, away, turn = sketch.between(0.15, 0.45), sketch.between(0.4, 0.8), sketch.between(-30.0, 30.0, 1)
    deep, side = sketch.between(1.0, 1.6), 0.5 * sketch.between(1.0, 2.0)
    about = (away, 0.0)
    sketch.box(
        "platform", (away, away + deep), (-side, side), (0.0, height), yaw_deg=turn, about=about
    )  # fmt: skip
    sketch.start(away * (1.0 - np.cos(np.deg2rad(turn))), -away * np.sin(np.deg2rad(turn)))
    sketch.goal(away + 0.5 * deep * np.cos(np.deg2rad(turn)), 0.5 * deep * np.sin(np.deg2rad(turn)), turn)
    if sketch.coin():
        sketch.turn_back()


def roofs(sketch: Sketch) -> None:
    """Step onto a turned platform below a low roof, half of the times over a threshold.

    The platform is 0.15 to 0.3 m high and turned by up to 40 degrees, the threshold 0.05 to 0.12 m higher,
    the roof 72 to 95 % of the stature above the platform, where the body ends in a crouch. Possible: as
    Qiu's platform, whose roof is at 73 % of the stature and whose threshold is 0.30 m high.
    """
    height, away, turn = sketch.between(0.15, 0.3), sketch.between(0.4, 0.7), sketch.between(-40.0, 40.0, 1)
    deep, side = sketch.between(1.0, 1.4), 0.5 * sketch.between(1.2, 1.8)
    roof = height + sketch.between(0.72, 0.95) * sketch.person.stature
    turned = {"yaw_deg": turn, "about": (away, 0.0)}
    sketch.box("platform", (away, away + deep), (-side, side), (0.0, height), **turned)
    sketch.box("roof", (away, away + deep), (-side, side), (roof, roof + 0.05), **turned)
    if sketch.coin():
        top = height + sketch.between(0.05, 0.12)
        sketch.box("threshold", (away - 0.025, away + 0.025), (-side, side), (0.0, top), **turned)
    across = np.array([np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))])
    sketch.start(away - (away + 0.05) * across[0], -(away + 0.05) * across[1])
    sketch.goal(away + 0.5 * deep * across[0], 0.5 * deep * across[1], turn, posture="crouched")


def blocks(sketch: Sketch) -> None:
    """Climb a block 0.5 to 0.7 m high beside a table or a rail, or down from it.

    Possible: people climb onto a table, 0.75 m, by a knee; here a hand has a table 0.72 to 0.8 m high to
    lean on, or a rail 0.9 to 1.15 m high to hold on to.
    """
    height, away = sketch.between(0.5, 0.7), sketch.between(0.35, 0.6)
    deep, wide = sketch.between(0.7, 1.1), sketch.between(0.8, 1.2)
    side, near = sketch.side(), sketch.between(0.35, 0.45)
    sketch.box("block", (away, away + deep), sorted_pair(-side * (wide - near), side * near), (0.0, height))
    end = away + deep
    if sketch.coin():
        top = sketch.between(0.72, 0.8)
        sketch.box("table", (-0.2, end), sorted_pair(side * near, side * (near + 0.7)), (top - 0.04, top))
    else:
        y, z = side * (near + 0.05), sketch.between(0.9, 1.15)
        sketch.rod("rail", ((-0.2, y, z), (end, y, z)), 0.02)
        for name, x in (("front_post", -0.15), ("rear_post", end - 0.05)):
            sketch.rod(name, ((x, y, 0.0), (x, y, z - 0.02)), 0.02)
    sketch.start(0.0, 0.0)
    sketch.goal(away + 0.5 * deep, 0.0)
    if sketch.coin():
        sketch.turn_back()


def sorted_pair(one: float, other: float) -> tuple[float, float]:
    """Two numbers, the smaller first."""
    return min(one, other), max(one, other)


def stones(sketch: Sketch) -> None:
    """Cross water on 3 to 5 stepping stones, 0.30 to 0.45 m wide, with gaps of 0.10 to 0.35 m.

    Their tops are up to 0.08 m above or below the banks, their middles up to 0.1 m beside the way.
    Possible: from edge to edge a foot, 0.28 m long, makes steps of 0.63 m at most, and each stone has room
    for two soles.
    """
    sketch.floor = None
    x = 0.25
    sketch.box("near_bank", (x - 1.2, x), (-1.0, 1.0), (-0.5, 0.0))
    for number in range(sketch.whole(3, 5)):
        x += sketch.between(0.10, 0.35)
        wide, top, aside = sketch.between(0.30, 0.45), sketch.between(-0.08, 0.08), sketch.between(-0.1, 0.1)
        sketch.box(
            f"stone_{number + 1}", (x, x + wide), (aside - 0.5 * wide, aside + 0.5 * wide), (-0.5, top)
        )  # fmt: skip
        x += wide
    x += sketch.between(0.10, 0.35)
    sketch.box("far_bank", (x, x + 1.2), (-1.0, 1.0), (-0.5, 0.0))
    sketch.start(0.0, 0.0)
    sketch.goal(x + 0.3, 0.0)


def ramps(sketch: Sketch) -> None:
    """Go up or down a ramp of 5 to 18 degrees to a platform, or stop on the ramp.

    1.5 to 3 m long. Possible: the friction of 0.7 holds up to 35 degrees.
    """
    slope, long, away = sketch.between(5.0, 18.0, 1), sketch.between(1.5, 3.0), sketch.between(0.4, 0.8)
    side, thick = 0.5 * sketch.between(0.9, 1.5), 0.1
    along = np.array([np.cos(np.deg2rad(slope)), 0.0, np.sin(np.deg2rad(slope))])
    normal = np.array([-along[2], 0.0, along[0]])
    middle = np.array([away, 0.0, 0.0]) + 0.5 * long * along - 0.5 * thick * normal
    sketch.add("ramp", box=[long, round(2.0 * side, 4), thick], position=middle, rpy_deg=(0.0, -slope, 0.0))
    top = away + long * along[0]
    sketch.box("platform", (top, top + 1.2), (-side, side), (0.0, long * along[2]))
    sketch.start(0.0, 0.0)
    sketch.goal(away + 0.6 * long * along[0] if sketch.whole(1, 3) == 1 else top + 0.5, 0.0)
    if sketch.coin():
        sketch.turn_back()


def rubble(sketch: Sketch) -> None:
    """Cross rubble up to 0.15 m high between two walls.

    Blocks of 0.25 to 0.5 m, as many as would cover nine tenths of the ground if none overlapped, turned by
    any angle; in half of the scenes tilted by up to 6 degrees as well. Possible: no block is higher than a
    step.
    """
    draw_rubble(sketch, away=sketch.between(0.4, 0.6), beyond=sketch.between(0.5, 0.8))


def draw_rubble(sketch: Sketch, *, away: float, beyond: float) -> None:
    """Draw rubble and the way across.

    Args:
        away: From the start to the rubble [m].
        beyond: From there to the goal [m].
    """
    long, side = sketch.between(1.2, 2.4), 0.5 * sketch.between(1.1, 1.5)
    tilt, covered, number = 6.0 if sketch.coin() else 0.0, 0.0, 0
    while covered < 0.9 * long * 2.0 * side:
        number += 1
        sizes = np.array([sketch.between(0.25, 0.5), sketch.between(0.25, 0.5)])
        covered += float(sizes.prod())
        x, y = sketch.between(away + 0.2, away + long - 0.2), sketch.between(-side + 0.2, side - 0.2)
        tilts = (sketch.between(-tilt, tilt, 1), sketch.between(-tilt, tilt, 1))
        # The highest corner of a tilted block is below the limit, too.
        raised = 0.5 * float(sizes @ np.abs(np.sin(np.deg2rad(tilts[::-1]))))
        top, turn = sketch.between(0.02, 0.15 - raised), sketch.between(-90.0, 90.0, 1)
        (x0, x1), (y0, y1) = (
            (x - 0.5 * sizes[0], x + 0.5 * sizes[0]),
            (y - 0.5 * sizes[1], y + 0.5 * sizes[1]),
        )
        sketch.box(f"block_{number}", (x0, x1), (y0, y1), (-0.1, top), yaw_deg=turn, tilt_deg=tilts)
    ends = (-0.8, away + long + beyond + 0.8)
    sketch.box("left_wall", ends, (side, side + 0.1), (0.0, 1.0))
    sketch.box("right_wall", ends, (-side - 0.1, -side), (0.0, 1.0))
    sketch.start(0.0, 0.0)
    sketch.goal(away + long + beyond, 0.0)
