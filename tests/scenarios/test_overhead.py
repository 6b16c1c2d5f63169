"""Constraints on the CoM's height that a scenario's scene and body give."""

import numpy as np
import pytest

from manikin.errors import ScenarioError
from manikin.scenarios import load_scenario


def constraints(*settings, name="beam-H1C1", variant=None):
    return load_scenario(name, variant=variant, overrides=settings).build_centroidal_problem().geometric


def test_the_beam_bounds_the_height_under_it():
    """Below 1.45 m at the height of people, 0.85 m; free at the start; the post is no ceiling."""
    (bound,) = constraints(variant="S2")
    assert bound.name == "height below 'beam'"
    assert bound.violation(np.array([0.38, 0.4, 0.85])) == pytest.approx(0.0, abs=0.03)
    assert bound.violation(np.array([0.0, 0.0, 0.99])) < 0.0


def test_a_beam_above_the_head_bounds_nothing():
    """Its underside at 1.85 m is out of reach of 1.75 m."""
    assert constraints("scene.beam.position.2=1.875") == ()


def test_named_obstacles_are_taken_and_unknown_ones_refused():
    """A beam a hand above the floor is stepped over, unless the file says it is to be passed below."""
    low = "scene.beam.position.2=0.225"
    assert constraints(low) == ()
    (bound,) = constraints(low, "com_constraints.0.overhead=[beam]")
    assert bound.impassable.startswith("'beam' leaves 0.20 m above the supports; this body folds to")
    with pytest.raises(ScenarioError, match=r"overhead\[0\] is 'roof'; valid: automatic, or the name"):
        constraints("com_constraints.0.overhead=[roof]")


def test_the_roof_of_the_platform_is_found():
    """Over the platform at 0.2 m the roof leaves 1.275 m; the threshold is stepped over."""
    (bound,) = constraints("com_constraints=[{overhead: automatic}]", name="platform")
    assert bound.name == "height below 'roof'"
    assert 0.85 < 1.2 - float(bound.violation(np.array([0.9, 0.75, 1.2]))) < 1.0


def test_a_seat_beyond_the_beam_is_not_the_ground_below_it(tmp_path):
    """The beam bounds the height of a person who sits down at the end as that of one who does not."""
    feet = "{left_foot: {position: [0.6, 0.58, 0]}, right_foot: {position: [0.8, 0.58, 0]}"
    buttocks = "buttocks: {position: [0.7, 0.2, 0.48], settle_s: 0.6}"
    path = tmp_path / "seat.yaml"
    path.write_text(
        "extends: beam-H2C1\nname: seat\nsupports:\n  phases:\n"
        f"    - {{right_foot: {{position: [0.8, 0.58, 0]}}}}\n    - {feet}}}\n    - {feet}, {buttocks}}}\n"
        "scene:\n  - {name: beam, box: [0.05, 2.4, 0.05], position: [0.38, 0.4, 1.325]}\n"
        "  - {name: seat, padded: true, box: [0.5, 0.4, 0.48], position: [0.7, 0.1, 0.24]}\nvariants: null\n",
        encoding="utf-8",
    )
    (standing,), (seated,) = constraints(name="beam-H2C1"), constraints(name=str(path))
    under = np.array([0.38, 0.4, 0.8])
    assert seated.violation(under) == pytest.approx(standing.violation(under), abs=0.01)
