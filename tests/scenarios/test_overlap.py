"""Feet that would stand in each other are bad input."""

import pytest

from manikin.errors import ScenarioError
from manikin.scenarios import load_scenario


def test_overlapping_soles_are_refused_with_their_place(tmp_path):
    text = load_scenario("platform").to_yaml().replace("[0.5, 0.65, 0.2]", "[0.65, 0.65, 0.2]")
    file = tmp_path / "overlap.yaml"
    file.write_text(text)
    scenario = load_scenario(str(file))
    with pytest.raises(ScenarioError, match=r"phases\[6\].*overlaps") as caught:
        scenario.check_contacts(scenario.build_scene())
    assert "\n" not in str(caught.value)
