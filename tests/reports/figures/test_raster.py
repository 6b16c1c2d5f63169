"""Shaded pictures: silhouettes, what hides what, what is seen through, shadows."""

import numpy as np
import pytest
import trimesh

from manikin.reports.figures import raster
from manikin.reports.figures.raster import Camera, hiding, nearness, picture
from manikin.reports.solids import DrawnSolid, body_solid, scene_solids
from manikin.scene import Box, Mesh, Obstacle, Scene

AHEAD = Camera.at(0.0, 0.0, np.zeros(3))
WINDOW = (-1.0, 1.0, -1.0, 1.0)
RED, BLUE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.fixture(autouse=True)
def as_fine_as_they_are_drawn(monkeypatch):
    """Four points are computed for a pixel, which other tests do without."""
    monkeypatch.setattr(raster, "FINER", 2)


def solid(mesh, colour, name, smooth=False):
    normals = np.array(mesh.vertex_normals) if smooth else None
    return DrawnSolid(
        name, np.array(mesh.vertices), np.array(mesh.faces), np.tile(colour, (len(mesh.faces), 1)), normals
    )


def ball(radius=0.5, at=(0.0, 0.0, 0.0)):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return solid(mesh.apply_translation(at), RED, "ball", smooth=True)


def board(x, half=0.4, colour=BLUE):
    """A thin square across the line of sight, at x."""
    return solid(
        trimesh.creation.box([0.01, 2 * half, 2 * half]).apply_translation([x, 0.0, 0.0]), colour, "board"
    )


def reddish(image):
    return (image[..., 0] > image[..., 2].astype(int) + 30) & (image[..., 0] > image[..., 1].astype(int) + 30)


def test_a_ball_covers_its_circle_and_is_as_near_as_its_surface():
    near = nearness([ball()], AHEAD, WINDOW, 200.0)
    # A chord of the icosphere lies at most 0.2 % inside; a ring of pixels is 1 % of the circle.
    assert np.count_nonzero(near > -np.inf) / 200.0**2 == pytest.approx(np.pi * 0.25, rel=0.01)
    y = (np.arange(400) + 0.5) / 200.0 - 1.0
    inside = np.abs(y) < 0.45
    np.testing.assert_allclose(near[200, inside], np.sqrt(0.25 - y[inside] ** 2 - 0.0025**2), atol=2e-3)


@pytest.mark.parametrize(("x", "visible"), [(-1.0, 1.0), (1.0, 0.0)])
def test_what_is_nearer_hides_what_is_behind_it(x, visible):
    image = picture([ball(0.3), board(x)], AHEAD, WINDOW, 100.0, shadows=False)
    alone = picture([ball(0.3)], AHEAD, WINDOW, 100.0, shadows=False)
    assert reddish(image).sum() == pytest.approx(visible * reddish(alone).sum(), rel=0.05)


def test_what_hides_much_of_a_body_is_seen_through():
    body, before, behind = ball(0.3), board(1.0), board(-1.0)
    assert hiding([body], [before], AHEAD, WINDOW) == {"board"}
    assert hiding([body], [behind], AHEAD, WINDOW) == set()
    assert hiding([body], [board(1.0, half=0.03)], AHEAD, WINDOW) == set()
    image = picture([body, before], AHEAD, WINDOW, 100.0, clear=("board",), shadows=False)
    assert reddish(image)[100, 100]


def test_places_in_a_picture_lead_back_to_the_world():
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3))
    for camera in (AHEAD, Camera.at(1.0, 0.4, np.array([0.1, 0.2, 0.3]), 5.0)):
        np.testing.assert_allclose(camera.world(camera.seen(points)), points, atol=1e-12)


def test_straight_lines_stay_straight_and_near_things_look_larger():
    camera = Camera.at(0.0, 0.0, np.zeros(3), 4.0)
    line = np.linspace([1.0, -1.0, 0.5], [-1.0, 1.0, -0.3], 9)
    x, y = camera.project(line).T
    np.testing.assert_allclose((x - x[0]) * (y[-1] - y[0]), (y - y[0]) * (x[-1] - x[0]), atol=1e-12)
    near, far = (np.ptp(camera.project(np.array([[d, 0.0, 0.0], [d, 1.0, 0.0]]))[:, 0]) for d in (1.0, -1.0))
    assert near / far == pytest.approx(5.0 / 3.0)


def test_the_floor_is_darker_in_the_shadow():
    above = Camera.at(0.0, np.pi / 2 - 1e-6, np.zeros(3))
    lit, shaded = (
        picture([ball(0.3, (0.0, 0.0, 0.6))], above, (-2, 2, -2, 2), 60.0, floor=-0.0, shadows=shadows)
        for shadows in (False, True)
    )
    darker = (lit.astype(int) - shaded).sum(axis=-1) > 40
    # The lamp stands 0.95 rad high, so the shadow of a ball is an ellipse of pi r^2 / sin(0.95).
    hidden_by_ball = reddish(lit)
    area = np.count_nonzero(darker & ~hidden_by_ball) / 60.0**2
    assert 0.3 * np.pi * 0.09 < area <= 1.05 * np.pi * 0.09 / np.sin(0.95)


def test_a_mesh_is_shown_as_it_is_and_not_as_its_hull():
    """Through the hole of a ring the paper is seen."""
    ring = trimesh.creation.annulus(r_min=0.3, r_max=0.6, height=0.1)
    scene = Scene([Obstacle("ring", Mesh(ring.vertices, ring.faces))], floor_height=None)
    (shown,) = scene_solids(scene, np.full(3, -2.0), np.full(3, 2.0))
    near = nearness([shown], Camera.at(0.0, np.pi / 2 - 1e-6, np.zeros(3)), WINDOW, 100.0)
    assert near[100, 100] == -np.inf
    assert near[100, 145] > -np.inf


def test_obstacles_end_where_the_picture_of_them_ends():
    scene = Scene([Obstacle("wall", Box([30.0, 0.1, 2.0]))], floor_height=None)
    (wall,) = scene_solids(scene, np.full(3, -1.5), np.full(3, 1.5))
    np.testing.assert_allclose(np.ptp(wall.vertices, axis=0), [3.0, 0.1, 2.0], atol=1e-9)


def test_a_person_is_shown_by_the_surface_and_marked_limbs_by_their_colour(finished_run):
    body, q = finished_run.body, finished_run.planned.q[0]
    person = body_solid(body, q, ["right_hand"])
    assert person is not None
    assert person.normals is not None
    assert trimesh.Trimesh(person.vertices, person.faces, process=False).is_watertight
    marked = np.all(np.isclose(person.colours, [0xD5 / 255, 0x5E / 255, 0.0]), axis=1)
    hand = np.array(person.vertices[person.faces[marked].ravel()])
    others = body_solid(body, q)
    assert others is not None
    assert not np.any(np.all(np.isclose(others.colours, [0xD5 / 255, 0x5E / 255, 0.0]), axis=1))
    assert np.ptp(hand, axis=0).max() < 0.3
