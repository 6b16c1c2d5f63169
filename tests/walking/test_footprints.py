"""Footprints in time."""

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking.footprints import FEET, Footprint, Footprints


def two_steps():
    """The left foot, then the right one, 0.4 m ahead."""
    return Footprints([
        Footprint("left_foot", [0, 0.1, 0], 0.0, 0.0, 0.5),
        Footprint("right_foot", [0, -0.1, 0], 0.0, 0.0, 1.1),
        Footprint("left_foot", [0.4, 0.1, 0], 0.0, 0.9, 2.0),
        Footprint("right_foot", [0.4, -0.1, 0], 0.0, 1.6, 2.0),
    ])  # fmt: skip


def test_phases_are_double_and_single_supports_in_turn():
    walk = two_steps()
    held = [sorted(stance) for stance, _ in walk.phases()]
    assert held == [sorted(FEET), ["right_foot"], sorted(FEET), ["left_foot"], sorted(FEET)]
    assert [seconds for _, seconds in walk.phases()] == pytest.approx([0.5, 0.4, 0.2, 0.5, 0.4])
    assert walk.count == 2


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ((0, "left_foot", 0.0, 1.0), "land"),  # lands at 0.9 s, before it leaves
        ((1, "right_foot", 0.0, 0.7), "both feet in the air"),
        ((3, "right_foot", 1.6, 1.9), "begin or end"),
    ],
)
def test_impossible_walks_are_refused(changed, message):
    index, foot, lands, leaves = changed
    steps = [
        Footprint("left_foot", [0, 0.1, 0], 0.0, 0.0, 0.5),
        Footprint("right_foot", [0, -0.1, 0], 0.0, 0.0, 1.1),
        Footprint("left_foot", [0.4, 0.1, 0], 0.0, 0.9, 2.0),
        Footprint("right_foot", [0.4, -0.1, 0], 0.0, 1.6, 2.0),
    ]
    steps[index] = Footprint(foot, steps[index].position, 0.0, lands, leaves)
    with pytest.raises(InputError, match=message):
        Footprints(steps)


def test_unusable_values_are_named():
    with pytest.raises(InputError, match="left_foot, right_foot"):
        Footprint("left_hand", [0, 0, 0], 0.0, 0.0, 1.0)
    with pytest.raises(InputError, match="leaves"):
        Footprint("left_foot", [0, 0, 0], 0.0, 1.0, 1.0)
    with pytest.raises(InputError, match="position"):
        Footprint("left_foot", [0, np.nan, 0], 0.0, 0.0, 1.0)
    with pytest.raises(InputError, match="none of right_foot"):
        Footprints([Footprint("left_foot", [0, 0, 0], 0.0, 0.0, 1.0)])
