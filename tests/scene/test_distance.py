import itertools
from types import SimpleNamespace

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from manikin.body import human, random_configuration
from manikin.errors import SceneError
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Plane,
    Proximity,
    Scene,
    Sphere,
    load_mesh,
)
from manikin.scene.collision import ClosedSurface
from manikin.scene.covering import winding_inside
from manikin.scene.distance_bounds import KnownDistances
from manikin.scene.triangles import triangle_geometry

FAR = 100.0
# Coal iterates to 1e-8 m, on cylinders to 1e-6 m; ten times that is allowed.
TIGHT, ROUGH = 1e-7, 1e-5
coordinate = st.floats(-1.0, 1.0)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
rotation = st.tuples(*[st.floats(-3.1, 3.1)] * 3).map(lambda rpy: rotation_from_rpy(*rpy))
PROBES = {"sphere": coal.Sphere(0.1), "capsule": coal.Capsule(0.08, 0.3), "box": coal.Box(0.2, 0.1, 0.06)}


def measure(free_body, pose, geometry, shape, place, turn=None, obstacle_place=None):
    """Signed distance and result of one probe and one obstacle."""
    turned, moved = obstacle_place or (np.eye(3), np.zeros(3))
    scene = Scene([Obstacle("it", shape, turned, moved)], floor_height=None)
    result = Proximity(free_body(geometry), scene).evaluate(pose(place, turn), activation=FAR)
    return result.distance.min(), result


def box_distance(points, half):
    """Signed distance of points to a box."""
    beyond = np.abs(points) - half
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return outside + np.minimum(beyond.max(axis=-1), 0.0)


def cylinder_distance(points, radius, length):
    across = np.hypot(points[..., 0], points[..., 1]) - radius
    along = np.abs(points[..., 2]) - length / 2
    outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
    return outside + np.minimum(np.maximum(across, along), 0.0)


@given(point)
def test_ball_and_box_inside_and_outside(free_body, pose, place):
    distance, _ = measure(free_body, pose, coal.Sphere(0.1), Box((1.0, 0.6, 0.8)), place)
    assert distance == pytest.approx(box_distance(place, [0.5, 0.3, 0.4]) - 0.1, abs=TIGHT)


@given(point)
def test_ball_and_ball(free_body, pose, place):
    distance, _ = measure(free_body, pose, coal.Sphere(0.1), Sphere(0.3), place)
    assert distance == pytest.approx(np.linalg.norm(place) - 0.4, abs=TIGHT)


@given(point)
def test_ball_and_cylinder_inside_and_outside(free_body, pose, place):
    distance, _ = measure(free_body, pose, coal.Sphere(0.1), Cylinder(0.3, 0.9), place)
    assert distance == pytest.approx(cylinder_distance(place, 0.3, 0.9) - 0.1, abs=ROUGH)


@given(point, rotation)
def test_ball_and_cylinder_in_either_order_are_mirror_images(free_body, pose, place, turn):
    """Moving the cylinder about the ball is moving the ball about the cylinder the other way."""
    there, ball = measure(
        free_body, pose, coal.Sphere(0.1), Cylinder(0.3, 0.9), place, None, (turn, place / 2)
    )
    back, tube = measure(
        free_body, pose, coal.Cylinder(0.3, 0.9), Sphere(0.1), place / 2, turn, (turn, place)
    )
    assert there == pytest.approx(back, abs=1e-12)
    assert np.allclose(ball.normal, -tube.normal)
    assert np.allclose(ball.on_body, tube.on_other)
    assert ball.normal[0] @ (ball.on_other - ball.on_body)[0] == pytest.approx(there, abs=1e-12)


@given(point, rotation)
def test_capsule_and_capsule_are_two_segments(free_body, pose, place, turn):
    distance, _ = measure(free_body, pose, coal.Capsule(0.05, 0.4), Capsule(0.07, 0.6), place, turn)
    assume(distance > 0.0)
    mine, theirs = turn[:, 2] * 0.2, np.array([0.0, 0.0, 0.3])

    def to_axis(s):
        at = place + s * mine
        return np.linalg.norm(at - np.clip(at[2] / 0.3, -1, 1) * theirs)

    best = minimize_scalar(to_axis, bounds=(-1, 1), method="bounded", options={"xatol": 1e-10}).fun
    best = min(best, to_axis(-1.0), to_axis(1.0))
    assert distance == pytest.approx(best - 0.12, abs=TIGHT)


@given(point, rotation)
@pytest.mark.parametrize("shape", [Box((1.0, 0.6, 0.8)), Cylinder(0.3, 0.9)])
def test_capsule_and_convex_solid_while_the_axis_is_outside(free_body, pose, shape, place, turn):
    """The distance to a convex solid is convex along the axis, so its minimum is unique."""
    distance, _ = measure(free_body, pose, coal.Capsule(0.05, 0.4), shape, place, turn)

    def to_solid(s):
        at = place + s * 0.2 * turn[:, 2]
        if isinstance(shape, Box):
            return float(box_distance(at, shape.size / 2))
        return float(cylinder_distance(at, shape.radius, shape.length))

    best = minimize_scalar(to_solid, bounds=(-1, 1), method="bounded", options={"xatol": 1e-10}).fun
    best = min(best, to_solid(-1.0), to_solid(1.0))
    assume(best > 1e-6)
    assert distance == pytest.approx(best - 0.05, abs=ROUGH if isinstance(shape, Cylinder) else TIGHT)


@given(point, rotation, rotation)
@pytest.mark.parametrize("name", sorted(PROBES))
def test_half_space_depth_is_that_of_the_deepest_point(free_body, pose, name, place, turn, tilt):
    geometry = PROBES[name]
    distance, result = measure(
        free_body, pose, geometry, HalfSpace((0, 0, 1), 0.2), place, turn, (tilt, np.zeros(3))
    )
    normal = tilt[:, 2]
    deepest = normal @ place - 0.2 - support(geometry, turn.T @ normal)
    assert distance == pytest.approx(deepest, abs=TIGHT)
    assert np.allclose(result.normal[0], -normal, atol=1e-9)


@given(point, rotation)
@pytest.mark.parametrize("name", sorted(PROBES))
def test_a_plane_pushes_to_the_side_on_which_less_is_in_the_way(free_body, pose, name, place, turn):
    geometry = PROBES[name]
    distance, _ = measure(free_body, pose, geometry, Plane((0, 0, 1), 0.0), place, turn)
    assert distance == pytest.approx(abs(place[2]) - support(geometry, turn[2]), abs=TIGHT)


def support(geometry, direction):
    """Farthest reach of a probe, symmetric about its centre, along a unit direction of its frame."""
    if isinstance(geometry, coal.Sphere):
        return geometry.radius
    if isinstance(geometry, coal.Capsule):
        return geometry.radius + geometry.halfLength * abs(direction[2])
    return np.abs(direction) @ geometry.halfSide


@pytest.mark.parametrize("height", [0.5, 0.2, 0.1, 0.02])
def test_box_and_box_along_a_face_normal(free_body, pose, height):
    distance, _ = measure(free_body, pose, coal.Box(0.2, 0.2, 0.2), Box((2.0, 2.0, 0.2)), (0.1, 0.0, height))
    assert distance == pytest.approx(height - 0.2, abs=TIGHT)


@given(point, rotation, point, rotation)
@pytest.mark.parametrize("name", sorted(PROBES))
def test_a_common_rigid_motion_changes_nothing(free_body, pose, name, place, turn, shift, common):
    for shape in (Box((0.6, 0.4, 0.2)), Capsule(0.1, 0.5), Cylinder(0.2, 0.4), HalfSpace((0, 1, 1), 0.1)):
        here, first = measure(free_body, pose, PROBES[name], shape, place, turn)
        there, second = measure(
            free_body, pose, PROBES[name], shape, common @ place + shift, common @ turn, (common, shift)
        )
        assert there == pytest.approx(here, abs=ROUGH)
        assert first.pairs == second.pairs


@given(point, rotation)
@pytest.mark.parametrize("name", sorted(PROBES))
def test_a_mesh_box_is_the_box(free_body, pose, name, place, turn):
    solid = trimesh.creation.box((1.0, 0.6, 0.8))
    mesh = Mesh(solid.vertices, solid.faces)
    of_mesh, _ = measure(free_body, pose, PROBES[name], mesh, place, turn)
    of_box, _ = measure(free_body, pose, PROBES[name], Box((1.0, 0.6, 0.8)), place, turn)
    assert of_mesh == pytest.approx(of_box, abs=TIGHT)


def l_shaped_step():
    """2 x 2 x 1 solid without one quarter (x > 1, y > 1); its base is on z = 0."""
    corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    solid = trimesh.creation.extrude_triangulation(corners, triangles, height=1.0)
    return Mesh(solid.vertices, solid.faces, "step")


@given(st.floats(-0.3, 2.3), st.floats(-0.3, 2.3), st.floats(-0.3, 1.3))
def test_ball_and_closed_mesh_that_is_not_convex(free_body, pose, x, y, z):
    """The solid is the union of two boxes; its signed distance is known in and out."""
    place = np.array([x, y, z])
    bars = ((2.0, 1.0), (1.0, 2.0))
    outside = min(box_distance(place - [a / 2, b / 2, 0.5], np.array([a, b, 1.0]) / 2) for a, b in bars)
    # Inside the union, the nearest surface is an outer face or the notch's edge lines.
    inside = min(x, y, z, 1.0 - z, 2.0 - x, 2.0 - y, np.hypot(max(1.0 - x, 0.0), max(1.0 - y, 0.0)))
    expected = outside if outside >= 0.0 else -inside
    assume(abs(expected) > 1e-6)
    distance, result = measure(free_body, pose, coal.Sphere(0.1), l_shaped_step(), place)
    assert distance == pytest.approx(expected - 0.1, abs=TIGHT)
    gap = result.normal[0] @ (result.on_other[0] - result.on_body[0])
    assert gap == pytest.approx(distance, abs=TIGHT)


def test_the_sign_of_a_point_is_that_of_the_winding_number():
    """On a surface with ridges, hollows and a hole, also near its edges and corners."""
    ring = trimesh.creation.torus(0.5, 0.2, major_sections=9, minor_sections=5)
    (piece,) = Mesh(ring.vertices, ring.faces).pieces
    surface = ClosedSurface(piece.vertices, piece.faces, triangle_geometry(piece.vertices, piece.faces))
    rng = np.random.default_rng(0)
    anywhere = rng.uniform(-0.8, 0.8, size=(500, 3))
    corners = piece.vertices[rng.integers(len(piece.vertices), size=500)] + rng.normal(size=(500, 3)) * 0.02
    points = np.vstack([anywhere, corners])
    inside = winding_inside(piece.vertices[piece.faces], points)
    heights = np.array([surface.signed(point)[0] for point in points])
    assert np.array_equal(heights < 0.0, inside)


@pytest.mark.parametrize(
    ("name", "reach", "depth"),
    [
        # Lowest axis point at z = 0.55, 0.45 below the top; plus the radius.
        ("capsule", 0.23, 0.53),
        # Lowest box point at z = 0.67, 0.33 below the top.
        ("box", 0.03, 0.33),
    ],
)
def test_a_shape_wholly_inside_a_closed_mesh_is_in_penetration(free_body, pose, name, reach, depth):
    """The depth is that of the deepest point of the shape; points are 2 cm apart."""
    step = l_shaped_step()
    distance, _ = measure(free_body, pose, PROBES[name], step, (0.5, 0.5, 0.7))
    assert distance == pytest.approx(-depth, abs=1e-3)
    above, _ = measure(free_body, pose, PROBES[name], step, (0.5, 0.5, 1.0 + reach + 0.01))
    assert above == pytest.approx(0.01, abs=TIGHT)
    dipping, _ = measure(free_body, pose, PROBES[name], step, (0.5, 0.5, 1.0 + reach - 0.01))
    assert dipping == pytest.approx(-0.01, abs=1e-3)


def test_an_open_mesh_has_no_inside(free_body, pose):
    """A ball in the middle of a lidless tub is clear of it."""
    tub = trimesh.creation.box((1.0, 1.0, 1.0))
    lidless = tub.faces[~np.all(tub.vertices[tub.faces][:, :, 2] > 0.4, axis=1)]
    distance, _ = measure(free_body, pose, coal.Sphere(0.1), Mesh(tub.vertices, lidless), np.zeros(3))
    assert distance == pytest.approx(0.4, abs=TIGHT)


CLUTTER = Scene(
    [
        Obstacle("platform", Box((1.0, 1.0, 0.2)), translation=(1.0, 0.0, 0.1)),
        Obstacle("roof", Box((1.0, 1.5, 0.05)), translation=(1.2, 0.0, 1.5)),
        Obstacle("post", Cylinder(0.1, 2.0), translation=(0.0, 0.9, 1.0)),
        Obstacle("rail", Capsule(0.05, 0.5), translation=(-0.5, 0.5, 1.0)),
        Obstacle("ball", Sphere(0.2), translation=(0.6, -0.4, 0.8)),
        Obstacle("wall", Plane((0.0, 1.0, 0.0), -1.0)),
    ]
)


@pytest.fixture(scope="module")
def near(person):
    return Proximity(person, CLUTTER)


def wander(person, rng, size=0.4):
    """Configuration near standing."""
    step = np.concatenate([rng.normal(size=3) * size, rng.normal(size=person.nv - 3) * size])
    return pin.integrate(person.pinocchio, person.standing_posture(), step)


def all_distances(near, q):
    return near.evaluate(q, activation=FAR).distance


def test_gradients_are_the_central_differences(person, near):
    """Away from switching of the nearest features, which two step sizes reveal.

    Coal's 1e-8 m over a step of 2e-5 gives 5e-4; on cylinders its 1e-6 m over 2e-4 gives
    1e-2. Anything wrong in a Jacobian is of order 0.1 to 1.
    """
    rng = np.random.default_rng(3)
    cylinder = np.array(["post" in pair for pair in near.pairs])
    compared = skipped = 0
    for _ in range(12):
        q = wander(person, rng)
        gradient = near.evaluate(q, activation=FAR).gradient
        for direction in rng.choice(person.nv, size=9, replace=False):
            step = np.eye(person.nv)[direction]
            small, large = (
                (
                    all_distances(near, pin.integrate(person.pinocchio, q, size * step))
                    - all_distances(near, pin.integrate(person.pinocchio, q, -size * step))
                )
                / (2 * size)
                for size in (1e-5, 1e-4)
            )
            smooth = np.abs(small - large) < np.where(cylinder, 1e-1, 1e-3)
            difference = np.where(cylinder, large, small) - gradient[:, direction]
            error = np.abs(difference[smooth])
            assert np.all(error < np.where(cylinder[smooth], 1e-2, 5e-4) + 1e-3)
            compared += int(smooth.sum())
            skipped += int((~smooth).sum())
    assert skipped < 0.02 * compared


def test_nearest_points_and_normals_agree_with_the_distance(person, near):
    result = near.evaluate(wander(person, np.random.default_rng(0)), activation=FAR)
    assert np.allclose(np.linalg.norm(result.normal, axis=1), 1.0)
    gap = np.einsum("ki,ki->k", result.normal, result.on_other - result.on_body)
    assert np.allclose(gap, result.distance, atol=1e-9)


def test_only_close_pairs_are_returned_and_none_of_them_is_missed(person, near):
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = wander(person, rng)
        everything = near.evaluate(q, activation=FAR)
        for activation in (0.0, 0.05, 0.3):
            close = everything.distance < activation
            some = near.evaluate(q, activation=activation)
            assert np.array_equal(some.distance, everything.distance[close])
            assert np.allclose(some.gradient, everything.gradient[close], atol=1e-12)
            assert some.pairs == tuple(p for p, c in zip(everything.pairs, close, strict=True) if c)


def test_answers_do_not_depend_on_earlier_ones(person, near):
    rng = np.random.default_rng(2)
    configurations = [wander(person, rng) for _ in range(6)]
    forward = [near.evaluate(q).distance for q in configurations]
    backward = [near.evaluate(q).distance for q in reversed(configurations)][::-1]
    afresh = [Proximity(person, CLUTTER).evaluate(q).distance for q in configurations]
    for a, b, c in zip(forward, backward, afresh, strict=True):
        assert np.array_equal(a, b)
        assert np.array_equal(a, c)


def test_the_minimum_is_the_least_of_all(person, near):
    rng = np.random.default_rng(4)
    for size in (0.05, 0.4):
        for _ in range(15):
            q = wander(person, rng, size)
            everything = near.evaluate(q, activation=FAR)
            found = near.minimum(q)
            assert found.distance == everything.distance.min()
            assert found.distance == everything.distance[everything.pairs.index(found.pair)]


@pytest.mark.parametrize("lift", [0.0, 0.3])
def test_the_minimum_over_samples_is_the_least_of_each(person, near, lift):
    """With lift the feet are clear of the floor, so the least distance may be positive."""
    rng = np.random.default_rng(5)
    turn = rng.normal(size=(2, person.nv)) * 0.15
    turn[:, 2] = lift
    samples = [
        pin.integrate(person.pinocchio, person.standing_posture(), np.sin(phase) * turn[0] + turn[1])
        for phase in np.linspace(0.0, 3.0, 200)
    ]
    each = [near.minimum(q).distance for q in samples]
    found = near.minimum_over(samples)
    assert found.distance == pytest.approx(min(each), abs=1e-6)
    assert each[found.sample] == pytest.approx(found.distance, abs=1e-6)


def test_what_one_query_along_a_motion_measures_changes_no_later_one(person, near):
    """Each of several queries, over all samples or some, is answered as if it were the only one."""
    rng = np.random.default_rng(4)
    ends = np.array([wander(person, rng, 0.2) for _ in range(4)])
    samples = np.concatenate([np.linspace(a, b, 12) for a, b in itertools.pairwise(ends)])
    samples[:, 3:7] /= np.linalg.norm(samples[:, 3:7], axis=1, keepdims=True)
    first = near.minimum_over(samples).pair
    queries = [
        (frozenset[tuple[str, str]](), None), (frozenset({first}), None),
        (frozenset({first}), np.arange(5, 20)), (frozenset[tuple[str, str]](), np.arange(20, 36)),
    ]  # fmt: skip
    motion = near.along(samples)
    for ignored, rows in queries:
        found = motion.minimum(ignored, rows=rows)
        chosen = np.arange(len(samples)) if rows is None else rows
        alone = near.minimum_over(samples[chosen], ignored)
        assert found.distance == pytest.approx(alone.distance, abs=2e-6)  # each is exact to a micrometre
        assert found.sample in chosen
        assert near.minimum(samples[found.sample], ignored).distance == found.distance


@pytest.mark.parametrize("probe", ["capsule", "box"])
def test_depths_that_jump_along_a_motion_are_found_as_each_alone(free_body, pose, probe):
    """Through an open mesh, whose depth is that of the worst triangle, no bound says more than is true.

    Nor does one that is asked again after the others were.
    """
    walls = trimesh.creation.box((1.0, 1.0, 1.0))
    lid = np.all(walls.vertices[walls.faces][:, :, 2] > 0.4, axis=1)
    scene = Scene([Obstacle("tub", Mesh(walls.vertices, walls.faces[~lid]))], floor_height=None)
    shape = {"capsule": coal.Capsule(0.08, 0.6), "box": coal.Box(0.6, 0.2, 0.06)}[probe]
    near, rng = Proximity(free_body(shape), scene), np.random.default_rng(0)
    for _ in range(12):
        ends, turns = rng.uniform(-0.8, 1.2, (2, 3)), rng.uniform(-1.0, 1.0, (2, 3))
        samples = np.array([
            pose(np.array([1.0 - s, s]) @ ends, rotation_from_rpy(*(np.array([1.0 - s, s]) @ turns)))
            for s in np.linspace(0.0, 1.0, 60)
        ])  # fmt: skip
        each = np.array([near.minimum(q).distance for q in samples])
        motion = near.along(samples)
        assert motion.minimum().distance == pytest.approx(each.min(), abs=1e-6)
        for row in [*rng.permutation(60), *range(60)]:
            assert motion.minimum(rows=np.array([row])).distance == pytest.approx(each[row], abs=1e-6)


def test_a_motion_without_samples_has_endless_room(person, near):
    assert near.minimum_over(np.zeros((0, person.nq))).distance == np.inf


def test_ignored_pairs_are_left_out_in_either_order_and_per_sample(person, near):
    q = person.standing_posture()
    feet = frozenset((f"{side}_{part}", "floor") for side in ("left", "right") for part in ("foot", "toes"))
    assert near.minimum(q).distance < 0.01
    standing = near.minimum(q, feet)
    assert standing.distance > 0.01
    swapped = frozenset((b, a) for a, b in feet)
    assert near.minimum(q, swapped) == standing
    assert near.minimum_over([q, q], feet).distance == standing.distance
    assert near.minimum_over([q, q], [feet, frozenset()]).sample == 1
    with pytest.raises(SceneError, match="1 sets for 2 samples"):
        near.minimum_over([q, q], [feet])
    shape_name = next(shape for shape, other in near.pairs if shape.startswith("left_foot/"))
    rows = near.evaluate(q, ignore=frozenset({(shape_name, "floor")}))
    assert (shape_name, "floor") not in rows.pairs
    assert ("right_foot/sole", "floor") in rows.pairs


def test_without_pairs_the_clearance_is_endless(person):
    empty = Proximity(person, Scene([], floor_height=None), self_collision=False)
    q = person.standing_posture()
    assert empty.pairs == ()
    assert empty.minimum(q).distance == np.inf
    assert empty.minimum_over([q]).pair is None
    result = empty.evaluate(q)
    assert len(result) == 0
    assert result.gradient.shape == (0, person.nv)


def test_bad_configurations_and_pairs_are_refused(person, near, free_body):
    broken = person.standing_posture().copy()
    broken[10] = np.nan
    for call in (near.evaluate, near.minimum, lambda q: near.minimum_over([q])):
        with pytest.raises(SceneError, match="nan"):
            call(broken)
        with pytest.raises(SceneError, match="shape"):
            call(broken[:5])
    body = free_body(coal.Sphere(0.1))
    strange = SimpleNamespace(pinocchio=body.pinocchio, geometry=body.geometry, collision_pairs=[("a", "b")])
    with pytest.raises(SceneError, match="names shape 'a'; valid: probe/shape"):
        Proximity(strange, CLUTTER)


def test_a_real_truck_is_cleared_above_and_hit_inside(scene_files, free_body, pose):
    truck = Obstacle("truck", load_mesh(scene_files / "hpp_environments/truck.stl"))
    near = Proximity(free_body(coal.Sphere(0.2)), Scene([truck], None))
    low, high = truck.bounds
    top = np.append((low + high)[:2] / 2, high[2])
    above = near.minimum(pose([*top[:2], top[2] + 1.0])).distance
    assert above >= 0.8 - TIGHT
    heights = np.linspace(high[2] + 0.5, low[2] - 0.5, 60)
    assert min(near.minimum(pose((top[0], top[1], z))).distance for z in heights) < 0.0


def test_many_configurations_at_once_are_measured_as_one_by_one():
    """The two ways share their arithmetic, so the numbers agree to rounding."""
    body = human()
    rng = np.random.default_rng(12)
    scene = Scene([Obstacle("table", Box((0.5, 0.5, 0.4)), translation=(0.2, 0.1, 0.3))])
    proximity = Proximity(body, scene)
    samples = np.array([random_configuration(body, rng) for _ in range(6)])
    ignored = [frozenset({("left_foot", "floor")}) if k % 2 else frozenset() for k in range(6)]
    together = proximity.evaluate_over(samples, 0.1, ignored)
    for k, q in enumerate(samples):
        alone, mine = proximity.evaluate(q, 0.1, ignored[k]), together.sample == k
        assert tuple(np.array(together.pairs, dtype=object)[mine].tolist()) or not len(alone)
        np.testing.assert_array_equal(together.distance[mine], alone.distance)
        np.testing.assert_allclose(together.gradient[mine], alone.gradient, atol=1e-12)


def test_no_near_pair_is_skipped_along_a_smooth_motion():
    """Between samples that move little, far pairs are not measured; what is reported stays the same."""
    body = human()
    rng = np.random.default_rng(21)
    start, end = (random_configuration(body, rng) for _ in range(2))
    scene = Scene([Obstacle("table", Box((0.5, 0.5, 0.4)), translation=(0.2, 0.1, 0.3))])
    proximity = Proximity(body, scene)
    samples = np.array([pin.interpolate(body.pinocchio, start, end, s) for s in np.linspace(0.0, 1.0, 60)])
    together = proximity.evaluate_over(samples, 0.05)
    assert len(together.distance)
    for k, q in enumerate(samples):
        alone, mine = proximity.evaluate(q, 0.05), together.sample == k
        np.testing.assert_array_equal(together.distance[mine], alone.distance)
        np.testing.assert_allclose(together.gradient[mine], alone.gradient, atol=1e-12)


def test_what_is_known_from_before_changes_no_result():
    """Small, large and no changes of a motion: the same pairs, distances and gradients to the last bit."""
    body = human()
    rng = np.random.default_rng(5)
    start, end = (random_configuration(body, rng) for _ in range(2))
    scene = Scene([Obstacle("table", Box((0.5, 0.5, 0.4)), translation=(0.2, 0.1, 0.3))])
    proximity, known = Proximity(body, scene), KnownDistances()
    for size in (0.0, 0.01, 0.0, 0.5, 0.002):
        end = pin.integrate(body.pinocchio, end, size * rng.normal(size=body.nv))
        samples = np.array(
            [pin.interpolate(body.pinocchio, start, end, s) for s in np.linspace(0.0, 1.0, 30)]
        )
        placed = proximity.place(samples)
        fresh = proximity.evaluate_placed(placed, 0.05)
        again = proximity.evaluate_placed(placed, 0.05, known=known)
        assert len(fresh.distance)
        assert again.pairs == fresh.pairs
        np.testing.assert_array_equal(again.sample, fresh.sample)
        np.testing.assert_array_equal(again.distance, fresh.distance)
        np.testing.assert_array_equal(again.gradient, fresh.gradient)
