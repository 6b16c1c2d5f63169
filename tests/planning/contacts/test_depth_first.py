"""The depth-first search over changes of contact, on made-up moves without any body."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.planning.contacts.depth_first import PartialPlan, SearchLog, search_depth_first

LENGTH = 4.0


class TreeOfMoves:
    """Each number of a path is a change; those of a forbidden path are refused, each at one search."""

    def __init__(self, goals, forbidden=(), most=1000, width=3):
        self.counted = SimpleNamespace(searches=7)  # of an earlier search
        self.log = SearchLog(self.counted, most)
        self.goals, self.forbidden, self.width, self.seen = set(goals), set(forbidden), width, []

    def proposals(self, partial):
        if len(partial.stages) < LENGTH:
            yield from range(self.width)

    def accepted(self, partial, change):
        self.counted.searches += 1
        path = (*path_of(partial), change)
        if path in self.forbidden:
            self.log.refuse(f"{change} is forbidden")
            return None
        self.seen.append(path)
        return partial_of(path)

    def finished(self, partial):
        return path_of(partial) if path_of(partial) in self.goals else None

    def search(self):
        return search_depth_first(partial_of(()), self, self.log, LENGTH)


def partial_of(path):
    stages = [SimpleNamespace(number=number, contacts=("foot",)) for number in (None, *path)]
    return PartialPlan(tuple(stages), {"foot": float(len(path))})


def path_of(partial):
    return tuple(stage.number for stage in partial.stages[1:])


paths = st.lists(st.integers(0, 2), min_size=1, max_size=3).map(tuple)


@given(st.sets(paths), st.sets(paths, max_size=6))
def test_the_first_path_that_is_allowed_is_found(goals, forbidden):
    """The search answers as a walk through all paths in the order of their changes would."""
    allowed = [
        path for path in sorted(goals) if not any(path[:end] in forbidden for end in range(1, len(path) + 1))
    ]
    moves = TreeOfMoves(goals, forbidden)
    found = moves.search()
    assert found.succeeded is bool(allowed)
    assert found.plan == (allowed[0] if allowed else None)
    assert moves.seen == sorted(moves.seen)
    assert len(set(moves.seen)) == len(moves.seen)
    assert found.searches == moves.counted.searches - 7


def test_a_change_that_leads_nowhere_is_taken_back():
    """Below change 0 all is refused: the one change that was made is taken back, and 1 is the goal."""
    moves = TreeOfMoves({(1,)}, forbidden={(0, 0), (0, 1), (0, 2)})
    found = moves.search()
    assert found.plan == (1,)
    assert (found.backtracks, found.searches) == (1, 5)


@pytest.mark.parametrize("most", [1, 5, 12])
def test_no_more_is_looked_for_than_allowed(most):
    found = TreeOfMoves((), most=most).search()
    assert found.searches == most
    assert found.failure.startswith(f"no contacts after {most} postures beyond ")


def test_the_failure_says_how_far_it_came_and_what_was_most_often_in_the_way():
    moves = TreeOfMoves((), forbidden={(0,), (1, 0), (1, 1, 0), (1, 1, 1)}, width=2)
    found = moves.search()
    assert found.failure == (
        "no contacts follow the guide beyond 50 % of it (2.00 m); most often: 0 is forbidden"
    )
    assert found.reached == 0.5
    assert found.backtracks == 3
