"""The reachability condition against independent measurements."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from manikin.body.segments import ShapeKind
from manikin.errors import BodyError, InputError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.planning.guide import (
    NO_MARGINS,
    Abstraction,
    Condition,
    LimbReach,
    LimbRule,
    Margins,
    ReachabilityChecker,
    TrunkShape,
    UsableSurface,
    abstraction_of,
    root_pose,
)
from manikin.planning.guide.root_pose import angles_between, between, distance, tilt
from manikin.scene import Box, Cylinder, Mesh, Obstacle, Scene

coordinate = st.floats(-1.5, 1.5)
pose = st.tuples(coordinate, coordinate, coordinate, *[st.floats(-3.1, 3.1)] * 3).map(
    lambda c: root_pose(c[:3], rotation_from_rpy(*c[3:]))
)
BLOCK = Obstacle("block", Box((0.6, 0.8, 0.4)), rotation_from_rpy(0.3, 0.2, 0.5), (0.2, 0.1, 0.3))


def hull_meets_box(vertices, item):
    """Whether the hull of points meets a box, by a linear program."""
    local = (vertices - item.translation) @ item.rotation
    half = item.shape.size / 2
    rows = np.vstack([local.T, -local.T])
    found = linprog(np.zeros(len(local)), rows, np.concatenate([half, half]), np.ones((1, len(local))), [1.0])
    return found.status == 0


def ball_to_box(centre, item):
    """Distance of a point from a solid box."""
    local = np.abs((centre - item.translation) @ item.rotation) - item.shape.size / 2
    return np.linalg.norm(np.maximum(local, 0.0))


@pytest.fixture(scope="module")
def plain(bug):
    return ReachabilityChecker(bug, Scene([BLOCK], floor_height=None), margins=NO_MARGINS)


@given(at=pose)
def test_condition_is_that_of_independent_measurements(plain, bug, at):
    """Trunk distance in closed form, limbs by linear programs; limbs inside the block touch no face."""
    free = ball_to_box(at[:3], BLOCK) > 0.1
    assert plain.trunk_is_free(at) == free
    turn = Rotation.from_quat(at[3:]).as_matrix()
    reached = tuple(limb.name for limb in bug.limbs if hull_meets_box(limb.vertices @ turn.T + at[:3], BLOCK))
    assert plain.reaching(at) == reached
    assert plain.holds(at) == (free and bool(reached))
    assert (plain.explain(at) is None) == plain.holds(at)


@pytest.fixture(scope="module")
def kept(bug):
    return ReachabilityChecker(bug, Scene([BLOCK], floor_height=None))


@given(first=pose, second=pose, share=st.floats(0.0, 1.0))
def test_nothing_is_missed_between_checked_poses(kept, plain, first, second, share):
    """A way whose checked poses hold with margins satisfies the plain condition everywhere."""
    count = kept.steps(float(np.linalg.norm(second[:3] - first[:3])), float(angles_between(first, second)))
    middle = between(first, second, np.array([share]))[0]
    left = int(np.clip(np.floor(share * count), 0, count - 1))
    ends = between(first, second, np.array([left, left + 1]) / count)
    if all(kept.trunk_is_free(end) for end in ends):
        assert plain.trunk_is_free(middle)
    nearest = ends[round(share * count - left)]
    assert set(kept.reaching(nearest)) <= set(plain.reaching(middle))


@pytest.fixture(scope="module")
def stricter(bug):
    conditions = (Condition(), Condition.limbs(at_least=2), Condition.limbs("left"))
    return [ReachabilityChecker(bug, Scene([BLOCK], floor_height=None), item) for item in conditions]


@given(at=pose)
def test_more_limbs_are_harder(stricter, at):
    held = [checker.holds(at) for checker in stricter]
    assert held[0] >= held[1]
    assert held[0] >= held[2] >= held[1]


def test_many_obstacles_are_asked_as_few_are(bug):
    """120 boxes, which go through a tree of bounding boxes, against closed forms."""
    rng = np.random.default_rng(0)
    boxes = [
        Obstacle(f"box{i}", Box(rng.uniform(0.1, 0.4, 3)), Rotation.random(random_state=i).as_matrix(), place)
        for i, place in enumerate(rng.uniform(-1.5, 1.5, (120, 3)))
    ]
    checker = ReachabilityChecker(bug, Scene(boxes, floor_height=None), margins=NO_MARGINS)
    answers = []
    for place in rng.uniform(-1.5, 1.5, (150, 3)):
        answers.append(min(ball_to_box(place, item) for item in boxes) > 0.1)
        assert checker.trunk_is_free(root_pose(place)) == answers[-1]
    assert 20 < sum(answers) < 130


def test_a_limb_counts_only_surfaces_with_a_usable_normal(bug):
    """Beside a wall a limb reaches it, but no surface that carries a foot."""
    wall = Scene([Obstacle("wall", Box((4.0, 0.1, 4.0)), translation=(0.0, 0.4, 0.0))], floor_height=None)
    carries = UsableSurface((0.0, 0.0, 1.0), np.deg2rad(45.0))
    condition = Condition((LimbRule(("left",)),), {"left": carries})
    at = root_pose((0.0, 0.0, 0.0))
    assert ReachabilityChecker(bug, wall, Condition.limbs("left")).holds(at)
    strict = ReachabilityChecker(bug, wall, condition)
    assert not strict.holds(at)
    assert "'left' reaches no usable surface" in strict.explain(at)
    floor = ReachabilityChecker(bug, Scene([], floor_height=-0.2), condition)
    assert floor.holds(at)
    roof = Scene([Obstacle("roof", Box((4.0, 4.0, 0.4)), translation=(0.0, 0.0, 0.45))], floor_height=None)
    assert not ReachabilityChecker(bug, roof, condition).holds(at)


def test_obstacles_and_small_triangles_can_be_left_out(bug):
    scene = Scene([], floor_height=-0.2)
    at = root_pose((0.0, 0.0, 0.0))
    only = Condition(surfaces={name: UsableSurface(obstacles=("wall",)) for name in ("left", "right")})
    assert not ReachabilityChecker(bug, scene, only).holds(at)
    crumb = Scene([Obstacle("crumb", Box((0.01, 0.01, 0.01)), translation=(0.0, 0.3, 0.0))], None)
    large = Condition(surfaces={name: UsableSurface(smallest_area=1e-3) for name in ("left", "right")})
    assert ReachabilityChecker(bug, crumb).holds(at)
    assert not ReachabilityChecker(bug, crumb, large).holds(at)


def test_rules_depend_on_the_tilt(bug):
    """Upright one limb is enough; bent, both are wanted."""
    wall = Scene([Obstacle("wall", Box((4.0, 0.1, 4.0)), translation=(0.0, 0.4, 0.0))], floor_height=None)
    condition = Condition.standing_or_bent(["left"], ["left", "right"])
    checker = ReachabilityChecker(bug, wall, condition)
    assert checker.holds(root_pose((0.0, 0.0, 0.0)))
    bent = root_pose((0.0, 0.0, 0.0), rotation_from_rpy(0.0, 1.2, 0.0))
    assert "'right'" in checker.explain(bent)


def test_inside_a_hollow_mesh_is_not_free(bug):
    """A closed mesh that is not convex is solid although its triangles are not met."""
    scene = Scene([Obstacle("block", _l_shape())], floor_height=None)
    checker = ReachabilityChecker(bug, scene)
    inside = root_pose((0.5, 0.5, 2.0))
    assert checker.trunk_is_free(inside)
    assert not checker.admits(inside)
    assert checker.inside_solid(inside) == "block"
    assert checker.inside_solid(root_pose((3.0, 3.0, 2.0))) is None


def _l_shape():
    """Prism over an L, 4 m high."""
    corners = np.array([(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)], dtype=float)
    low, high = (np.column_stack([corners, np.full(6, z)]) for z in (0.0, 4.0))
    flat = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    sides = [(i, (i + 1) % 6, 6 + i) for i in range(6)]
    sides += [((i + 1) % 6, 6 + (i + 1) % 6, 6 + i) for i in range(6)]
    faces = [face[::-1] for face in flat] + [tuple(6 + i for i in face) for face in flat] + sides
    return Mesh(np.vstack([low, high]), faces)


def test_abstraction_of_a_human_stands_on_its_legs(person, reaches):
    """The trunk is what belongs to no limb; standing, both legs reach the floor and no arm does."""
    body = abstraction_of(person, reaches)
    assert {shape.name.split("/")[0] for shape in body.trunk} == {
        "pelvis", "lumbar", "thorax", "neck", "head",
    }  # fmt: skip
    checker = ReachabilityChecker(body, Scene([]))
    assert checker.reaching(root_pose((0.0, 0.0, 0.85))) == ("left_leg", "right_leg")
    assert "meets 'floor'" in checker.explain(root_pose((0.0, 0.0, 0.05)))


def test_trunk_shapes_lie_where_the_body_has_them(person, reaches):
    """Hinge angles move the trunk's shapes as they move the body's."""
    angles = {"lumbar_flexion": 0.4} if "lumbar_flexion" in person.joint_names else {}
    body = abstraction_of(person, reaches, angles=angles, trunk_scale=1.0)
    q = person.standing_posture().copy()
    q[:7] = [0, 0, 0, 0, 0, 0, 1]
    for name, angle in angles.items():
        q[7 + person.joint_index(name)] = angle
    data, placed = person.pinocchio.createData(), pin.GeometryData(person.geometry)
    pin.updateGeometryPlacements(person.pinocchio, data, person.geometry, placed, q)
    for shape in body.trunk:
        there = placed.oMg[person.geometry.getGeometryId(shape.name)]
        np.testing.assert_allclose(shape.translation, there.translation, atol=1e-12)
        np.testing.assert_allclose(shape.rotation, there.rotation, atol=1e-12)


@given(radius=st.floats(0.05, 0.5), margin=st.floats(0.001, 0.1))
def test_shrunk_volume_keeps_its_margin(radius, margin):
    """Every face is left behind by the margin that is told."""
    points = np.random.default_rng(0).normal(size=(40, 3))
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    limb = LimbReach("leg", points)
    room = limb.offsets - (limb.shrunk(margin) @ limb.normals.T).max(axis=0)
    assert room.min() >= min(margin, 0.5 * limb.radius) - 1e-12
    few = limb.coarse(20)
    assert len(few) <= 20
    assert {tuple(corner) for corner in few} <= {tuple(corner) for corner in limb.vertices}


@given(first=pose, second=pose, third=pose)
def test_distance_is_a_metric(first, second, third):
    assert distance(first, second) == distance(second, first)
    assert distance(first, first) <= 1e-7
    assert distance(first, third) <= distance(first, second) + distance(second, third) + 1e-9


def test_distance_uses_squares():
    """3, 4 and no turn: the scaled Euclidean length, not the root of the sum of absolute values."""
    assert distance(root_pose((0, 0, 0)), root_pose((3, 4, 0)), 1.0) == pytest.approx(5.0)
    turned = root_pose((0, 0, 0), rotation_from_rpy(0.0, 0.0, 0.7))
    assert distance(root_pose((0, 0, 0)), turned, 0.0) == pytest.approx(0.7)
    assert angles_between(root_pose((0, 0, 0)), turned) == pytest.approx(0.7)


@given(yaw=st.floats(-3.0, 3.0), lean=st.floats(0.01, 3.0))
def test_tilt_is_the_angle_to_the_vertical(yaw, lean):
    assert tilt(root_pose((0, 0, 0), rotation_from_rpy(0.0, lean, yaw))) == pytest.approx(lean, abs=1e-6)


def test_misuse_is_told(bug):
    with pytest.raises(InputError, match="limb 'tail'; valid: left, right"):
        ReachabilityChecker(bug, Scene([]), Condition.limbs("tail"))
    with pytest.raises(InputError, match="wants 3 limbs"):
        ReachabilityChecker(bug, Scene([]), Condition.limbs(at_least=3))
    with pytest.raises(BodyError, match="without volume"):
        LimbReach("flat", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    with pytest.raises(BodyError, match="no trunk shape"):
        Abstraction((), bug.limbs)
    with pytest.raises(InputError, match="margins trunk"):
        Margins(-1.0)
    assert TrunkShape("a/b", ShapeKind.BOX, (1, 1, 1)).enlarged(1.0, 0.1).size == pytest.approx([1.2] * 3)
    assert ReachabilityChecker(bug, Scene([Obstacle("post", Cylinder(0.1, 2.0))], None)).blocking(
        root_pose((0.0, 0.0, 0.5))
    ) == ("trunk/ball", "post")
