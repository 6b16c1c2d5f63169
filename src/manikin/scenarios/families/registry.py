"""All families by name."""

from manikin.errors import InputError
from manikin.scenarios.families import levels, ways
from manikin.scenarios.families.family import Family

FAMILIES: dict[str, Family] = {
    draw.__name__: Family(draw.__name__, draw)
    for draw in (
        ways.flat,
        ways.thresholds,
        ways.bars,
        levels.stairs,
        levels.platforms,
    )
}
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
