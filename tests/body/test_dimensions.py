"""A human with given outer dimensions: the built body has them, its stature and its mass."""

from math import fsum

import pytest

from manikin.body import human, measured_dimensions
from manikin.body.dimensions import DIMENSIONS
from manikin.body.human import body_from_signature
from manikin.errors import BodyError, ScenarioError
from manikin.scenarios import load_scenario

# Means of ANSUR II: stature, mass, and the dimensions in the order of DIMENSIONS.
MEAN = {
    "male": (1.75621, 85.52, (0.91829, 0.90093, 0.60312, 0.41568, 0.34573)),
    "female": (1.62847, 67.76, (0.85663, 0.84535, 0.55253, 0.36535, 0.35384)),
}


def mean_person(sex):
    stature, mass, values = MEAN[sex]
    return stature, mass, dict(zip(DIMENSIONS, values, strict=True))


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize("longer", [-0.03, 0.0, 0.03])
def test_the_built_body_has_the_dimensions_stature_and_mass(sex, longer):
    """Within 1e-9 m and kg; trunk and legs trade places at one stature, arms and breadths vary alone."""
    stature, mass, wished = mean_person(sex)
    signs = {"sitting_height": 1, "leg_length": -1, "arm_length": 1, "shoulder_breadth": -1, "hip_breadth": 1}
    wished = {name: value + signs[name] * longer for name, value in wished.items()}
    body = human(stature, mass, sex, dimensions=wished)
    assert measured_dimensions(body) == pytest.approx({"stature": stature} | wished, abs=1e-9)
    assert fsum(segment.mass for segment in body.segments) == pytest.approx(mass, abs=1e-9)
    again = body_from_signature(body.signature())
    assert measured_dimensions(again) == pytest.approx(measured_dimensions(body), abs=1e-12)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_a_mean_sitting_height_gives_the_mean_height_of_the_hips(sex):
    """Published means alone: 0.1 mm is their last digit."""
    stature, mass, wished = mean_person(sex)
    body = human(stature, mass, sex, dimensions={"sitting_height": wished["sitting_height"]})
    assert measured_dimensions(body)["leg_length"] == pytest.approx(wished["leg_length"], abs=1e-4)


def test_without_dimensions_the_body_is_the_scaled_one():
    plain, same = human(1.8, 75.0), human(1.8, 75.0, dimensions={})
    assert same.signature() == plain.signature()
    assert measured_dimensions(plain)["stature"] == pytest.approx(1.8, abs=1e-12)


def test_contradictions_and_unknown_names_are_said():
    with pytest.raises(BodyError, match="body dimension is 'neck'; valid: sitting_height"):
        human(dimensions={"neck": 0.4})
    with pytest.raises(BodyError, match=r"body sitting_height 1 m and leg_length 1 m exceed the stature"):
        human(dimensions={"sitting_height": 1.0, "leg_length": 1.0})
    with pytest.raises(BodyError, match=r"body arm_length \[m\]"):
        human(dimensions={"arm_length": 3.0})


def test_the_body_section_takes_them():
    job = load_scenario("platform", overrides=["body.sitting_height_m=0.9", "body.hip_breadth_m=0.4"])
    dimensions = measured_dimensions(job.build_body())
    assert dimensions["sitting_height"] == pytest.approx(0.9, abs=1e-9)
    assert dimensions["hip_breadth"] == pytest.approx(0.4, abs=1e-9)
    with pytest.raises(ScenarioError, match="does not apply to an insect"):
        load_scenario("insect-books", overrides=["body.leg_length_m=0.9"])
