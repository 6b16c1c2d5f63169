"""Slices of the partition: grid, cells, borders with two best paths, processes."""

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking.words import (
    HEADINGS,
    THESIS_GRID,
    THESIS_WORDS,
    WordGrid,
    bent_to,
    count_words,
    equal_paths,
    shares,
    solve_slice,
    solve_slices,
    word_path,
)

SMALL = WordGrid((-2.0, 2.0), (3.0, 3.6), 0.4)


@pytest.fixture(scope="module")
def small():
    return solve_slice(340, SMALL)


def test_grid_of_the_thesis():
    """21 x 31 places and 36 headings: 23,436 problems."""
    assert THESIS_GRID.shape == (31, 21)
    assert len(HEADINGS) * 31 * 21 == 23436
    goals = THESIS_GRID.goals(150)
    assert goals[0] == pytest.approx([-2.0, 3.0, np.radians(150)])
    assert goals[-1] == pytest.approx([2.0, 9.0, np.radians(150)])


def test_paths_of_a_slice_are_the_best_to_its_places(small):
    assert small.missed() < 1e-9
    assert small.residuals().position.max() < 1e-9
    for row, column in ((0, 0), (1, 5), (0, 10)):
        path = small.path(row, column)
        assert path.cost <= word_path(path.goal).cost * (1.0 + 1e-9)
        assert small.words[row, column] == path.word


def test_counts_hold_every_place(small):
    counts = count_words([small])
    assert tuple(counts)[:6] == THESIS_WORDS
    assert sum(counts.values()) == small.costs.size
    assert sum(shares(counts).values()) == pytest.approx(1.0)


def test_on_a_border_two_different_paths_cost_the_same(small):
    """Costs to 1e-6 and more than half a metre apart, and both still end at the goal between the places."""
    jumps = small.jumps()
    assert jumps
    for a, b in jumps[:2]:
        one, other = small.path(*a), small.path(*b)
        pair = equal_paths(one, other)
        assert pair.gap < 1e-6
        assert pair.apart > 0.5
        between = np.sort([one.goal[:2], other.goal[:2]], axis=0)
        for path in (pair.first, pair.second):
            assert np.all(path.goal[:2] >= between[0] - 1e-9)
            assert np.all(path.goal[:2] <= between[1] + 1e-9)
            assert np.allclose(path.states()[-1, :3], path.goal, atol=1e-9)


def test_a_path_bends_to_the_next_place(small):
    path = small.path(0, 0)
    there = bent_to(path, path.goal + np.array([0.0, 0.1, 0.0]))
    assert there is not None
    assert np.allclose(there.states()[-1, :2], path.goal[:2] + np.array([0.0, 0.1]), atol=1e-9)


def test_paths_of_one_branch_have_no_border():
    with pytest.raises(InputError, match="one branch"):
        equal_paths(word_path((0.0, 6.0, 2.0)), word_path((0.2, 6.0, 2.0)))


@pytest.mark.long
def test_several_processes_find_the_same(small):
    found = {one.heading_deg: one for one in solve_slices([340, 90], SMALL, jobs=2)}
    assert set(found) == {340.0, 90.0}
    assert np.array_equal(found[340.0].costs, small.costs)
    assert np.array_equal(found[340.0].shapes, small.shapes)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"step": 0.0}, ">= 0.05"),
        ({"x": (1.0, -1.0)}, "ascending"),
        ({"y": (0.0, 1.0)}, "0.5 to 15 m"),
        ({"y": (3.0, 16.0)}, "3 to 16.* m from the start"),
        ({"x": (np.nan, 1.0)}, "finite"),
    ],
)
def test_grids_that_are_not_usable_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        WordGrid(**arguments)


def test_no_process_is_refused():
    with pytest.raises(InputError, match="jobs is 0"):
        next(solve_slices([90], SMALL, jobs=0))
