"""The space of goals cut into slices of one final heading, and each slice into cells of one word."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.locomotion.targets import START
from manikin.locomotion.words.basis import quadrature, squares
from manikin.locomotion.words.certificate import WordResiduals, residuals
from manikin.locomotion.words.grid import THESIS_GRID, WordGrid
from manikin.locomotion.words.path import THESIS_WORDS, WordPath, words_of
from manikin.locomotion.words.programme import Goals, Minima, minimise
from manikin.locomotion.words.solve import cheapest, guesses
from manikin.spatial import FloatArray, finite_number, frozen_array

JUMP = 1e-6
"""Share of the cost by which two branches at one goal must differ to be two."""

_START = np.array(START)


@dataclass(frozen=True, eq=False)
class WordSlice:
    """Best paths to all places of a grid with one final heading; row by row, n places.

    Attributes:
        grid: Of the places.
        heading_deg: Final heading modulo whole turns [deg].
        turns: (n,) final less initial heading of the path [rad].
        shapes: (n, degree) of the paths.
        lengths: (n,) of the paths [m].
        costs: (n,) of the paths [m]; infinite where none was found.
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
        """Of all its paths, measured afresh."""
        return residuals(_START, self.goals, self.shapes, self.lengths)

    def missed(self) -> float:
        """How far paths end from their goals, or their costs are from those given; largest [m] or [rad]."""
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
        pairs = np.vstack(
            [
                np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()]),
                np.column_stack([index[:-1].ravel(), index[1:].ravel()]),
            ]
        )
        apart = self._costlier(pairs[:, 0], pairs[:, 1]) & self._costlier(pairs[:, 1], pairs[:, 0])
        return [(divmod(int(a), columns), divmod(int(b), columns)) for a, b in pairs[apart]]

    def _costlier(self, by: NDArray[np.intp], at: NDArray[np.intp]) -> NDArray[np.bool_]:
        goals = self.goals[at].copy()
        goals[:, 2] = self.goals[by, 2]
        bent = minimise(Goals.of(_START, goals), self.shapes[by])
        return bent.cost > self.costs[at] * (1.0 + JUMP)


def solve_slice(heading_deg: float, grid: WordGrid = THESIS_GRID) -> WordSlice:
    """Best paths to all places of a grid with one final heading.

    After all guesses, the paths of neighbours are bent to each place until nothing gets cheaper.

    Args:
        heading_deg: Final heading, 90 is that of the start [deg].
        grid: Of the places.

    Raises:
        InputError: If a place was not reached by any guess.
    """
    goals = grid.goals(finite_number(heading_deg, "heading of a slice [deg]"))
    turned, best = cheapest(_START, goals, guesses())
    turned, best = _from_neighbours(grid, turned, best)
    if not np.all(best.found):
        place = goals[np.flatnonzero(~best.found)[0]]
        raise InputError(
            f"no path was found to ({place[0]:g}, {place[1]:g}) m at {heading_deg:g} deg; valid: another grid"
        )
    return WordSlice(grid, float(heading_deg), turned[:, 2] - START[2], best.shapes, best.length, best.cost)


def _from_neighbours(grid: WordGrid, turned: FloatArray, best: Minima) -> tuple[FloatArray, Minima]:
    """Minima improved by those of neighbours."""
    turned, shapes = turned.copy(), best.shapes.copy()
    cost, length = best.cost.copy(), best.length.copy()
    rows, columns = grid.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    for _ in range(rows + columns):
        improved = False
        for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
            here, there = index, np.roll(index, shift, axis)
            keep = (slice(None), slice(1, None) if shift > 0 else slice(None, -1))
            inside = keep if axis == 1 else keep[::-1]
            to, by = here[inside].ravel(), there[inside].ravel()
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
    counted = Counter(str(word) for one in slices for word in one.words.ravel())
    others = sorted(
        (word for word in counted if word not in THESIS_WORDS), key=lambda word: (-counted[word], word)
    )
    return {word: counted[word] for word in (*THESIS_WORDS, *others)}


def shares(counts: Mapping[str, int]) -> dict[str, float]:
    """Share of each word."""
    total = max(1, sum(counts.values()))
    return {word: number / total for word, number in counts.items()}
