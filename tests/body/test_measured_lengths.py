"""A human with lengths that were measured instead of scaled."""

import pickle
from math import fsum

import numpy as np
import pytest

from manikin.body import human
from manikin.body.human import body_from_signature
from manikin.errors import BodyError

LENGTHS = {
    "hips": 0.21, "thigh": 0.46, "shank": 0.47, "trunk": 0.48,
    "shoulders": 0.41, "upper_arm": 0.29, "forearm": 0.275,
}  # fmt: skip


def apart(body, first, second):
    """Distance of two segments' origins in the zero posture along their common chain, by components."""
    places = {}
    for segment in body.segments:
        places[segment.name] = np.array(segment.origin) + places.get(segment.parent, 0.0)
    return np.abs(places[first] - places[second])


def test_joints_are_as_far_apart_as_given():
    body = human(1.8, 75.0, lengths=LENGTHS)
    assert apart(body, "left_thigh", "right_thigh")[1] == pytest.approx(0.21)
    assert apart(body, "left_upper_arm", "right_upper_arm")[1] == pytest.approx(0.41)
    assert apart(body, "left_thigh", "left_leg")[2] == pytest.approx(0.46)
    assert apart(body, "left_leg", "left_foot")[2] == pytest.approx(0.47)
    assert apart(body, "left_thigh", "left_upper_arm")[2] == pytest.approx(0.48)
    assert apart(body, "left_upper_arm", "left_forearm")[2] == pytest.approx(0.29)
    assert apart(body, "left_forearm", "left_hand")[2] == pytest.approx(0.275)
    assert fsum(segment.mass for segment in body.segments) == pytest.approx(75.0)


def test_measuring_the_scaled_lengths_changes_nothing():
    plain = human(1.8, 75.0)
    thigh = float(apart(plain, "left_thigh", "left_leg")[2])
    trunk = float(apart(plain, "left_thigh", "left_upper_arm")[2])
    same = human(1.8, 75.0, lengths={"thigh": thigh, "trunk": trunk})
    for ours, theirs in zip(same.segments, plain.segments, strict=True):
        np.testing.assert_allclose(ours.origin, theirs.origin, atol=1e-12)
        np.testing.assert_allclose(ours.inertia, theirs.inertia, atol=1e-12)


def test_lengths_are_kept():
    body = human(1.8, 75.0, lengths=LENGTHS)
    again = body_from_signature(body.signature())
    assert dict(again.lengths) == LENGTHS
    assert dict(pickle.loads(pickle.dumps(body)).lengths) == LENGTHS
    assert "thigh_length" not in human().signature()


def test_wrong_lengths_are_said():
    with pytest.raises(BodyError, match="body length of 'tail'"):
        human(lengths={"tail": 0.3})
    with pytest.raises(BodyError, match=r"body length of thigh \[m\]"):
        human(lengths={"thigh": 4.6})
    with pytest.raises(BodyError, match="shank"):
        human(lengths={"shank": float("nan")})
