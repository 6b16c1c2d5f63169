"""The published numbers, their scaling and the refusal of nonsense."""

import numpy as np
import pytest

from manikin.body import Anthropometry, human
from manikin.body.anthropometry import DE_LEVA, SAMPLE_STATURE, Sex
from manikin.errors import BodyError


def masses(body):
    return {segment.name: segment.mass for segment in body.segments}


def test_segment_masses_of_de_levas_mean_man():
    """At 73.0 kg each segment has de Leva's percentage of the body mass (male sum 100.00 %)."""
    mass = masses(human(1.741, 73.0, "male"))
    assert mass["left_thigh"] == pytest.approx(0.1416 * 73.0, rel=1e-9)
    assert mass["right_leg"] == pytest.approx(0.0433 * 73.0, rel=1e-9)
    assert mass["left_upper_arm"] == pytest.approx(0.0271 * 73.0, rel=1e-9)
    assert mass["left_forearm"] == pytest.approx(0.0162 * 73.0, rel=1e-9)
    assert mass["left_hand"] == pytest.approx(0.0061 * 73.0, rel=1e-9)
    assert mass["left_foot"] + mass["left_toes"] == pytest.approx(0.0137 * 73.0, rel=1e-9)
    assert mass["head"] + mass["neck"] == pytest.approx(0.0694 * 73.0, rel=1e-9)
    trunk = mass["pelvis"] + mass["lumbar"] + mass["thorax"]
    assert trunk == pytest.approx(0.4346 * 73.0, rel=1e-9)


def test_segment_masses_of_de_levas_mean_woman():
    """The printed female percentages add up to 99.99 %, so each is stretched by 1e-4."""
    mass = masses(human(1.735, 61.9, "female"))
    assert mass["left_thigh"] == pytest.approx(0.1478 * 61.9, rel=2e-4)
    assert mass["pelvis"] == pytest.approx(0.1247 * 61.9, rel=2e-4)


@pytest.mark.parametrize(("sex", "length", "com", "longitudinal"), [
    ("male", 0.6033, 0.5138, 0.169), ("female", 0.6148, 0.4964, 0.147),
])  # fmt: skip
def test_trunk_parts_compose_to_de_levas_whole_trunk(sex, length, com, longitudinal):
    """Upper, middle and lower trunk stacked reproduce the table's own CERV-MIDH row.

    Women's rows agree to the printed digits; the men's parts give a centre of mass 3 mm lower than
    the men's whole trunk, an inconsistency of the table itself.
    """
    rows = [DE_LEVA[Sex(sex)][name] for name in ("upper_trunk", "middle_trunk", "lower_trunk")]
    assert sum(row.length for row in rows) == pytest.approx(length, abs=1.1e-3)
    mass = np.array([row.mass for row in rows])
    start = np.concatenate([[0.0], np.cumsum([row.length for row in rows])[:-1]])
    centre = start + np.array([row.com * row.length for row in rows])
    assert mass @ centre / mass.sum() / length == pytest.approx(com, abs=0.006)
    radius = np.sqrt(mass @ np.array([(row.radii[2] * row.length) ** 2 for row in rows]) / mass.sum())
    assert radius / length == pytest.approx(longitudinal, abs=0.001)


def test_thigh_inertia_has_de_levas_radii_of_gyration():
    """Fore-aft and left-right radii 0.329, longitudinal 0.149 of the hip-knee distance."""
    thigh = human(1.741, 73.0, "male").segment("left_thigh")
    length = Anthropometry(1.741, 73.0, "male").length("thigh")
    radii = np.sqrt(np.diag(thigh.inertia) / thigh.mass) / length
    np.testing.assert_allclose(radii, [0.329, 0.329, 0.149], rtol=1e-12)
    assert thigh.com[2] / length == pytest.approx(-0.4095, rel=1e-12)


def test_hand_inertia_is_turned_with_the_inward_palm():
    """De Leva's fore-aft axis of the forward palm is our left-right axis of the inward palm."""
    hand = human(1.741, 73.0, "male").segment("left_hand")
    length = Anthropometry(1.741, 73.0, "male").length("hand")
    radii = np.sqrt(np.diag(hand.inertia) / hand.mass) / length
    np.testing.assert_allclose(radii, [0.235, 0.288, 0.184], rtol=1e-12)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_vertical_lengths_are_close_to_the_published_ones(sex):
    """Fitting legs, trunk and head to the stature changes no length by more than 2.5 %."""
    size = Anthropometry(SAMPLE_STATURE[Sex(sex)], 70.0, sex)
    assert 0.975 < size.vertical_scale < 1.0


def _composite(parts):
    """Mass, centre and inertia about it of (offset, segment) pairs."""
    mass = sum(s.mass for _, s in parts)
    com = sum(s.mass * (offset + s.com) for offset, s in parts) / mass
    inertia = np.zeros((3, 3))
    for offset, s in parts:
        arm = offset + s.com - com
        inertia += s.inertia + s.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, com, inertia


@pytest.mark.parametrize("sex", ["male", "female"])
def test_neck_and_head_together_keep_the_published_inertia(sex):
    body, size = human(1.70, 70.0, sex), Anthropometry(1.70, 70.0, sex)
    head = body.segment("head")
    mass, com, inertia = _composite([(np.zeros(3), body.segment("neck")), (head.origin, head)])
    assert mass == pytest.approx(size.segment_mass("head_and_neck"), rel=1e-12)
    vertex = size.length("head_and_neck")
    np.testing.assert_allclose(com, [0, 0, vertex - size.com_from_start("head_and_neck")], atol=1e-12)
    np.testing.assert_allclose(inertia, np.diag(size.moments("head_and_neck")), atol=1e-12)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_foot_and_toes_together_keep_the_published_inertia(sex):
    """The heel-toe axis of the table is our x axis."""
    body, size = human(1.70, 70.0, sex, sole_length=0.28), Anthropometry(1.70, 70.0, sex)
    toes = body.segment("left_toes")
    mass, _, inertia = _composite([(np.zeros(3), body.segment("left_foot")), (toes.origin, toes)])
    assert mass == pytest.approx(size.segment_mass("foot"), rel=1e-12)
    vertical, transverse, longitudinal = size.moments("foot")
    np.testing.assert_allclose(inertia, np.diag([longitudinal, transverse, vertical]), atol=1e-12)


@pytest.mark.parametrize(("change", "words"), [
    ({"stature": 3.0}, "stature"), ({"stature": 0.8}, "stature"), ({"mass": -79.0}, "mass"),
    ({"mass": 300.0}, "mass"), ({"stature": float("nan")}, "stature"), ({"mass": float("inf")}, "mass"),
    ({"sex": "robot"}, "male, female"), ({"sex": ""}, "male, female"), ({"mass": "79"}, "mass"),
    ({"mass": True}, "mass"), ({"stature": None}, "stature"), ({"sole_length": 2.0}, "sole_length"),
    ({"sole_width": 0.0}, "sole_width"), ({"stature": 2.1, "mass": 36.0}, "kg/m^2"),
    ({"stature": 1.4, "mass": 150.0}, "kg/m^2"),
])  # fmt: skip
def test_nonsense_is_refused_with_one_line(change, words):
    with pytest.raises(BodyError) as caught:
        human(**{"stature": 1.75, "mass": 79.0, "sex": "male", **change})
    message = str(caught.value)
    assert words in message
    assert "valid" in message
    assert "\n" not in message
