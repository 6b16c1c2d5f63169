"""Surfaces of scenes of several obstacles: coplanar faces are one, hidden ones none."""

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from manikin.contact import sole
from manikin.errors import ContactError
from manikin.numerics.polytope import polygon_area
from manikin.numerics.spatial import rotation_from_rpy, rotation_from_yaw
from manikin.scene import Box, Capsule, Cylinder, FootingTable, HalfSpace, Mesh, Obstacle, Scene, Surface

FOOT = {"length": 0.28, "width": 0.10, "friction": 0.7}
SOLE = np.array([[0.14, 0.05], [0.14, -0.05], [-0.14, -0.05], [-0.14, 0.05]])
UP = (0.0, 0.0, 1.0)


def box(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Obstacle:
    return Obstacle(name, Box(np.subtract(high, low)), translation=0.5 * np.add(low, high))


def tops(scene: Scene) -> list[Surface]:
    return sorted(scene.surfaces_facing(UP, 0.01), key=lambda surface: surface.polygon[0, 2])


def test_the_ground_as_a_box_is_one_surface_with_the_floor():
    """A contact on it touches both; the sides of the box are in the ground and are no surfaces."""
    scene = Scene([box("ground", (-2, -2, -1), (2, 2, 0))])
    (ground,) = scene.surfaces
    assert ground.obstacles == ("floor", "ground")
    for x in (0.0, 1.95, 2.0, 5.0):
        assert scene.touched_obstacles(sole("left_foot", (x, 0.0, 0.0), **FOOT)) == ("floor", "ground")


@pytest.mark.parametrize("gap", [0.0, 0.0008])
def test_a_sole_across_two_coplanar_boxes_is_supported(gap):
    turn = rotation_from_rpy(0.1, -0.2, 0.7)
    items = [
        Obstacle(name, Box((0.4, 0.4, 0.2)), turn, turn @ (x, 0.0, -0.1))
        for name, x in (("a", 0.0), ("b", 0.4 + gap))
    ]
    scene = Scene(items, floor_height=None)
    contact = sole("left_foot", turn @ (0.2, 0.0, 0.0), rotation=turn, **FOOT)
    assert scene.touched_obstacles(contact) == ("a", "b")
    assert np.isclose(scene.supporting_surface(contact).area, 0.4 * (0.8 + gap), atol=1e-6)


def test_boxes_that_do_not_touch_or_are_not_level_are_surfaces_of_their_own():
    apart = Scene([box("a", (0, 0, 0), (0.4, 0.4, 0.2)), box("b", (0.402, 0, 0), (0.8, 0.4, 0.2))], None)
    uneven = Scene([box("a", (0, 0, 0), (0.4, 0.4, 0.2)), box("b", (0.4, 0, 0), (0.8, 0.4, 0.2015))], None)
    for scene in (apart, uneven):
        assert [surface.obstacles for surface in tops(scene)] == [("a",), ("b",)]
        with pytest.raises(ContactError):
            scene.supporting_surface(sole("left_foot", (0.4, 0.2, 0.2), **FOOT), 1e-3)


@pytest.mark.parametrize(("thick", "touched"), [(0.01, ("mat", "floor")), (0.03, ("mat",))])
def test_what_is_close_below_a_surface_is_touched_with_it(thick, touched):
    """A foot on a mat of 10 mm cannot keep 14 mm from the floor; the floor beside the mat is its own."""
    scene = Scene([box("mat", (-1, -1, 0), (1, 1, thick)), box("step", (1, -1, 0), (2, 1, 0.005))])
    surfaces = {surface.obstacles for surface in scene.surfaces_facing(UP, 0.01)}
    assert surfaces == {("floor",), touched, ("step", "floor")}
    assert scene.touched_obstacles(sole("left_foot", (0.0, 0.0, thick), **FOOT)) == touched


def test_the_ground_below_a_thin_sheet_is_touched_with_it():
    """An open mesh has no inside, and hides nothing: the floor below it stays a surface."""
    corners = np.array([[-1, -1, 0.01], [1, -1, 0.01], [1, 1, 0.01], [-1, 1, 0.01]], dtype=float)
    scene = Scene([Obstacle("sheet", Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])))])
    assert scene.touched_obstacles(sole("left_foot", (0.0, 0.0, 0.01), **FOOT)) == ("sheet", "floor")


def test_what_a_box_stands_on_is_no_surface_under_it():
    """The floor has a hole, the lower box another; faces that touch each other are gone."""
    scene = Scene([box("low", (0, 0, 0), (1, 1, 0.3)), box("high", (0.2, 0.2, 0.3), (0.6, 0.6, 0.5))])
    floor, low, high = tops(scene)
    assert np.isclose(low.area, 1.0 - 0.16, atol=1e-9)
    assert np.isclose(high.area, 0.16)
    assert len(floor.holes) == len(low.holes) == 1
    assert not scene.surfaces_facing((0, 0, -1), 0.1)
    points = np.array([[0.4, 0.4, 0.3], [0.1, 0.4, 0.3], [0.3, 0.4, 0.3]])
    assert np.allclose(low.outside(points), [0.2, 0.0, 0.1], atol=1e-9)
    assert np.isclose(floor.outside(np.array([[0.5, 0.9, 0.0]]))[0], 0.1, atol=1e-9)


def test_a_face_is_cut_at_the_solid_that_it_enters():
    """A box half in a wall; a tilted box in the floor: what is inside is not offered."""
    scene = Scene(
        [Obstacle("wall", HalfSpace((-1.0, 0, 0), -1.0)), box("shelf", (0.5, 0, 0.8), (1.5, 1, 0.9))]
    )
    (_, shelf) = tops(scene)
    assert np.isclose(shelf.area, 0.5, atol=1e-6)
    turn = rotation_from_rpy(0.0, -0.3, 0.0)
    (slope,) = Scene([Obstacle("ramp", Box((2.0, 1.0, 0.2)), turn)]).surfaces_facing(turn[:, 2], 0.01)
    # Its top passes through the floor 0.1 m / tan(0.3) from the middle, along the slope.
    assert np.isclose(slope.area, 1.0 + 0.1 / np.tan(0.3), atol=0.005)


def test_a_building_as_one_mesh_has_the_surfaces_of_its_boxes():
    """Stairs of touching boxes: each tread, whether they are obstacles or pieces of one mesh."""
    solids = [box(f"step{k}", (0.3 * k, 0, 0), (0.3 * k + 0.3, 1, 0.15 * k + 0.15)) for k in range(4)]
    mesh = trimesh.util.concatenate([item.to_trimesh() for item in solids])
    boxes, building = Scene(solids), Scene([Obstacle("stairs", Mesh(mesh.vertices, mesh.faces))])
    areas = [sorted(surface.area for surface in scene.surfaces) for scene in (boxes, building)]
    assert np.allclose(*areas)
    assert len(tops(building)) == 5
    assert np.isclose(building.surfaces[0].area, boxes.surfaces[0].area)


def test_surfaces_do_not_depend_on_where_the_scene_is():
    turn, shift = rotation_from_yaw(1.1), np.array([7.0, -3.0, 0.4])
    rng = np.random.default_rng(5)
    plain = [
        Obstacle(f"b{k}", Box(rng.uniform(0.2, 0.6, 3)), rotation_from_yaw(rng.uniform(0, 6)), (*at, 0.1))
        for k, at in enumerate(rng.uniform(-1, 1, (8, 2)))
    ]
    moved = [
        Obstacle(item.name, item.shape, turn @ item.rotation, turn @ item.translation + shift)
        for item in plain
    ]
    first, second = Scene(plain).surfaces, Scene(moved, floor_height=0.4).surfaces
    assert [item.obstacles for item in first] == [item.obstacles for item in second]
    for one, other in zip(first[1:], second[1:], strict=True):
        assert np.allclose(one.polygon @ turn.T + shift, other.polygon, atol=3e-9)


def test_footing_is_the_overlap_of_sole_and_surface():
    """Share, support and polygon of random soles on random surfaces are those of GEOS."""
    rng = np.random.default_rng(11)
    items = [
        Obstacle(f"b{k}", Box((*rng.uniform(0.1, 0.6, 2), 0.3)), rotation_from_yaw(turn), (*at, 0.0))
        for k, (turn, *at) in enumerate(rng.uniform(-1, 1, (9, 3)))
    ]
    table = FootingTable(Scene(items).surfaces_facing(UP, 0.1), SOLE)
    places = table.under(rng.uniform(-1.3, 1.3, (150, 2)), rng.uniform(-4, 4, 150))
    footing = table.place(places.numbers, places.positions, places.rotations)
    whole = shapely.Polygon(SOLE)
    kinds = set()
    for row, number in enumerate(places.numbers):
        surface = table.surfaces[number]
        rings = [(ring - places.positions[row]) @ places.rotations[row][:, :2]
                 for ring in (surface.polygon, *surface.holes)]  # fmt: skip
        overlap = shapely.Polygon(rings[0], rings[1:]).intersection(whole)
        share, hull = overlap.area / whole.area, overlap.convex_hull
        assert np.isclose(footing.share[row], share, atol=1e-12)
        assert footing.stands[row] == (share >= 0.6 and hull.contains(shapely.Point(0.0, 0.0)))
        polygon = footing.polygon(row)
        if share > 1e-9:
            assert 3 <= len(polygon) <= 8
            assert np.isclose(shapely.Polygon(polygon).area, hull.area, rtol=0.02)
            assert hull.buffer(1e-9).contains(shapely.Polygon(polygon))
        kinds.add((share > 0.0) + (share > 0.6) + (share > 1.0 - 1e-6))
    assert kinds == {0, 1, 2, 3}


@pytest.mark.parametrize("lean", [0.0, 0.2])
def test_many_soles_at_once_lie_as_single_ones_do(lean):
    """On rectangles, also leaning ones and ones narrower than a sole, on what others cut away, and on discs.

    Cut by edges and clipped, the areas agree to rounding; a sole that stands is near its surface.
    """
    rng = np.random.default_rng(5)
    items = []
    for turn, *at in rng.uniform(-1, 1, (9, 3)):
        leaning = rotation_from_rpy(*rng.uniform(-lean, lean, 2), turn)
        size = (*rng.uniform(0.05, 0.6, 2), 0.3)
        items.append(Obstacle(f"b{len(items)}", Box(size), leaning, (*at, 0.0)))
    items.append(Obstacle("disc", Cylinder(0.3, 0.6), translation=(0.3, 0.2, 0.0)))
    table = FootingTable(Scene(items).surfaces_facing(UP, 0.5), SOLE)
    xy, yaw = rng.uniform(-1.3, 1.3, (3000, 2)), rng.uniform(-4, 4, 3000)
    places = table.under(xy, yaw)
    footing = table.place(places.numbers, places.positions, places.rotations)
    np.testing.assert_allclose(
        table.standing(places), np.where(footing.stands, footing.share, 0.0), rtol=0.0, atol=1e-12
    )
    np.testing.assert_array_equal(table.meets(places, 0.3), footing.share > 0.3)
    assert table.near(places, 0.0)[footing.stands].all()
    assert 0.2 < footing.stands.mean() < 0.8
    level = table.under(xy, yaw, 0.1, 0.25)
    between = (places.positions[:, 2] >= 0.1) & (places.positions[:, 2] <= 0.25)
    np.testing.assert_array_equal(level.positions, places.positions[between])


def test_footing_with_a_corner_below_the_middle_of_the_sole():
    """A quarter of the sole is on the box, the middle on its corner: it does not stand there."""
    table = FootingTable(Scene([box("a", (0, 0, 0), (1, 1, 0.2))]).surfaces_facing(UP, 0.1)[1:], SOLE)
    places = np.array([[0.0, 0.0, 0.2], [0.5, 0.0, 0.2], [0.0, 0.5, 0.2], [0.0, 1.0, 0.2]])
    footing = table.place(np.zeros(4, dtype=int), places, np.tile(np.eye(3), (4, 1, 1)))
    assert np.allclose(footing.share, [0.25, 0.5, 0.5, 0.25])
    assert not footing.stands.any()


def test_bars_that_a_hand_can_close_round_have_grasp_lines():
    """Rails of up to 51 mm, square ones of up to 40 mm; not beams, nor where a post or wall is in the way."""
    turn = rotation_from_rpy(0.0, np.pi / 2, 0.3)
    items = [
        Obstacle("rail", Cylinder(0.02, 2.0), turn, (0.0, 0.0, 0.9)),
        Obstacle("post", Box((0.06, 0.06, 0.88)), translation=(0.0, 0.0, 0.44)),
        Obstacle("rung", Box((0.03, 0.4, 0.03)), translation=(2.0, 0.0, 1.0)),
        Obstacle("pipe", Capsule(0.03, 1.0), translation=(3.0, 0.0, 1.0)),
        Obstacle("beam", Box((0.10, 2.0, 0.05)), translation=(4.0, 0.0, 1.0)),
        Obstacle("wall", Box((0.1, 2.0, 2.0)), translation=(5.0, 0.0, 1.0)),
        Obstacle("tight", Cylinder(0.02, 1.0), rotation_from_rpy(np.pi / 2, 0.0, 0.0), (4.92, 0.0, 1.0)),
    ]
    scene = Scene(items)
    assert [line.obstacle for line in scene.grasp_lines] == ["rail", "rail", "rung"]
    first, second, rung = scene.grasp_lines
    assert rung.length == pytest.approx(0.4 - 0.085)
    assert not rung.round
    # 2 m less half a hand at both ends, and less what is around the post.
    ends = np.array([first.start, first.end, second.start, second.end]) @ turn[:, 2]
    assert np.abs(ends).max() == pytest.approx(1.0 - 0.0425)
    assert 0.05 < np.sort(np.abs(ends))[0] < 0.12
    strips = scene.holds[len(scene.surfaces) :]
    assert len(strips) == 16
    for strip in strips:
        axis_point = first.nearest(strip.centre) if strip.centre @ turn[:, 2] * ends[0] > 0 else None
        if axis_point is not None:
            assert (strip.centre - axis_point) @ strip.normal == pytest.approx(0.02)
        assert abs(strip.normal @ turn[:, 2]) < 1e-9


def plank_onto_block():
    """Feet on a plank 0.264 m wide that ends at a block 0.8 m wide, and the number of their one surface."""
    items = [
        box("block", (0.0, -0.4, 0.0), (0.8, 0.4, 0.3)),
        box("plank", (-1.0, -0.132, 0.25), (0.0, 0.132, 0.3)),
    ]
    table = FootingTable(Scene(items, None).surfaces_facing(UP, 0.5), SOLE)
    return table, next(k for k, item in enumerate(table.surfaces) if len(item.obstacles) == 2)


@given(st.floats(-0.4, 0.2), st.floats(-0.2, 0.2), st.floats(-np.pi, np.pi))
def test_a_sole_on_a_corner_inwards_touches_with_a_convex_piece(x, y, yaw):
    """All of its polygon lies on plank or block, or no such piece is large enough and the hull is left."""
    table, top = plank_onto_block()
    place, turn = np.array([x, y, 0.3]), rotation_from_yaw(yaw)
    footing = table.place([top], place[None], turn[None])
    polygon, hull = table.polygon(top, place, turn), footing.polygon(0)
    if footing.stands[0] and not np.array_equal(polygon, hull):
        weights = np.random.default_rng(0).dirichlet(np.ones(len(polygon)), 200)
        x, y = ((weights @ polygon) @ turn[:2, :2].T + place[:2]).T
        on_block = (x >= -1e-9) & (x <= 0.8 + 1e-9) & (np.abs(y) <= 0.4 + 1e-9)
        assert (on_block | ((x <= 1e-9) & (np.abs(y) <= 0.132 + 1e-9))).all()
        assert 0.6 * 0.28 * 0.10 - 1e-9 <= polygon_area(polygon) < polygon_area(hull)


def test_toes_on_a_block_and_a_heel_on_a_plank_do_not_span_the_notch_between():
    """22 mm of the heel hang over beside the plank: so much less of the sole touches, along all of it."""
    table, top = plank_onto_block()
    polygon = table.polygon(top, np.array([-0.12, -0.104, 0.3]), np.eye(3))
    assert polygon[:, 1].min() == pytest.approx(-0.028)
    assert polygon_area(polygon) == pytest.approx(0.28 * 0.078)
