"""First contacts of limbs: in which order combinations of places are tried."""

from itertools import product
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.planning.contacts.endpoint import best_first

COSTS = st.dictionaries(
    st.sampled_from("abcdef"), st.lists(st.floats(0.0, 5.0), min_size=1, max_size=4).map(sorted), min_size=1,
    max_size=4,
)  # fmt: skip


def offered(costs):
    return {
        name: [(cost, SimpleNamespace(effector=name, number=number)) for number, cost in enumerate(items)]
        for name, items in costs.items()
    }


@given(COSTS)
def test_every_combination_comes_once_and_the_cheapest_first(costs):
    """Against all of them; sums in another order differ by rounding."""
    found = [tuple(choice[name].number for name in costs) for choice in best_first(offered(costs), 1000)]
    assert sorted(found) == sorted(product(*(range(len(items)) for items in costs.values())))
    few = [tuple(choice[name].number for name in costs) for choice in best_first(offered(costs), 3)]
    assert few == found[:3]
    totals = [sum(items[k] for items, k in zip(costs.values(), choice, strict=True)) for choice in found]
    assert totals == pytest.approx(sorted(totals))
