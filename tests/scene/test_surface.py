import numpy as np
import pytest
import trimesh

from manikin.contact import sole
from manikin.errors import ContactError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, load_mesh
from manikin.scene.surface import faces_of


def test_a_box_has_six_faces_pointing_out_with_the_right_areas():
    item = Obstacle("box", Box((1.0, 2.0, 3.0)), rotation_from_rpy(0.3, 0.5, -0.7), (1.0, 2.0, 3.0))
    faces = faces_of(item)
    assert sorted(round(face.area, 9) for face in faces) == [2, 2, 3, 3, 6, 6]
    for face in faces:
        assert (face.centre - item.translation) @ face.normal > 0
        assert np.allclose(face.height(face.polygon), 0.0, atol=1e-12)
    assert np.allclose(sum(face.normal for face in faces), 0.0, atol=1e-12)


def test_a_mesh_box_has_the_faces_of_the_box():
    box = Box((1.0, 2.0, 3.0))
    shape = trimesh.creation.box(box.size)
    faces = faces_of(Obstacle("mesh", Mesh(shape.vertices, shape.faces)))
    wanted = faces_of(Obstacle("box", box))
    assert len(faces) == 6
    for face in wanted:
        (same,) = [other for other in faces if np.allclose(other.normal, face.normal)]
        assert np.isclose(same.area, face.area)
        assert np.allclose(same.centre, face.centre)


def test_blocks_of_one_mesh_that_stand_against_each_other_are_read(tmp_path):
    """Their common side is there twice, turned either way; of a reader of OBJ files half of each was left."""
    sides = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    corners = [(x, y, z) for z in (0.0, 0.4) for y in (0.0, 3.0) for x in (0.0, 0.3)]
    lines = [f"v {x + 0.3 * k} {y} {z}" for k in (0, 1) for x, y, z in corners]
    lines += ["f " + " ".join(str(corner + 8 * k) for corner in side) for k in (0, 1) for side in sides]
    (tmp_path / "blocks.obj").write_text("\n".join(lines))
    faces = faces_of(Obstacle("blocks", load_mesh(tmp_path / "blocks.obj")))
    for normal, area in (((0, 0, 1), 1.8), ((0, 1, 0), 0.24)):
        assert np.isclose(sum(face.area for face in faces if np.allclose(face.normal, normal)), area)
    assert np.isclose(min(face.centre[0] for face in faces if np.allclose(face.normal, (-1, 0, 0))), 0.0)


def test_an_l_shaped_facet_keeps_its_notch():
    """A concave polygon, extruded: points in the notch are outside."""
    corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    solid = trimesh.creation.extrude_triangulation(corners, triangles, height=0.5)
    scene = Scene([Obstacle("step", Mesh(solid.vertices, solid.faces))], floor_height=None)
    (top,) = scene.surfaces_facing((0, 0, 1), 0.01)
    assert np.isclose(top.area, 3.0)
    points = np.array([[0.5, 0.5, 0.5], [1.5, 1.5, 0.5], [0.5, 1.9, 0.5], [2.5, 0.5, 0.5]])
    assert np.allclose(top.outside(points), [0.0, 0.5, 0.0, 0.5])


def test_cylinder_caps_planes_and_half_spaces_face_the_right_way():
    top, bottom = faces_of(Obstacle("stool", Cylinder(0.2, 0.5), translation=(0, 0, 0.25)))
    assert np.allclose(top.normal, (0, 0, 1))
    assert np.allclose(bottom.normal, (0, 0, -1))
    # A 32-gon has the circle's area up to a factor sin(2 pi / 32) / (2 pi / 32) = 0.9936.
    assert np.isclose(top.area, np.pi * 0.04 * 0.9936, rtol=1e-4)
    assert np.isclose(bottom.area, top.area)
    assert len(faces_of(Obstacle("wall", HalfSpace((1, 0, 0), 2.0)))) == 1
    front, back = faces_of(Obstacle("sheet", Plane((1, 0, 0), 2.0)))
    assert np.allclose(front.normal, -back.normal)
    assert np.allclose(front.polygon[:, 0], 2.0)
    assert faces_of(Obstacle("bar", Capsule(0.02, 1.0))) == ()


def test_a_sole_lies_across_a_level_round_bar_and_on_no_steep_one():
    """1.5 mm below the top of a rod of 32 mm it is 13.5 mm wide; that is no surface for anything else."""
    level, steep = rotation_from_rpy(0.5 * np.pi, 0.0, 0.4), rotation_from_rpy(0.0, 0.3, 0.0)
    rung = Obstacle("rung", Cylinder(0.016, 0.4), level, (0.0, 0.0, 0.3))
    scene = Scene([rung, Obstacle("stile", Cylinder(0.02, 3.0), steep, (1.0, 0.0, 1.0))])
    (top,) = scene.bar_tops
    assert np.isclose(top.area, 0.4 * 2.0 * np.sqrt(0.016**2 - 0.0145**2))
    assert np.allclose(top.polygon[:, 2], 0.316)
    for half, touched in ((0.006, ("rung",)), (0.02, None)):
        part = [[half, 0.05], [-half, 0.05], [-half, -0.05], [half, -0.05]]
        foot = sole("left_foot", (0.0, 0.0, 0.316), 0.4, length=0.28, width=0.12, polygon=part, friction=0.7)
        if touched is None:
            with pytest.raises(ContactError):
                scene.touched_obstacles(foot)
        else:
            assert scene.touched_obstacles(foot) == touched
    assert not any("rung" in item.obstacles for item in scene.surfaces_facing((0.0, 0.0, 1.0), 0.1))


def test_distance_in_space_combines_height_and_overhang():
    (top,) = Scene([Obstacle("b", Box((1, 1, 1)))], floor_height=None).surfaces_facing((0, 0, 1), 0.1)
    assert np.allclose(top.distance(np.array([[0.0, 0.0, 0.7], [0.9, 0.0, 0.8]])), [0.2, 0.5])


def test_real_stairs_have_a_tread_per_step(scene_files):
    scene = Scene([Obstacle("stairs", load_mesh(scene_files / "hpp_environments/stairs.stl"))], None)
    heights = {round(float(s.centre[2]), 3) for s in scene.surfaces_facing((0, 0, 1), 0.05) if s.area > 0.1}
    assert sorted(heights) == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6], abs=1e-3)
