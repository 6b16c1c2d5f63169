"""Families of random everyday scenes, as a user would write them: body, obstacles, start and goal alone."""

from manikin.scenarios.families.family import Family, Sketch, draw_scene
from manikin.scenarios.families.registry import FAMILIES, chosen_families

__all__ = ["FAMILIES", "Family", "Sketch", "chosen_families", "draw_scene"]
