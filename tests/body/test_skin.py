"""The surface of a person: closed, of the body's volume, symmetric, and following its segments."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from manikin.body import human
from manikin.body.flesh import body_density
from manikin.body.skin import segment_frames, skin_of


@pytest.fixture(scope="module", params=[(1.75, 79.0, "male"), (1.55, 50.0, "female")], ids=["man", "woman"])
def person(request):
    stature, mass, sex = request.param
    body = human(stature, mass, sex=sex)
    return body, skin_of(body)


def test_the_surface_is_closed(person):
    """Each edge joins two triangles, which run along it in opposite directions, in one piece."""
    mesh = trimesh.Trimesh(person[1].vertices, person[1].faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1


def test_joints_lie_inside(person):
    """The solid angle of the surface, seen from a joint, is the whole sphere (Van Oosterom 1983)."""
    _, skin = person
    for joint in skin.origins:
        a, b, c = np.moveaxis(skin.vertices[skin.faces] - joint, 1, 0)
        sizes = [np.linalg.norm(each, axis=1) for each in (a, b, c)]
        dots = [np.sum(x * y, axis=1) for x, y in ((a, b), (b, c), (c, a))]
        above = np.sum(a * np.cross(b, c), axis=1)
        below = np.prod(sizes, axis=0) + dots[0] * sizes[2] + dots[1] * sizes[0] + dots[2] * sizes[1]
        assert 2.0 * np.arctan2(above, below).sum() == pytest.approx(4.0 * np.pi, rel=1e-9)


def test_volume_times_density_is_the_mass(person):
    """Within the 5 % that are asked for."""
    body, skin = person
    assert skin.volume * body_density(body.stature, body.own_mass) == pytest.approx(body.own_mass, rel=0.05)


def test_left_and_right_are_mirror_images(person):
    """Vertices have their mirror images among the vertices; where materials meet, the sides are cut apart.

    A cut divides triangles from the first corner on, which is another one in the mirror image: there a vertex
    may be away by a part of an edge, which is 11 mm long.
    """
    vertices = person[1].vertices
    away, _ = cKDTree(vertices).query(vertices * [1.0, -1.0, 1.0])
    assert np.mean(away < 1e-9) > 0.99
    assert away.max() < 5e-3


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
