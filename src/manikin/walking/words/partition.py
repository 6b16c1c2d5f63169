"""The space of goals cut into slices of one final heading, and each slice into cells of one word.

The goals are places on a grid with final headings ([Truong2010]_ 3.3). On the border of two cells two
different paths to one goal may cost the same (Fig. 3.7).
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.runtime.parallel import side_by_side
from manikin.walking.path.walking_model import START
from manikin.walking.words.word_program import Goals, Minima, minimise, quadrature, squares
from manikin.walking.words.word_solver import (
    FARTHEST,
    NEAREST,
    THESIS_WORDS,
    WordPath,
    WordResiduals,
    cheapest,
    guesses,
    residuals,
    words_of,
)

HEADINGS = tuple(range(0, 360, 10))
"""Final headings of the 36 slices [deg] ([Truong2010]_ 3.3)."""


@dataclass(frozen=True)
class WordGrid:
    """Places of the goals of every slice; those of the thesis by default ([Truong2010]_ 3.3).

    Attributes:
        x: Smallest and largest x, to the right of the start [m]; ``y`` is ahead of it.
        step: Distance between neighbours [m].
    """

    x: tuple[float, float] = (-2.0, 2.0)
    y: tuple[float, float] = (3.0, 9.0)
    step: float = 0.2

    def __post_init__(self) -> None:
        finite_number(self.step, "step of the grid of words [m]", at_least=0.05, at_most=10.0)
        for name, ends in (("x", self.x), ("y", self.y)):
            where = f"{name} of the grid of words"
            low, high = (finite_number(end, f"{where} [m]") for end in ends)
            if not -20.0 <= low <= high <= 20.0:
                raise InputError(f"{where} is {low:g} to {high:g} m; valid: -20 to 20, ascending")
        distances = np.hypot(self.columns[None], self.rows[:, None])
        nearest, farthest = float(distances.min()), float(distances.max())
        if nearest < NEAREST or farthest > FARTHEST:
            wrong = f"{nearest:g} to {farthest:g} m from the start"
            valid = f"{NEAREST:g} to {FARTHEST:g} m"
            raise InputError(f"goals of the grid of words are {wrong}; valid: {valid}")

    @property
    def columns(self) -> FloatArray:
        """(nx,) x of the nodes [m]."""
        return self._nodes(*self.x)

    @property
    def rows(self) -> FloatArray:
        """(ny,) y of the nodes [m]."""
        return self._nodes(*self.y)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return len(self.rows), len(self.columns)

    def goals(self, heading_deg: float) -> FloatArray:
        """(ny nx, 3) x, y [m], heading [rad] of a slice, row by row."""
        x, y = np.meshgrid(self.columns, self.rows)
        return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, np.radians(heading_deg))])

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"x_m": list(self.x), "y_m": list(self.y), "step_m": self.step}

    def _nodes(self, low: float, high: float) -> FloatArray:
        count = int(np.floor((high - low) / self.step + 1e-9)) + 1
        return np.round(low + self.step * np.arange(float(count)), 9)


THESIS_GRID = WordGrid()

SAME_COST, _TWO_BRANCHES = 1e-9, 1e-6
"""Shares of the cost up to which two paths cost the same, and by which a branch must be the costlier one at
the other's goal."""

_STEPS, _BISECTIONS = 8, 60


@dataclass(frozen=True, eq=False)
class EqualPaths:
    """Two paths to one goal that cost the same.

    Attributes:
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
    """The local minimum that one becomes as its goal moves straight to another (3,), or None if it ends."""
    shape, cost, length = path.shape[None], path.cost, path.length
    for share in np.linspace(0.0, 1.0, _STEPS + 1)[1:]:
        end = path.goal + share * (goal - path.goal)
        minima = minimise(Goals.of(path.start, end[None]), shape)
        if not minima.found[0]:
            return None
        shape, cost, length = minima.shapes, float(minima.cost[0]), float(minima.length[0])
    return WordPath(path.start, np.array(goal), shape[0], length, cost)


def equal_paths(one: WordPath, other: WordPath) -> EqualPaths:
    """Find the goal between two goals that both ways to go reach at the same cost, by bisection.

    Both are best paths from the same start, to goals that are near each other, of two branches. InputError if
    both bend into each other, or one ends before the other's goal.
    """
    whole = 2.0 * np.pi * np.round((other.goal[2] - one.goal[2]) / (2.0 * np.pi))
    lift = np.array([0.0, 0.0, whole])
    for bending, best, raised in ((one, other, -lift), (other, one, lift)):
        bent = bent_to(bending, best.goal + raised)
        if bent is None or bent.cost < best.cost * (1.0 + _TWO_BRANCHES):
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


JUMP = 1e-6
"""Share of the cost by which two branches at one goal must differ to be two."""

_START = np.array(START)


@dataclass(frozen=True, eq=False)
class WordSlice:
    """Best paths to all places of a grid with one final heading; row by row, n places.

    Attributes:
        grid: Places of the goals.
        heading_deg: Final heading modulo whole turns [deg].
        turns: (n,) final less initial heading of the path [rad].
        shapes: (n, degree) coefficients of the paths' headings [rad].
        lengths: (n,) of the paths [m], and their ``costs`` (n,) [m], infinite where none was found.
    """

    grid: WordGrid
    heading_deg: float
    turns: FloatArray
    shapes: FloatArray
    lengths: FloatArray
    costs: FloatArray

    def __post_init__(self) -> None:
        n = self.grid.shape[0] * self.grid.shape[1]
        for name, shape in (("turns", (n,)), ("shapes", (n, None)), ("lengths", (n,)), ("costs", (n,))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"{name} of a slice", shape))

    @cached_property
    def goals(self) -> FloatArray:
        """(n, 3) x, y [m] and heading with whole turns [rad]."""
        goals = self.grid.goals(self.heading_deg)
        goals[:, 2] = START[2] + self.turns
        return goals

    @cached_property
    def words(self) -> NDArray[np.str_]:
        """(ny, nx) word of each place."""
        return np.array(words_of(self.shapes, self.lengths)).reshape(self.grid.shape)

    def path(self, row: int, column: int) -> WordPath:
        """Path to one place."""
        i = row * self.grid.shape[1] + column
        return WordPath(_START, self.goals[i], self.shapes[i], float(self.lengths[i]), float(self.costs[i]))

    def residuals(self) -> WordResiduals:
        """Residuals of all its paths, measured without the solver."""
        return residuals(_START, self.goals, self.shapes, self.lengths)

    def missed(self) -> float:
        """Largest distance of a path's end from its goal, or of its cost from that given [m or rad]."""
        b, lengths = self.shapes, self.lengths[:, None]
        turned, weights = quadrature(b.shape[1])
        heading = START[2] + b @ turned.T
        ends = lengths * np.column_stack([np.cos(heading) @ weights, np.sin(heading) @ weights])
        cost = self.lengths + (b**2) @ squares(b.shape[1]) / self.lengths**3
        turn = -b[:, 0] / 6.0 - (self.goals[:, 2] - START[2])
        whole = np.angle(np.exp(1j * (self.goals[:, 2] - np.radians(self.heading_deg))))
        parts = (ends - self.goals[:, :2], cost - self.costs, turn, whole)
        return float(max(np.max(np.abs(part)) for part in parts))

    def jumps(self) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Pairs of neighbours (row, column) whose paths are of two branches: none bends into the other.

        The path of either is bent to the other's goal; if it costs more there than the path that was found
        for it, there is a goal between them with two best paths.
        """
        rows, columns = self.grid.shape
        index = np.arange(rows * columns).reshape(rows, columns)
        sides = ((index[:, :-1], index[:, 1:]), (index[:-1], index[1:]))
        pairs = np.vstack([np.column_stack([a.ravel(), b.ravel()]) for a, b in sides])
        apart = self._costlier(pairs[:, 0], pairs[:, 1]) & self._costlier(pairs[:, 1], pairs[:, 0])
        return [(divmod(int(a), columns), divmod(int(b), columns)) for a, b in pairs[apart]]

    def _costlier(self, by: NDArray[np.intp], at: NDArray[np.intp]) -> NDArray[np.bool_]:
        goals = self.goals[at].copy()
        goals[:, 2] = self.goals[by, 2]
        bent = minimise(Goals.of(_START, goals), self.shapes[by])
        return bent.cost > self.costs[at] * (1.0 + JUMP)


def solve_slice(heading_deg: float, grid: WordGrid = THESIS_GRID) -> WordSlice:
    """Best paths to all places of a grid with one final heading; 90 deg is that of the start.

    After all guesses, the paths of neighbours are bent to each place until nothing gets cheaper. InputError
    if a place was not reached by any guess.
    """
    goals = grid.goals(finite_number(heading_deg, "heading of a slice [deg]"))
    turned, best = _from_neighbours(grid, *cheapest(_START, goals, guesses()))
    for x, y, _ in goals[~best.found]:
        where = f"({x:g}, {y:g}) m at {heading_deg:g} deg"
        raise InputError(f"no path was found to {where}; valid: another grid")
    return WordSlice(grid, float(heading_deg), turned[:, 2] - START[2], best.shapes, best.length, best.cost)


def _from_neighbours(grid: WordGrid, turned: FloatArray, best: Minima) -> tuple[FloatArray, Minima]:
    """Minima improved by bending the paths of neighbours."""
    turned, shapes, cost, length = (x.copy() for x in (turned, best.shapes, best.cost, best.length))
    index = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape)
    pairs = [(index[1:], index[:-1]), (index[:-1], index[1:])]
    pairs += [(index[:, 1:], index[:, :-1]), (index[:, :-1], index[:, 1:])]
    for _ in range(sum(grid.shape)):
        improved = False
        for to, by in ((at.ravel(), beside.ravel()) for at, beside in pairs):
            ends = turned[to].copy()
            ends[:, 2] = turned[by, 2]
            bent = minimise(Goals.of(_START, ends), shapes[by])
            better = bent.cost < cost[to] * (1.0 - 1e-8)
            changed = to[better]
            turned[changed], shapes[changed] = ends[better], bent.shapes[better]
            cost[changed], length[changed] = bent.cost[better], bent.length[better]
            improved = improved or bool(changed.size)
        if not improved:
            break
    return turned, Minima(shapes, cost, length)


def count_words(slices: Iterable[WordSlice]) -> dict[str, int]:
    """Number of places of each word: those of the thesis in its order, then others by their number."""
    counted = Counter(str(word) for part in slices for word in part.words.ravel())
    others = sorted(counted.keys() - set(THESIS_WORDS), key=lambda word: (-counted[word], word))
    return {word: counted[word] for word in (*THESIS_WORDS, *others)}


def shares(counts: Mapping[str, int]) -> dict[str, float]:
    """Share of each word [-]."""
    total = max(1, sum(counts.values()))
    return {word: number / total for word, number in counts.items()}


def solve_slices(
    headings_deg: Sequence[float], grid: WordGrid = THESIS_GRID, *, jobs: int = 1
) -> Iterator[WordSlice]:
    """Solve the slices of final headings [deg] side by side; yield them in the order in which they are done.

    Each depends on nothing but itself, so any number of jobs, at least 1, finds the same; errors are those of
    :func:`solve_slice` and :func:`manikin.runtime.parallel.side_by_side`.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    for _, solved in side_by_side(partial(solve_slice, grid=grid), headings_deg, jobs, "words"):
        yield solved
