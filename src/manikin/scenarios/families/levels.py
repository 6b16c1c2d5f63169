"""Scenes of floors and steps: where to go round, over, under, through, between, up and down."""

import numpy as np

from manikin.scenarios.families.family import Sketch


def stairs(sketch: Sketch) -> None:
    """Go up or down 2 to 5 steps, rise 0.12 to 0.20 m, tread 0.25 to 0.35 m.

    The steps are blocks side by side, or slabs on each other. Possible: what building codes allow, or a
    little more; the landing is 1.2 m deep.
    """
    draw_stairs(sketch, away=sketch.between(0.3, 0.8), landing=1.2, before=sketch.between(0.4, 0.8))


def draw_stairs(sketch: Sketch, *, away: float, landing: float, before: float) -> None:
    """Draw stairs, ``landing`` the depth of the uppermost step, and the way up or down [m].

    It is ``away`` from its lower end to the first step, ``before`` from its upper one to the landing's end.
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
    sketch.goal(end - before, sketch.between(-0.1, 0.1))
    sketch.maybe_turn_back()


def platforms(sketch: Sketch) -> None:
    """Step onto a platform 0.15 to 0.45 m high, or down from one.

    It is turned by up to 30 degrees, 1 to 1.6 m deep and 1 to 2 m wide. Possible: no higher than the knee
    of the smallest person, 0.28 of the stature, by 0.03 m.
    """
    height, away, turn = sketch.between(0.15, 0.45), sketch.between(0.4, 0.8), sketch.between(-30.0, 30.0, 1)
    deep, side = sketch.between(1.0, 1.6), 0.5 * sketch.between(1.0, 2.0)
    about = (away, 0.0)
    sketch.box("platform", (away, away + deep), (-side, side), (0.0, height), yaw_deg=turn, about=about)
    sketch.start(away * (1.0 - np.cos(np.deg2rad(turn))), -away * np.sin(np.deg2rad(turn)))
    sketch.goal(away + 0.5 * deep * np.cos(np.deg2rad(turn)), 0.5 * deep * np.sin(np.deg2rad(turn)), turn)
    sketch.maybe_turn_back()


def roofs(sketch: Sketch) -> None:
    """Step onto a turned platform below a low roof, half of the times over a threshold.

    The platform is 0.15 to 0.3 m high and turned by up to 40 degrees, the threshold 0.05 to 0.12 m higher,
    the roof 72 to 95 % of the stature above the platform, where the body ends in a crouch. Possible: as
    Qiu's platform, whose roof is at 73 % of the stature and whose threshold is 0.30 m high.
    """
    height, away, turn = sketch.between(0.15, 0.3), sketch.between(0.4, 0.7), sketch.between(-40.0, 40.0, 1)
    deep, side = sketch.between(1.0, 1.4), 0.5 * sketch.between(1.2, 1.8)
    roof = height + sketch.between(0.72, 0.95) * sketch.stature
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
    sketch.box("block", (away, away + deep), (-side * (wide - near), side * near), (0.0, height))
    end = away + deep
    if sketch.coin():
        top = sketch.between(0.72, 0.8)
        sketch.box("table", (-0.2, end), (side * near, side * (near + 0.7)), (top - 0.04, top))
    else:
        y, z = side * (near + 0.05), sketch.between(0.9, 1.15)
        sketch.rod("rail", ((-0.2, y, z), (end, y, z)), 0.02)
        for name, x in (("front_post", -0.15), ("rear_post", end - 0.05)):
            sketch.rod(name, ((x, y, 0.0), (x, y, z - 0.02)), 0.02)
    sketch.goal(away + 0.5 * deep, 0.0)
    sketch.maybe_turn_back()


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
        y = (aside - 0.5 * wide, aside + 0.5 * wide)
        sketch.box(f"stone_{number + 1}", (x, x + wide), y, (-0.5, top))
        x += wide
    x += sketch.between(0.10, 0.35)
    sketch.box("far_bank", (x, x + 1.2), (-1.0, 1.0), (-0.5, 0.0))
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
    sketch.goal(away + 0.6 * long * along[0] if sketch.whole(1, 3) == 1 else top + 0.5, 0.0)
    sketch.maybe_turn_back()


def rubble(sketch: Sketch) -> None:
    """Cross rubble up to 0.15 m high between two walls.

    Blocks of 0.25 to 0.5 m, as many as would cover nine tenths of the ground if none overlapped, turned by
    any angle; in half of the scenes tilted by up to 6 degrees as well. Possible: no block is higher than a
    step.
    """
    draw_rubble(sketch, away=sketch.between(0.4, 0.6), beyond=sketch.between(0.5, 0.8))


def draw_rubble(sketch: Sketch, *, away: float, beyond: float) -> None:
    """Draw rubble and the way across, which starts ``away`` from it and ends ``beyond`` it [m]."""
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
        along, aside = ((at - 0.5 * size, at + 0.5 * size) for at, size in zip((x, y), sizes, strict=True))
        sketch.box(f"block_{number}", along, aside, (-0.1, top), yaw_deg=turn, tilt_deg=tilts)
    ends = (-0.8, away + long + beyond + 0.8)
    sketch.box("left_wall", ends, (side, side + 0.1), (0.0, 1.0))
    sketch.box("right_wall", ends, (-side - 0.1, -side), (0.0, 1.0))
    sketch.goal(away + long + beyond, 0.0)


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
            along, across = ((at[k] - 0.5 * sizes[k], at[k] + 0.5 * sizes[k]) for k in (0, 1))
            height, turn = sketch.between(0.4, 1.8), sketch.between(-90.0, 90.0, 1)
            sketch.box(f"box_{number + 1}", along, across, (0.0, height), yaw_deg=turn)
            break
    sketch.goal(way, 0.0)


def thresholds(sketch: Sketch) -> None:
    """Step over a threshold 0.1 to 0.4 m high and 0.03 to 0.3 m thick.

    Crossed at up to 20 degrees from the straight way. Possible: the crotch is at 0.47 of the stature, 0.70 m
    and more, and nothing is overhead.
    """
    height, thick, away = sketch.between(0.1, 0.4), sketch.between(0.03, 0.3), sketch.between(0.45, 0.9)
    turn = sketch.between(-20.0, 20.0, 1)
    sketch.box("threshold", (away, away + thick), (-WIDE, WIDE), (0.0, height), yaw_deg=turn)
    sketch.goal(away + thick + sketch.between(0.6, 1.0), sketch.between(-0.2, 0.2))


def bars(sketch: Sketch) -> None:
    """Pass below a bar at 65 to 90 % of the stature.

    0.04 to 0.3 m high, 0.04 to 0.6 m deep. Possible: people squat and waddle at less than half their stature.
    """
    low = sketch.between(0.65, 0.90) * sketch.stature
    deep, high, away = sketch.between(0.04, 0.6), sketch.between(0.04, 0.3), sketch.between(0.6, 1.0)
    turn = sketch.between(-20.0, 20.0, 1)
    sketch.box("bar", (away, away + deep), (-WIDE, WIDE), (low, low + high), yaw_deg=turn)
    sketch.goal(away + deep + sketch.between(0.6, 1.0), sketch.between(-0.3, 0.3))


def hatches(sketch: Sketch) -> None:
    """Go through a hatch in a wall: a sill 0.15 to 0.4 m high below a lintel.

    0.65 to 0.9 m wide, in a wall 0.04 to 0.2 m thick; from sill to lintel 55 to 75 % of the stature.
    Possible: that is more than a person is high who sits on the sill, 52 %, and wider than the shoulders.
    """
    sill, thick, away = sketch.between(0.15, 0.4), sketch.between(0.04, 0.2), sketch.between(0.5, 0.9)
    lintel = sill + sketch.between(0.55, 0.75) * sketch.stature
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
    sketch.goal(away + long + sketch.between(0.9, 1.3), 0.0)
