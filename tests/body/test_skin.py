"""The surface of a person: closed, of the body's volume, symmetric, and following its segments."""

import numpy as np
import pytest

from manikin.body import human
from manikin.body.flesh import body_density
from manikin.body.skin import segment_frames, skin_of


@pytest.fixture(scope="module", params=[(1.75, 79.0, "male"), (1.55, 50.0, "female")], ids=["man", "woman"])
def person(request):
    stature, mass, sex = request.param
    body = human(stature, mass, sex=sex)
    return body, skin_of(body)


def test_the_surface_is_closed(person):
    """Each directed edge is met by as many opposite ones: nothing has a border."""
    faces = person[1].faces
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there = np.sort(edges @ [len(person[1].vertices), 1])
    back = np.sort(edges[:, ::-1] @ [len(person[1].vertices), 1])
    assert np.array_equal(there, back)


def test_volume_times_density_is_the_mass(person):
    """Within the 5 % that are asked for."""
    body, skin = person
    assert skin.volume * body_density(body.stature, body.own_mass) == pytest.approx(body.own_mass, rel=0.05)


def test_left_and_right_are_mirror_images(person):
    """The half is mirrored, then cut where materials change: vertices pair up to rounding."""
    vertices = person[1].vertices
    assert vertices[:, 1].max() == pytest.approx(-vertices[:, 1].min(), abs=1e-9)
    assert abs(np.sum(vertices[:, 1])) < 1e-3 * len(vertices)


def test_weights_sum_to_one_over_segments_of_the_body(person):
    body, skin = person
    assert np.abs(skin.weights.sum(axis=1) - 1.0).max() < 1e-12
    assert skin.segments == tuple(segment.name for segment in body.segments)
    assert skin.bones.max() < len(skin.segments)


def test_a_moved_and_turned_body_moves_and_turns_its_surface(person):
    """Rigid motions of the root carry over exactly; every segment has the surface around its joint."""
    body, skin = person
    q = body.standing_posture()
    still, _ = skin.posed(*segment_frames(body, q))
    moved = q.copy()
    moved[:3] += [1.0, -2.0, 0.5]
    moved[3:7] = [0.0, 0.0, np.sin(0.4), np.cos(0.4)]
    turn = np.array([[np.cos(0.8), -np.sin(0.8), 0.0], [np.sin(0.8), np.cos(0.8), 0.0], [0.0, 0.0, 1.0]])
    found, _ = skin.posed(*segment_frames(body, moved))
    assert found == pytest.approx((still - q[:3]) @ turn.T + moved[:3], abs=1e-12)
    # The surface made for another posture stands as high as the body, hair and shoes within 3 cm.
    assert np.ptp(still[:, 2]) == pytest.approx(body.stature, abs=0.03)


def test_equal_bodies_share_one_surface():
    assert skin_of(human(1.75, 79.0)) is skin_of(human(1.75, 79.0))
