"""MuJoCo and Pinocchio hold the same body, and states translate without loss."""

import itertools

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human, integrate, random_configuration
from manikin.errors import InputError, SceneError
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Proximity, Scene, Sphere
from manikin.simulation import PhysicsOptions, compile_model
from manikin.simulation.compile import add_scene, obstacle_of, root_rotation

EXACT = 1e-9
SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def model():
    return compile_model(human())


def random_state(model, seed):
    rng = np.random.default_rng(seed)
    body = model.body
    q, v = random_configuration(body, rng), 2.0 * rng.standard_normal(body.nv)
    data = mujoco.MjData(model.mujoco)
    model.set_state(data, q, v)
    return rng, q, v, data


def full_mass_matrix(model, data):
    matrix = np.zeros((model.mujoco.nv, model.mujoco.nv))
    mujoco.mj_fullM(model.mujoco, data, matrix)
    return matrix


def a_to_mujoco(q, v, a):
    """``qacc`` of an acceleration: the inverse of ``SimulationModel.a_from_mujoco``."""
    linear = root_rotation(q) @ (a[:3] + np.cross(v[3:6], v[:3]))
    return np.concatenate((linear, a[3:]))


def force_from_mujoco(q, force):
    """Generalised force of Pinocchio from that of MuJoCo, root included."""
    return np.concatenate((root_rotation(q).T @ force[:3], force[3:]))


@given(st.floats(1.50, 2.00), st.floats(45.0, 120.0), st.sampled_from(["male", "female"]), SEEDS)
def test_engines_agree(stature, mass, sex, seed):
    """Mass, centre of mass, mass matrix, bias forces and effectors agree to 1e-9.

    Forces of up to 1e4 N are compared relative to their size.
    """
    model = compile_model(human(stature, mass, sex))
    body = model.body
    rng, q, v, data = random_state(model, seed)
    state = Configuration(body, q, v)

    assert model.mujoco.body_mass.sum() == pytest.approx(body.mass, rel=1e-12)
    np.testing.assert_allclose(data.subtree_com[model.body_id("pelvis")], state.com, atol=EXACT)
    for name in body.effectors:
        rotation, position = state.effector_placement(name)
        np.testing.assert_allclose(data.site_xpos[model.site_id(name)], position, atol=EXACT)
        np.testing.assert_allclose(data.site_xmat[model.site_id(name)].reshape(3, 3), rotation, atol=EXACT)
    for part in body.segments:
        np.testing.assert_allclose(
            data.xpos[model.body_id(part.name)], state.segment_placement(part.name)[1], atol=EXACT
        )

    turn = np.eye(body.nv)
    turn[:3, :3] = root_rotation(q)
    matrix = full_mass_matrix(model, data)
    np.testing.assert_allclose(turn.T @ matrix @ turn, state.mass_matrix, atol=EXACT)

    # With a = 0 in Pinocchio's coordinates MuJoCo's acceleration is w x v, and the forces agree.
    for a in (np.zeros(body.nv), rng.standard_normal(body.nv)):
        force = matrix @ a_to_mujoco(q, v, a) + data.qfrc_bias
        wanted = state.mass_matrix @ a + state.nonlinear_effects
        np.testing.assert_allclose(
            force_from_mujoco(q, force), wanted, atol=EXACT * max(1.0, np.abs(wanted).max())
        )


def test_hinges_and_motors_have_the_order_and_limits_of_the_body(model):
    body, compiled = model.body, model.mujoco
    assert tuple(compiled.joint(1 + k).name for k in range(39)) == body.joint_names
    assert tuple(compiled.actuator(k).name for k in range(compiled.nu)) == body.joint_names
    np.testing.assert_allclose(compiled.jnt_range[1:], np.column_stack([body.lower, body.upper]), atol=1e-12)
    np.testing.assert_array_equal(compiled.actuator_ctrlrange[:, 0], body.torque_lower)
    np.testing.assert_array_equal(compiled.actuator_ctrlrange[:, 1], body.torque_upper)


def test_motors_are_torques(model):
    """A control of one newton-metre is one newton-metre on its hinge."""
    data = mujoco.MjData(model.mujoco)
    data.ctrl[:] = np.linspace(-5.0, 5.0, model.mujoco.nu)
    mujoco.mj_forward(model.mujoco, data)
    np.testing.assert_allclose(data.qfrc_actuator[6:], data.ctrl, atol=1e-12)
    np.testing.assert_allclose(data.qfrc_actuator[:6], 0.0, atol=1e-12)


@given(SEEDS)
def test_states_translate_there_and_back(model, seed):
    rng, q, v, data = random_state(model, seed)
    a, tau = rng.standard_normal((2, model.body.nv))
    np.testing.assert_allclose(model.q_from_mujoco(data.qpos), q, atol=1e-12)
    np.testing.assert_allclose(model.v_from_mujoco(data.qpos, data.qvel), v, atol=1e-12)
    qacc = a_to_mujoco(q, v, a)
    np.testing.assert_allclose(model.a_from_mujoco(data.qpos, data.qvel, qacc), a, atol=1e-12)
    force = np.concatenate((root_rotation(q) @ tau[:3], tau[3:]))
    np.testing.assert_allclose(force_from_mujoco(q, force), tau, atol=1e-12)
    assert force @ data.qvel == pytest.approx(tau @ v, abs=1e-10)  # the same power


@given(SEEDS)
def test_acceleration_is_the_derivative_of_the_translated_velocity(model, seed):
    """Includes the w x v term of the free root; central difference, error about 1e-8."""
    rng, q, v, _ = random_state(model, seed)
    a = rng.standard_normal(model.body.nv)
    step = 1e-6

    def velocity(h):
        return model.v_to_mujoco(integrate(model.body, q, v + 0.5 * h * a, h), v + h * a)

    difference = (velocity(step) - velocity(-step)) / (2 * step)
    np.testing.assert_allclose(a_to_mujoco(q, v, a), difference, atol=1e-7)


def test_free_flight_conserves_momentum():
    """Without gravity and contacts a tumbling body keeps its momentum; integration errs by h."""
    model = compile_model(
        human(), options=PhysicsOptions(timestep=1e-4, self_collision=False, joint_limits=False)
    )
    _, q, v, data = random_state(model, 4)
    model.mujoco.opt.gravity[:] = 0.0
    start = Configuration(model.body, q, v)
    for _ in range(200):
        mujoco.mj_step(model.mujoco, data)
    q_end = model.q_from_mujoco(data.qpos)
    end = Configuration(model.body, q_end, model.v_from_mujoco(data.qpos, data.qvel))
    scale = np.abs(start.centroidal_map @ v).max()
    np.testing.assert_allclose(end.com_velocity, start.com_velocity, atol=0.01 * scale / model.body.mass)
    np.testing.assert_allclose(end.angular_momentum, start.angular_momentum, atol=0.01 * scale)


def test_segments_that_may_touch_are_the_bodys_pairs(model):
    compiled = model.mujoco
    names = [compiled.body(number).name for number in range(compiled.nbody)]
    excluded = {frozenset((names[code >> 16], names[code & 0xFFFF])) for code in compiled.exclude_signature}
    every = {frozenset(pair) for pair in itertools.combinations([s.name for s in model.body.segments], 2)}
    assert every - excluded == {frozenset(pair) for pair in model.body.segment_pairs}
    alone = compile_model(model.body, options=PhysicsOptions(self_collision=False)).mujoco
    assert not np.any(alone.geom_contype & alone.geom_conaffinity)


def test_engines_find_the_same_self_collisions(model):
    """Over random configurations the pairs in contact are those of Coal (deeper than 0.1 mm)."""
    proximity = Proximity(model.body, Scene([], floor_height=None))
    touched = 0
    for seed in range(25):
        _, q, _, data = random_state(model, seed)
        ours = {
            frozenset(pair)
            for pair, distance in zip(*_pairs_and_distances(proximity, q), strict=True)
            if distance < -1e-4
        }
        theirs = {
            frozenset(model.geom_names[number].split("/")[0] for number in contact.geom)
            for contact in data.contact
            if contact.dist < -1e-4
        }
        assert ours == theirs
        touched += len(theirs)
    assert touched > 0


def _pairs_and_distances(proximity, q):
    result = proximity.evaluate(q, activation=0.0)
    return [(a.split("/")[0], b.split("/")[0]) for a, b in result.pairs], result.distance


def cube(size, centre):
    mesh = trimesh.creation.box(size)
    return Mesh(mesh.vertices + centre, mesh.faces)


def tray():
    """A closed mesh that is not convex: a ring 0.1 m high."""
    ring = trimesh.creation.annulus(0.2, 0.4, 0.1)
    return Mesh(ring.vertices, ring.faces)


ALL_SHAPES = Scene([
    Obstacle("box", Box((1.0, 0.8, 0.2)), translation=(3.0, 0.0, 0.1)),
    Obstacle("ball", Sphere(0.2), translation=(3.0, 2.0, 0.5)),
    Obstacle("pipe", Cylinder(0.1, 2.0), translation=(3.0, 4.0, 1.0)),
    Obstacle("rail", Capsule(0.05, 1.0), translation=(3.0, 6.0, 1.0)),
    Obstacle("wall", HalfSpace((1.0, 0.0, 0.0), -8.0)),
    Obstacle("pane", Plane((0.0, 1.0, 0.0), -8.0)),
    Obstacle("cube", cube((0.5, 0.5, 0.5), (0.0, 0.0, 0.0)), translation=(6.0, 0.0, 0.25)),
    Obstacle("ring", tray(), translation=(6.0, 4.0, 0.05)),
])  # fmt: skip


def test_every_kind_of_obstacle_compiles():
    model = compile_model(human(), ALL_SHAPES)
    names = {obstacle_of(name) for name in model.geom_names} - {None}
    assert names == set(ALL_SHAPES.names)
    fixed = [number for number, name in enumerate(model.geom_names) if obstacle_of(name)]
    assert np.all(model.mujoco.geom_bodyid[fixed] == 0)


@pytest.mark.parametrize(("place", "obstacle"), [
    ((0.0, 0.0, 0.1), "floor"), ((3.0, 0.0, 0.3), "box"), ((3.0, 2.0, 0.79), "ball"),
    ((3.2, 4.0, 1.0), "pipe"), ((3.0, 6.0, 1.64), "rail"), ((-7.9, 0.0, 1.0), "wall"),
    ((0.0, -7.9, 1.0), "pane"), ((6.0, 0.0, 0.59), "cube"), ((6.3, 4.0, 0.19), "ring"),
])  # fmt: skip
def test_obstacles_are_where_the_scene_says(place, obstacle):
    """A ball of 0.1 m at the place touches that obstacle and no other."""
    model = compile_model(human(), ALL_SHAPES)
    assert _touched(model, place) == {obstacle}


def test_hole_of_a_ring_is_not_filled():
    """A mesh that is not convex keeps its hole, which its convex hull would fill."""
    model = compile_model(human(), ALL_SHAPES)
    assert _touched(model, (6.0, 4.0, 0.151)) == set()


def _touched(model, place):
    """Obstacles that a ball of 0.1 m at ``place`` touches, from MuJoCo's own distances."""
    spec_data = mujoco.MjData(model.mujoco)
    q = model.body.standing_posture()
    q[2] += 50.0
    model.set_state(spec_data, q)
    # The body's jaw is a sphere: bring it to the place and measure from its centre.
    jaw = model.mujoco.geom("head/jaw").id
    q[:3] += np.asarray(place) - spec_data.geom_xpos[jaw]
    model.set_state(spec_data, q)
    radius = model.mujoco.geom_size[jaw, 0]
    found = set()
    for number, name in enumerate(model.geom_names):
        if obstacle_of(name):
            line = np.zeros(6)
            gap = mujoco.mj_geomDistance(model.mujoco, spec_data, jaw, number, 5.0, line)
            if gap + radius < 0.1 + 1e-6:
                found.add(obstacle_of(name))
    return found


def test_standing_body_rests_on_its_soles():
    """In the standing posture only the soles touch the floor, without depth."""
    model = compile_model(human(), Scene([]))
    data = mujoco.MjData(model.mujoco)
    model.set_state(data, model.body.standing_posture())
    touching = {name for contact in data.contact for name in (model.geom_names[g] for g in contact.geom)}
    soles = {f"{side}_{part}/sole" for side in ("left", "right") for part in ("foot", "toes")}
    assert touching == soles | {"scene/floor"}
    assert all(abs(contact.dist) < 1e-12 for contact in data.contact)


def test_mesh_with_too_many_loose_triangles_is_refused():
    rough = trimesh.creation.annulus(0.2, 0.4, 0.1, sections=1200)
    with pytest.raises(SceneError, match="valid"):
        compile_model(human(), Scene([Obstacle("rough", Mesh(rough.vertices, rough.faces))]))


@pytest.mark.parametrize("change", [
    {"timestep": 0.0}, {"timestep": float("nan")}, {"friction": 0.0}, {"friction": -0.5},
    {"least_inertia": -1.0}, {"joint_damping": float("inf")}, {"soft_time_constant": 0},
])  # fmt: skip
def test_nonsense_options_are_refused(change):
    with pytest.raises(InputError, match="valid"):
        PhysicsOptions(**change)


def test_damping_reaches_the_hinges_only():
    model = compile_model(human(), options=PhysicsOptions(joint_damping=1.5))
    damping = np.asarray(model.mujoco.dof_damping).reshape(model.mujoco.nv, -1)[:, 0]
    np.testing.assert_allclose(damping, [0.0] * 6 + [1.5] * 39)


@pytest.mark.parametrize("least", [0.0, 1e-3, 0.02])
def test_hinges_move_at_least_the_least_inertia(least):
    """About each hinge of a body that stands, and no more than its own where that is enough."""
    body = human()
    model = compile_model(body, options=PhysicsOptions(least_inertia=least))
    data, q = mujoco.MjData(model.mujoco), body.standing_posture()
    model.set_state(data, q, np.zeros(body.nv))
    own, found = np.diag(Configuration(body, q).mass_matrix)[6:], np.diag(full_mass_matrix(model, data))[6:]
    np.testing.assert_allclose(found, np.maximum(own, least), rtol=1e-6)
    assert np.all(np.asarray(model.mujoco.dof_armature)[:6] == 0.0)
    if least == 1e-3:
        lacking = {name for name, value in zip(body.joint_names, own, strict=True) if value < least}
        assert lacking == {"left_toe_extension", "right_toe_extension"}


@pytest.mark.parametrize("tilt", [0.0, 1e-4, 1e-3])
def test_a_sole_across_a_rung_touches_it_along_both_edges(tilt):
    """0.5 mm deep, a sole that is tilted by up to 1 mrad (0.08 mm on a rung of 0.08 m) is on all of it.

    The engine's own test of two boxes finds a single point in a third of these placements.
    """
    spec, size = mujoco.MjSpec(), (0.08, 0.375, 0.025)
    add_scene(
        spec, Scene([Obstacle("rung", Box(size), translation=(0.0, 0.0, -0.0125))], None), {}, ("rung",)
    )
    sole = spec.worldbody.add_body()
    sole.add_freejoint()
    sole.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.09, 0.06, 0.01], mass=1.0)
    model, rng = spec.compile(), np.random.default_rng(0)
    data = mujoco.MjData(model)
    for _ in range(50):
        turn = np.array([*rng.uniform(-tilt, tilt, 2), rng.uniform(-0.02, 0.02)])
        mujoco.mju_axisAngle2Quat(data.qpos[3:], turn / np.linalg.norm(turn), np.linalg.norm(turn))
        data.qpos[:3] = [0.03, rng.uniform(-0.05, 0.05), 0.01 - 5e-4]
        mujoco.mj_forward(model, data)
        assert np.ptp(data.contact.pos[:, 0]) > 0.06
        assert np.ptp(data.contact.pos[:, 1]) > 0.1
