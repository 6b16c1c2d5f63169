"""All families by name."""

from manikin.errors import InputError
from manikin.scenarios.families import furniture, levels, ways
from manikin.scenarios.families.family import Family

FAMILIES: dict[str, Family] = {
    family.name: family
    for family in (
        Family(draw.__name__.replace("_", "-"), draw)
        for draw in (
            ways.flat, ways.around, levels.stairs, ways.thresholds, ways.bars, ways.hatches, levels.platforms,
            levels.stones, levels.ramps, ways.gaps, levels.rubble, furniture.chairs, furniture.sitting,
            levels.roofs,
            levels.blocks, furniture.buildings, ways.tunnels, furniture.ladders, furniture.quadruped_stairs,
            furniture.quadruped_rubble,
        )
    )
}  # fmt: skip
"""Families in the order of tables."""

ALL = "all"


def chosen_families(text: str) -> tuple[Family, ...]:
    """Families by their names with commas between them, or ``all``.

    Raises:
        InputError: If a name is not known.
    """
    names = [name.strip() for name in text.split(",")]
    if names == [ALL]:
        return tuple(FAMILIES.values())
    for name in names:
        if name not in FAMILIES:
            raise InputError(f"--families has {name!r}; valid: {ALL}, or some of {', '.join(FAMILIES)}")
    return tuple(FAMILIES[name] for name in dict.fromkeys(names))
