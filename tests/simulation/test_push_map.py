"""Searches of the largest impulse held: borders that were tried, the same by any road, honest on the way."""

import multiprocessing
import pickle
import time
import types
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human, kudoh
from manikin.control.recovery import RecoverySettings
from manikin.errors import InputError
from manikin.motion.description import describe_body
from manikin.simulation import (
    DirectionSearch,
    Feet,
    HeldImpulse,
    PushMap,
    PushTrials,
    RecoveryTask,
    equal_directions,
    largest_held,
    search_directions,
)

KUDOH = kudoh()
TRIALS = PushTrials(KUDOH, RecoveryTask((), Feet.FREE))
LATE = PushTrials(KUDOH, RecoveryTask((), Feet.FREE), RecoverySettings(delay=1.5), begins=0.0)
"""Trials of a body that reacts when it falls already."""


class Tried:
    """Whether an impulse is held, by a rule, and which ones were asked for."""

    def __init__(self, rule):
        self.rule, self.answers = rule, {}

    def __call__(self, impulse):
        self.answers[impulse] = self.rule(impulse)
        return self.answers[impulse]


@given(border=st.floats(0.0, 400.0), tolerance=st.floats(0.1, 8.0))
def test_the_border_of_a_monotone_rule_is_found(border, tolerance):
    tried = Tried(lambda impulse: impulse <= border)
    found = largest_held(tried, tolerance=tolerance, strongest=500.0)
    assert found.held <= border < found.beyond
    assert found.beyond - found.held <= tolerance
    assert found.trials == len(tried.answers)


@given(st.lists(st.floats(0.5, 300.0), min_size=1, max_size=9, unique=True))
def test_of_several_borders_one_is_found_and_both_sides_were_tried(borders):
    """Recovery need not be monotone in the force."""
    tried = Tried(lambda impulse: np.searchsorted(np.sort(borders), impulse) % 2 == 0)
    found = largest_held(tried, tolerance=1.0, strongest=500.0)
    assert tried.answers[found.held]
    assert found.beyond is None or not tried.answers[found.beyond]
    assert found.beyond is None or 0.0 < found.beyond - found.held <= 1.0


def test_what_always_or_never_holds_has_no_border():
    always = largest_held(lambda _: True, tolerance=1.0, strongest=75.0)
    assert (always.held, always.beyond) == (75.0, None)
    never = largest_held(lambda _: False, tolerance=1.0)
    assert never.held is None
    assert never.beyond <= 1.0
    only_unpushed = largest_held(lambda impulse: impulse == 0.0, tolerance=1.0)
    assert only_unpushed.held == 0.0


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf])
def test_a_tolerance_is_positive(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        largest_held(lambda _: True, tolerance=tolerance)


@pytest.mark.parametrize("count", [0, 361])
def test_a_map_has_directions(count):
    with pytest.raises(InputError, match="valid: 1 to 360"):
        equal_directions(count)


def test_a_map_survives_its_file_and_reads_between_directions_on_the_safe_side():
    found = (HeldImpulse(20.0, 21.0, 9), HeldImpulse(40.0, 41.0, 9), HeldImpulse(30.0, None, 9))
    whole = PushMap({"feet": "free"}, (0.0, 120.0, 240.0), found, (25.0, 50.0, 35.0))
    again = PushMap.from_dict(whole.as_dict())
    assert (again.conditions, again.directions, again.found) == (whole.conditions, whole.directions, found)
    assert again.bound == (25.0, 50.0, 35.0)
    assert (whole.surely_held(60.0), whole.surely_held(180.0), whole.surely_held(-1.0)) == (20.0, 30.0, 20.0)
    assert (whole.surely_held(0.0), whole.surely_beyond(60.0)) == (20.0, 41.0)
    assert np.isnan(whole.surely_beyond(180.0))
    part = PushMap.empty({}, (0.0, 120.0, 240.0)).with_found(1, HeldImpulse(None, 1.0, 6))
    assert part.missing == (0, 2)
    assert PushMap.from_dict(part.as_dict()).missing == (0, 2)
    assert PushMap.from_dict(part.as_dict()).bound is None
    with pytest.raises(ValueError, match="2 bounds of 3 directions"):
        PushMap.from_dict(part.as_dict() | {"bound_Ns": [1.0, 2.0]})


def test_bounds_are_those_of_the_stance():
    """Mirror images from the sides of two feet; later reaction holds less; welded feet have no bound."""
    angles = (0.0, 60.0, 300.0)
    ahead, left, right = TRIALS.bound(angles)
    assert left == pytest.approx(right, rel=1e-3)
    late = replace(TRIALS, settings=RecoverySettings(delay=0.3)).bound(angles)
    assert late[0] < 0.95 * ahead
    assert PushTrials(KUDOH).bound(angles) is None


@pytest.mark.parametrize("body", [KUDOH, human(1.6, 55.0, "female")], ids=["kudoh", "human"])
def test_a_body_can_be_sent_to_another_process(body):
    sent = pickle.loads(pickle.dumps(body))
    assert describe_body(sent) == describe_body(body)
    assert (sent.mass, sent.standing_angles) == (body.mass, body.standing_angles)
    with pytest.raises(TypeError):
        sent.effectors["tail"] = None


def pretended(quick_border, whole_border):
    """Trials whose early ends are wrong about what lies between the borders."""

    def push(_direction, impulse, *, until_at_rest=None):
        border = whole_border if until_at_rest is None else quick_border
        return types.SimpleNamespace(recovered=impulse <= border)

    return types.SimpleNamespace(push=push, strongest=500.0)


def test_what_an_early_end_takes_for_held_is_confirmed_by_a_whole_run():
    right = DirectionSearch(pretended(33.3, 33.3), 0.0).run()
    assert right.held <= 33.3 < right.beyond
    wrong = DirectionSearch(pretended(33.3, 25.1), 0.0).run()
    assert wrong.held <= 25.1 < wrong.beyond
    assert wrong.trials > right.trials


@pytest.mark.parametrize(
    ("direction", "impulse", "recovered"),
    [
        pytest.param(0.0, 36.0, False, marks=pytest.mark.long),
        pytest.param(180.0, 20.0, True, marks=pytest.mark.long),
    ],
)
def test_a_run_that_ends_at_rest_has_the_verdict_of_a_whole_one(direction, impulse, recovered):
    """Near the border of what is held, where a body rests, leaves its rest to unwind, and rests again."""
    early = TRIALS.push(direction, impulse, until_at_rest=0.5)
    whole = TRIALS.push(direction, impulse)
    assert early.recovered == whole.recovered == recovered
    time = early.trace.motion.time
    same = whole.trace.motion.q[: len(time)]
    np.testing.assert_array_equal(early.trace.motion.q, same)  # the same run, cut short
    if recovered:
        assert time[-1] < whole.trace.motion.time[-1] - 0.3
        assert early.time_to_rest == pytest.approx(time[-1] - TRIALS.begins - 0.5, abs=1e-6)


def test_a_run_does_not_end_at_rest_before_the_push_is_over():
    """The body stands at rest until it is pushed, and during a weak push as well."""
    push = PushTrials(KUDOH, RecoveryTask((), Feet.FREE), push_duration=0.6, begins=0.4)
    found = push.push(90.0, 3.0, until_at_rest=0.1)
    assert found.recovered, found.failure
    assert 1.1 - 1e-6 <= found.trace.motion.time[-1] < 1.6


@pytest.mark.long
def test_processes_find_the_same_and_end_when_nobody_waits_for_them():
    """Of a body that reacts late: its trials are short, and its border depends on all of the simulation."""
    before = set(multiprocessing.active_children())
    searches = [DirectionSearch(LATE, direction, 500.0) for direction in (0.0, 120.0)]
    with closing(search_directions(searches, jobs=2)) as found:
        number, beside = next(found)
    assert beside == searches[number].run()
    assert beside.beyond < 500.0
    # Not joined: the pool's own thread joins them, and one of two that join at a time misses the end.
    started, waited = set(multiprocessing.active_children()) - before, 0.0
    while any(process.is_alive() for process in started) and waited < 60.0:
        time.sleep(0.1)
        waited += 0.1
    assert not any(process.is_alive() for process in started)


def test_searches_need_a_job():
    with pytest.raises(InputError, match="jobs is 0"):
        next(search_directions([], jobs=0))
