"""Scores of candidates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, NaturalRange, limb_named
from manikin.contact import Stance, sole
from manikin.kinematics.limb_samples import manipulability
from manikin.planning.contacts import (
    BalanceScore,
    Candidates,
    ClosestDistance,
    Comfort,
    Duration,
    Efort,
    Manipulability,
    Random,
    Situation,
    WeightedSum,
    duration,
)


def candidates_of(samples, points, normals):
    count = len(points)
    return Candidates(
        np.arange(count), np.zeros(count, dtype=np.int64), np.asarray(points, dtype=float),
        np.asarray(normals, dtype=float), samples.products[:count], samples.manipulability[:count],
        samples.rotations[:count],
    )  # fmt: skip


@pytest.fixture
def situation(person):
    state = Configuration(person, person.standing_posture())
    return Situation.of(state, limb_named(person, "left_arm"), np.array([-1.0, 0.0, 0.0]))


@pytest.fixture
def candidates(person_samples):
    points = [[0.5, 0.3, 1.2], [0.5, 0.3, 1.4], [0.3, 0.5, 1.0]]
    return candidates_of(person_samples["left_arm"], points, [[-1, 0, 0], [-1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("within", "value"), [([1, 1, 1, 1, 1], 1.0), ([0, 1, 1, 1, 1], 0.0), ([1, 1, 0, 1, 1], 0.4), ([], 1.0)]
)
def test_duration_of_the_published_examples(within, value):
    assert duration(within) == pytest.approx(value)


@given(st.lists(st.booleans(), min_size=1, max_size=8))
def test_duration_is_the_share_before_the_first_that_cannot_reach(within):
    first = within.index(False) if False in within else len(within)
    assert duration(within) == pytest.approx(first / len(within))


def test_a_contact_lasts_while_the_body_stays_near_it(person_samples, situation, candidates):
    """A walk away from the point: the sphere of the reach leaves it at a known step."""
    reach = person_samples["left_arm"].reach
    turn, place = situation.state.segment_placement("thorax")
    centre, radius = reach.inscribed_sphere
    at_first = turn @ centre + place
    here = candidates_of(person_samples["left_arm"], [at_first], [[0, 0, 1]])
    ahead = [(turn, place + np.array([-0.3 * radius * step, 0.0, 0.0])) for step in (1, 2, 3, 4, 5)]
    assert Duration(reach, ahead).score(situation, here) == pytest.approx(3 / 5)
    assert Duration(reach, []).score(situation, candidates) == pytest.approx([1.0, 1.0, 1.0])


def test_simple_heuristics_are_what_they_say(situation, candidates):
    palm = situation.state.effector_placement("left_hand")[1]
    closest = ClosestDistance().score(situation, candidates)
    assert -closest == pytest.approx(np.linalg.norm(candidates.points - palm, axis=1))
    free = Manipulability().score(situation, candidates)
    assert free == pytest.approx(manipulability(candidates.products))
    first, again, other = (Random(seed).score(situation, candidates) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_efort_of_candidates_is_that_of_their_world(situation, candidates):
    alpha = Efort().score(situation, candidates)
    turn = situation.rotation
    for row in range(3):
        product = turn @ candidates.products[row] @ turn.T
        v = situation.reaction
        wanted = (v @ product @ v) ** -0.5 * (v @ candidates.normals[row])
        assert alpha[row] == pytest.approx(wanted)
    assert np.array_equal(Efort(pulling=True).score(situation, candidates), -alpha)


def test_a_weighted_sum_adds_up(situation, candidates):
    total = WeightedSum([(2.0, Efort()), (-1.0, Manipulability())]).score(situation, candidates)
    single = Efort().score(situation, candidates), Manipulability().score(situation, candidates)
    assert total == pytest.approx(2.0 * single[0] - single[1])
    assert WeightedSum([]).score(situation, candidates) == pytest.approx(np.zeros(3))


def test_balance_prefers_a_contact_on_the_side_to_which_the_body_falls(situation, person_samples):
    """Accelerated forward over its feet, a push back from a wall in front is what helps."""
    feet = [sole(f"{s}_foot", (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
            for s, y in (("left", 0.1), ("right", -0.1))]  # fmt: skip
    held = Stance(feet, normal_force_cap=3000.0)
    places = [[0.5, 0.20, 1.3], [0.5, 0.22, 1.31], [-0.5, 0.20, 1.3]]
    sides = [[-1, 0, 0], [-1, 0, 0], [1, 0, 0]]
    given = candidates_of(person_samples["left_arm"], places, sides)
    given.surfaces[2] = 1
    backward = BalanceScore(held, acceleration=(-3.0, 0.0, 0.0))
    before, same, behind = backward.score(situation, given)
    assert before == same
    assert before > 0.0 > behind
    assert BalanceScore(held, (-3.0, 0.0, 0.0), binary=True).score(situation, given).tolist() == [
        1.0,
        1.0,
        0.0,
    ]


def test_comfort_is_the_normalised_distance_of_the_samples(person, person_samples, situation, candidates):
    wanted = NaturalRange(person, situation.limb).normalised(person_samples["left_arm"].angles[:3])
    np.testing.assert_array_equal(Comfort(person_samples).score(situation, candidates), wanted)
