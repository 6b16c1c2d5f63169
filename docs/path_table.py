"""Find the best paths over the goals, from which later ones start: writes ``walking_paths.npz``.

Run ``python docs/path_table.py`` after changes of the criterion; it takes ten minutes.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.walking import PROSE_ORDER, Walker, WalkingPath
from manikin.walking.path.path_plan import initial_guesses
from manikin.walking.path.path_program import free_optimum
from manikin.walking.path.path_table import SHIPPED, PathTable
from manikin.walking.path.walking_path import WalkingTask

FILE = Path(__file__).parents[1] / "src" / "manikin" / "walking" / "data" / "walking_paths.npz"


def optima(goal: FloatArray) -> Sequence[WalkingPath]:
    """All optima reached from the initial guesses, from rest at the origin to rest at a goal."""
    rest = np.zeros(3)
    task = WalkingTask(rest, goal, PROSE_ORDER, (), Walker(), 0.0, None, rest, rest)
    found = [free_optimum(task, guess) for guess in initial_guesses(task)]
    print(goal.round(3), [path and round(path.cost, 4) for path in found], file=sys.stderr)
    return [path for path in found if path is not None]


if __name__ == "__main__":
    PathTable.of(PROSE_ORDER, SHIPPED, optima).save(FILE)
