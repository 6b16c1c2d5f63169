"""Scenes with things made to be used: chairs, ladders, buildings as one mesh; and those of a quadruped."""

import numpy as np
import trimesh

from manikin.scenarios.families.family import Range, Sketch
from manikin.scenarios.families.levels import draw_rubble, draw_stairs


def chairs(sketch: Sketch) -> None:
    """Get up from a chair 0.38 to 0.52 m high, with armrests or without, padded or hard.

    Then go up to half a metre. Possible: feet reach the ground, as who sits on a seat above the hollow of the
    knee, at 0.25 of the stature, sits near its edge; there is room below the seat to draw the feet back.
    """
    seat = sketch.between(0.38, 0.52)
    high = seat > 0.25 * sketch.stature
    front = sketch.between(0.12, 0.14) if high else sketch.between(0.13, 0.2)
    deep, thick = sketch.between(0.40, 0.46), sketch.between(0.03, 0.08)
    arms, padded = sketch.coin(), sketch.coin()
    side = 0.5 * (sketch.between(0.50, 0.56) if arms else sketch.between(0.42, 0.50))
    rear = front - deep
    sketch.box("seat", (rear, front), (-side, side), (seat - thick, seat), padded=padded)
    top = seat + sketch.between(0.35, 0.5)
    sketch.box("back", (rear - 0.04, rear), (-side, side), (seat, top), padded=padded)
    for name, x in (("front", front - 0.07), ("rear", rear)):
        for edge, y in (("left", side - 0.04), ("right", -side)):
            sketch.box(f"{name}_{edge}_leg", (x, x + 0.04), (y, y + 0.04), (0.0, seat - thick))
    if arms:
        top = seat + sketch.between(0.18, 0.26)
        for edge, y in (("left", side), ("right", -side - 0.05)):
            sketch.box(f"{edge}_armrest", (rear, front - 0.06), (y, y + 0.05), (top - 0.03, top))
            sketch.box(f"{edge}_arm_post", (front - 0.12, front - 0.08), (y, y + 0.05), (0.0, top - 0.03))
    sketch.start(0.0, 0.0, posture="seated")
    sketch.goal(front + sketch.between(0.2, 0.6), sketch.between(-0.1, 0.1), sketch.between(-20.0, 20.0, 1))


def sitting(sketch: Sketch) -> None:
    """Sit down on a chair as of the family chairs, from a place before it.

    From 0.2 to 0.6 m before its front edge, facing as who sits there by 20 degrees. Possible: as rising,
    backwards in time.
    """
    chairs(sketch)
    sketch.exchange()


def ladders(sketch: Sketch) -> None:
    """Climb a ladder that leans on a wall, up to its second to fourth rung, or down from there.

    68 to 78 degrees steep, rungs 0.25 to 0.3 m apart and 0.35 to 0.45 m wide, round or flat. Possible: as
    ladders are built and leant (EN 131: 65 to 75 degrees, rungs 0.25 to 0.3 m apart).
    """
    steep, apart = np.deg2rad(sketch.between(68.0, 78.0, 1)), sketch.between(0.25, 0.30)
    side, away, flat = 0.5 * sketch.between(0.35, 0.45), sketch.between(0.4, 0.6), sketch.coin()
    rungs, reached = 10, sketch.whole(2, 4)
    slope = 1.0 / np.tan(steep)
    for number in range(1, rungs + 1):
        z = number * apart
        x = away + z * slope
        if flat:
            sketch.box(f"rung_{number}", (x - 0.04, x + 0.04), (-side, side), (z - 0.025, z))
        else:
            sketch.rod(f"rung_{number}", ((x, -side, z), (x, side, z)), 0.016)
    top = (rungs + 0.5) * apart
    for name, y in (("left_stile", side + 0.02), ("right_stile", -side - 0.02)):
        sketch.rod(name, ((away, y, 0.0), (away + top * slope, y, top)), 0.02)
    behind = away + top * slope + 0.05
    sketch.box("wall", (behind, behind + 0.2), (-1.0, 1.0), (0.0, top))
    level = round(reached * apart, 3)
    # The root of who stands on a rung is 0.4 m before the ladder there.
    sketch.goal(away + (level + 0.9) * slope - 0.4, 0.0, height_m=level, posture="climbing")
    if sketch.coin():
        sketch.exchange()


def buildings(sketch: Sketch) -> None:
    """Go through a door into a building that is one mesh, and up to a podium or onto stairs.

    Door 0.8 to 1 m wide and 2 to 2.1 m high, podium 0.1 to 0.2 m or 2 to 3 steps of 0.14 to 0.18 m; an STL
    or OBJ file in metres or millimetres, with a floor of its own or without. Possible: as in any house.
    """
    room, side, wall = sketch.between(2.4, 3.2), 0.5 * sketch.between(2.2, 3.0), sketch.between(0.1, 0.24)
    door, top = 0.5 * sketch.between(0.8, 1.0), sketch.between(2.0, 2.1)
    away, tall, aside = sketch.between(0.5, 0.9), 2.5, sketch.between(-0.3, 0.3)
    inside = away + wall
    end = inside + room
    parts: list[tuple[Range, Range, Range]] = [
        ((away, inside), (aside + door, side), (0.0, tall)),
        ((away, inside), (-side, aside - door), (0.0, tall)),
        ((away, inside), (aside - door, aside + door), (top, tall)),
        ((end, end + wall), (-side, side), (0.0, tall)),
        ((away, end + wall), (side, side + wall), (0.0, tall)),
        ((away, end + wall), (-side - wall, -side), (0.0, tall)),
    ]
    steps = sketch.whole(2, 3) if sketch.coin() else 1
    rise = sketch.between(0.14, 0.18) if steps > 1 else sketch.between(0.1, 0.2)
    first = inside + sketch.between(0.7, 0.9)
    for step in range(steps):
        x = first + 0.3 * step
        parts.append(((x, end), (-side, side), (step * rise, (step + 1) * rise)))
    if sketch.coin():
        sketch.floor = None
        parts.append(((-1.0, end + wall), (-side - wall, side + wall), (-0.2, 0.0)))
    # Drawn from a corner, as buildings are.
    corner = np.array([away, -side - wall, 0.0])
    unit, scale = ("mm", 1000.0) if sketch.coin() else ("m", 1.0)
    solids = []
    for part in parts:
        low, high = (np.array([extent[k] for extent in part]) - corner for k in (0, 1))
        solid = trimesh.creation.box(extents=scale * (high - low))
        solids.append(solid.apply_translation(0.5 * scale * (low + high)))
    ending = "stl" if sketch.coin() else "obj"
    keys = {} if unit == "m" else {"unit": unit}
    whole = trimesh.util.concatenate(solids)
    assert isinstance(whole, trimesh.Trimesh)
    sketch.mesh("building", whole, ending, corner, **keys)
    sketch.start(0.0, sketch.between(-0.2, 0.2))
    last = first + 0.3 * (steps - 1)
    sketch.goal(0.5 * (last + end), sketch.between(-0.4, 0.4), sketch.between(-90.0, 90.0, 1))


def quadruped_stairs(sketch: Sketch) -> None:
    """A quadruped goes up or down 2 to 5 steps, rise 0.12 to 0.20 m, tread 0.25 to 0.35 m.

    Trunk 0.7 to 0.9 m long. Possible: walking robots and dogs of this size go up such stairs.
    """
    _as_quadruped(sketch)
    draw_stairs(sketch, away=sketch.between(0.7, 1.0), landing=1.8, before=0.8)


def quadruped_rubble(sketch: Sketch) -> None:
    """A quadruped crosses rubble up to 0.15 m high between two walls.

    Trunk 0.7 to 0.9 m long. Possible: no block is higher than a third of its legs.
    """
    _as_quadruped(sketch)
    draw_rubble(sketch, away=sketch.between(0.7, 1.0), beyond=sketch.between(0.8, 1.1))


def _as_quadruped(sketch: Sketch) -> None:
    length = sketch.between(0.7, 0.9)
    sketch.body = {
        "model": "quadruped", "length_m": length, "mass_kg": round(sketch.between(55.0, 70.0) * length**3, 1),
    }  # fmt: skip
