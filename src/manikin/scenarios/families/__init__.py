"""Families of random everyday scenes, as a user would write them: body, obstacles, start and goal alone."""

from manikin.errors import InputError
from manikin.scenarios.families import furniture, levels
from manikin.scenarios.families.family import Family, draw_scene

__all__ = ["FAMILIES", "Family", "chosen_families", "draw_scene"]

FAMILIES: dict[str, Family] = {
    (name := draw.__name__.replace("_", "-")): Family(name, draw)
    for draw in (
        levels.flat, levels.around, levels.stairs, levels.thresholds, levels.bars, levels.hatches,
        levels.platforms, levels.stones, levels.ramps, levels.gaps, levels.rubble, furniture.chairs,
        furniture.sitting, levels.roofs, levels.blocks, furniture.buildings, levels.tunnels,
        furniture.ladders, furniture.quadruped_stairs, furniture.quadruped_rubble,
    )
}  # fmt: skip
"""Families in the order of tables."""

ALL = "all"


def chosen_families(text: str) -> tuple[Family, ...]:
    """Families by their names with commas between them, or ``all``; InputError if a name is not known."""
    names = [name.strip() for name in text.split(",")]
    if names == [ALL]:
        return tuple(FAMILIES.values())
    for name in names:
        if name not in FAMILIES:
            raise InputError(f"--families has {name!r}; valid: {ALL}, or some of {', '.join(FAMILIES)}")
    return tuple(FAMILIES[name] for name in dict.fromkeys(names))
