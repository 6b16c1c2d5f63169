"""The library in a few verbs; :mod:`manikin` offers them under its own name."""

from manikin.api.bodies import Balance, balance, creature, grasp, point, scene, sole, stance
from manikin.api.runs import (
    Comparison,
    RecordedMotion,
    Run,
    adapt,
    analyze,
    compare,
    plan,
    push,
    read,
    simulate,
    walk,
)
from manikin.body import human

__all__ = [
    "Balance", "Comparison", "RecordedMotion", "Run", "adapt", "analyze", "balance", "compare",
    "creature", "grasp", "human", "plan", "point", "push", "read", "scene", "simulate", "sole", "stance",
    "walk",
]  # fmt: skip
