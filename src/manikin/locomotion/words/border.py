"""Goals on the border of cells, where two different paths cost the same ([Truong2010]_ Fig. 3.7)."""

from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError
from manikin.locomotion.words.path import WordPath
from manikin.locomotion.words.programme import Goals, minimise
from manikin.spatial import FloatArray

SAME_COST = 1e-9
"""Share of the cost up to which two paths cost the same."""

_TWO_BRANCHES = 1e-6
"""Share of the cost by which a branch must be the costlier one at the other's goal."""

_STEPS = 8
_BISECTIONS = 60


@dataclass(frozen=True, eq=False)
class EqualPaths:
    """Two paths to one goal that cost the same.

    Attributes:
        first: One of them.
        second: The other.
        apart: Largest distance between them at equal shares of their lengths [m].
    """

    first: WordPath
    second: WordPath
    apart: float

    @property
    def gap(self) -> float:
        """Difference of their costs, as a share [-]."""
        return abs(self.first.cost - self.second.cost) / self.first.cost


def bent_to(path: WordPath, goal: FloatArray) -> WordPath | None:
    """The local minimum that a path becomes when its goal moves straight to another one, or None if it ends.

    Args:
        path: A local minimum.
        goal: (3,) x, y [m], heading with whole turns [rad].
    """
    shape, cost, length = path.shape[None], path.cost, path.length
    for share in np.linspace(0.0, 1.0, _STEPS + 1)[1:]:
        end = path.goal + share * (goal - path.goal)
        found = minimise(Goals.of(path.start, end[None]), shape)
        if not found.found[0]:
            return None
        shape, cost, length = found.shapes, float(found.cost[0]), float(found.length[0])
    return WordPath(path.start, np.array(goal), shape[0], length, cost)


def equal_paths(one: WordPath, other: WordPath) -> EqualPaths:
    """Find the goal between two goals that both ways to go reach at the same cost, by bisection.

    Args:
        one: Best path to a goal.
        other: Best path to another goal nearby, of another branch, from the same start.

    Raises:
        InputError: If both bend into each other, or one ends before the other's goal.
    """
    whole = 2.0 * np.pi * np.round((other.goal[2] - one.goal[2]) / (2.0 * np.pi))
    lift = np.array([0.0, 0.0, whole])
    for bending, best, raised in ((one, other, -lift), (other, one, lift)):
        there = bent_to(bending, best.goal + raised)
        if there is None or there.cost < best.cost * (1.0 + _TWO_BRANCHES):
            raise InputError(
                "two paths of words are of one branch, or one ends between their goals; "
                "valid: best paths to neighbours that are of two branches"
            )
    low, high = one.goal, other.goal - lift
    first, second, a, b = one, other, one, other
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        first, second = bent_to(a, middle), bent_to(b, middle + lift)
        if first is None or second is None:
            raise InputError("a path of words ends between the goals; valid: goals closer to each other")
        if first.cost < second.cost:
            low, a = middle, first
        else:
            high, b = middle, second
        if abs(first.cost - second.cost) < SAME_COST * first.cost:
            break
    apart = float(np.max(np.hypot(*(first.states() - second.states())[:, :2].T)))
    return EqualPaths(first, second, apart)
