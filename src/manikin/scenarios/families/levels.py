"""Scenes with several levels: stairs, platforms, stones, ramps and rubble."""

from manikin.scenarios.families.family import Sketch


def stairs(sketch: Sketch) -> None:
    """Go up or down 2 to 5 steps, rise 0.12 to 0.20 m, tread 0.25 to 0.35 m.

    Possible: what building codes allow, or a little more; the landing is 1.2 m deep.
    """
    draw_stairs(sketch, sketch.between(0.12, 0.20), sketch.between(0.25, 0.35))
    if sketch.coin():
        sketch.turn_back()


def draw_stairs(sketch: Sketch, rise: float, tread: float) -> None:
    """Draw 2 to 5 steps as blocks side by side, or as slabs on each other, with a landing behind them."""
    steps, wide = sketch.whole(2, 5), sketch.between(0.9, 1.4)
    away, slabs = sketch.between(0.3, 0.8), sketch.coin()
    end = round(away + (steps - 1) * tread + 1.2, 3)
    for step in range(steps):
        near = away + step * tread
        far = end if slabs or step == steps - 1 else near + tread
        below = step * rise if slabs else 0.0
        name = "landing" if step == steps - 1 else f"step_{step + 1}"
        sketch.box(name, (near, far), (-0.5 * wide, 0.5 * wide), (below, (step + 1) * rise))
    sketch.start(0.0, 0.0)
    sketch.goal(end - sketch.between(0.4, 0.8), sketch.between(-0.1, 0.1))


def platforms(sketch: Sketch) -> None:
    """Step onto a platform 0.15 to 0.45 m high, or down from one.

    It is turned by up to 30 degrees. Possible: no higher than the knee of the smallest person.
    """
    height, away = sketch.between(0.15, 0.45), sketch.between(0.35, 0.8)
    turn = sketch.between(-30.0, 30.0, 1)
    deep, wide = sketch.between(1.0, 1.6), sketch.between(1.0, 2.0)
    # So far that the turned platform leaves room for the feet before it.
    away = round(away + 0.25 * wide * abs(turn) / 30.0, 3)
    sketch.box(
        "platform", (away, away + deep), (-0.5 * wide, 0.5 * wide), (0.0, height), rpy_deg=(0.0, 0.0, turn)
    )  # fmt: skip
    sketch.start(0.0, 0.0)
    sketch.goal(away + 0.5 * deep, 0.0, turn)
    if sketch.coin():
        sketch.turn_back()
