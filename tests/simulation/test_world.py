import numpy as np
import pinocchio as pin
import pytest

from manikin.body import Configuration, human
from manikin.errors import BodyError, InputError
from manikin.numerics.spatial import GRAVITY_VECTOR
from manikin.scene import Box, Obstacle, Scene
from manikin.simulation import PhysicsOptions, Push, World, compile_model
from manikin.simulation.execute import CONTACT_TIME
from manikin.simulation.world import Grip


@pytest.fixture
def world(body):
    made = World(compile_model(body, Scene(), PhysicsOptions(joint_damping=1.0)))
    made.reset(body.standing_posture())
    return made


@pytest.fixture
def flying(body):
    """No floor, no gravity to speak of in 10 ms."""
    made = World(compile_model(body, Scene(floor_height=None)))
    made.reset(body.standing_posture())
    return made


def momentum(body, q, v):
    model, data = body.pinocchio, body.pinocchio.createData()
    pin.computeCentroidalMomentum(model, data, q, v)
    return data.hg.linear.copy()


def test_states_come_back_in_pinocchio_order(body, world):
    """What is put in comes out, with the free flyer's velocity in the pelvis frame."""
    rng = np.random.default_rng(0)
    q = pin.integrate(body.pinocchio, body.standing_posture(), 0.1 * rng.normal(size=body.nv))
    v = rng.normal(size=body.nv)
    world.reset(q, v, time=2.0)
    assert np.allclose(world.q, q, atol=1e-12)
    assert np.allclose(world.v, v, atol=1e-12)
    assert world.time == 2.0


def test_push_changes_the_momentum_by_its_impulse(body, flying):
    """A push of 200 N over 5 ms gives 1 N.s (gravity apart), only while it lasts."""
    flying.apply_push(Push("thorax", np.array([200.0, 0.0, 0.0]), start=0.002, duration=0.005))
    flying.advance(np.zeros(body.nv - 6), 20)
    gained = momentum(body, flying.q, flying.v)
    assert gained[0] == pytest.approx(1.0, abs=1e-3)
    assert gained[1] == pytest.approx(0.0, abs=1e-3)
    assert gained[2] == pytest.approx(-9.81 * body.mass * 0.020, rel=1e-3)


def test_measured_wrenches_obey_newton_and_euler(body, world):
    """The sensed forces are m (a - g) and Ldot about the CoM of the sensed state."""
    rng = np.random.default_rng(1)
    model, data = body.pinocchio, body.pinocchio.createData()
    for _ in range(10):
        world.advance(20.0 * rng.normal(size=body.nv - 6), 3)
        q, v = world.q, world.v
        world.advance(20.0 * rng.normal(size=body.nv - 6), 1)
        sensed = world.sense()
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, sensed.a)
        wrench = sensed.wrench(data.com[0])
        # Forces reach 8 kN here; the engine's solver leaves about 1e-6 of that.
        assert wrench[:3] + body.mass * GRAVITY_VECTOR == pytest.approx(data.dhg.linear, abs=0.02)
        assert wrench[3:] == pytest.approx(data.dhg.angular, abs=0.02)


def test_mean_wrench_is_the_mean_of_the_steps(body, world):
    """The root's constraint force is the sum of the contact forces, step by step."""
    world.mean_wrench()
    total = np.zeros(6)
    for _ in range(8):
        world.advance(np.zeros(body.nv - 6), 1)
        total += world.sense().wrench(np.zeros(3))
    assert world.mean_wrench() == pytest.approx(total / 8, abs=1e-6)


def test_unplanned_touches_are_reported_by_name_and_time(body, world):
    """Feet on the floor are unplanned until they are planned."""
    world.advance(np.zeros(body.nv - 6), 10)
    assert {(touch.segment, touch.other) for touch in world.touches} >= {("left_foot", "floor")}
    assert world.touches[0].time < 0.01
    assert "touches floor at" in str(world.touches[0])
    world.reset(body.standing_posture())
    feet = ("left_foot", "left_toes", "right_foot", "right_toes")
    world.plan_touches([(feet, "floor")])
    world.advance(np.zeros(body.nv - 6), 10)
    assert world.touches == ()
    assert world.touching(("left_foot",), "floor")
    assert not world.touching(("left_hand",), "floor")
    assert 0 < world.penetration < 1e-3


def test_self_touches_are_unplanned(body):
    """An arm folded into the trunk is reported."""
    world = World(compile_model(body, Scene(floor_height=None)))
    q = body.posture({"left_shoulder_abduction": -0.7})
    world.reset(q)
    world.advance(np.zeros(body.nv - 6), 1)
    assert any("left" in touch.segment + touch.other for touch in world.touches)


def test_grip_holds_a_hand_with_limited_force(body):
    """The gripped hand stays within a centimetre; beyond its force the grip slips."""
    for force, holds in ((2000.0, True), (100.0, False)):
        world = World(compile_model(body, Scene(floor_height=None), PhysicsOptions(joint_damping=2.0)))
        world.reset(body.standing_posture())
        site = world.model.site_id("right_hand")
        start = world._data.site_xpos[site].copy()
        world.grip(Grip("right_hand", start, force))
        world.advance(np.zeros(body.nv - 6), 150)
        moved = np.linalg.norm(world._data.site_xpos[site] - start)
        assert (moved < 0.02) == holds
        pull = world.sense().grip_wrench("right_hand", start)[:3]
        assert np.abs(pull).max() <= force + 1e-9
        world.release("right_hand")
        assert np.array_equal(world.sense().grip_wrench("right_hand", start), np.zeros(6))


@pytest.mark.parametrize(("stature", "mass"), [(1.5, 45.0), (1.75, 79.0), (1.95, 120.0)])
def test_a_grip_is_as_stiff_as_the_other_contacts(stature, mass):
    """Critically damped with their time constant, for the mass that the scene feels of this body's hand."""
    body = human(stature=stature, mass=mass)
    state = Configuration(body, body.standing_posture())
    rows = state.effector_jacobian("right_hand")[:3]
    felt = 1.0 / np.linalg.eigvalsh(rows @ np.linalg.solve(state.mass_matrix, rows.T)).max()
    world = World(compile_model(body, Scene(floor_height=None)))
    world.reset(body.standing_posture())
    assert world.least_mass("right_hand") == pytest.approx(felt, rel=1e-6)
    grip = Grip.of_mass("right_hand", np.zeros(3), 400.0, felt, CONTACT_TIME)
    assert grip.stiffness * CONTACT_TIME**2 == pytest.approx(felt)
    assert grip.damping**2 == pytest.approx(4.0 * felt * grip.stiffness)


def test_gripping_hand_passes_through_what_it_grips(body):
    """A hand does not collide with the scene while it holds on, and does again afterwards."""
    q = body.standing_posture()
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    place = data.oMf[body.effector_frame("right_hand")].translation.copy()
    bar = Obstacle("bar", Box((0.03, 0.03, 0.3)), translation=place)
    world = World(compile_model(body, Scene([bar], floor_height=None)))
    world.reset(q)
    world.grip(Grip("right_hand", place, 500.0))
    world.advance(np.zeros(body.nv - 6), 1)
    assert not any(touch.segment == "right_hand" and touch.other == "bar" for touch in world.touches)
    world.release("right_hand")
    world.advance(np.zeros(body.nv - 6), 1)
    assert any(touch.segment == "right_hand" and touch.other == "bar" for touch in world.touches)


def test_misuse_is_refused(world):
    with pytest.raises(BodyError, match="valid"):
        world.apply_push(Push("tail", np.array([1.0, 0, 0]), 0.0, 0.1))
    with pytest.raises(InputError, match="push duration"):
        Push("thorax", np.array([1.0, 0, 0]), 0.0, 0.0)
    with pytest.raises(InputError, match="planned touch of obstacle 'moon'"):
        world.plan_touches([(("left_foot",), "moon")])


def test_what_the_body_leans_on_counts_as_a_push(body):
    """Two blocks under the feet, one of them padded: the mean wrench is that of the other foot alone."""
    blocks = [
        Obstacle("block", Box((0.4, 0.3, 0.2)), translation=(0.1, 0.15, -0.1)),
        Obstacle("cushion", Box((0.4, 0.3, 0.2)), translation=(0.1, -0.15, -0.1)),
    ]
    world = World(compile_model(body, Scene(blocks, floor_height=None)), padded=("cushion",))
    everything = tuple(segment.name for segment in body.segments)
    world.plan_touches([(everything, "block")], leaning=[(everything, "cushion")])
    world.reset(body.standing_posture())
    world.mean_wrench()
    on_block, on_cushion, deepest = np.zeros(6), np.zeros(6), {"block": 0.0, "cushion": 0.0}
    for _ in range(8):
        world.advance(np.zeros(body.nv - 6), 1)
        sensed = world.sense()
        for position, force, other, depth in zip(
            sensed.positions, sensed.forces, sensed.others, sensed.depths, strict=True
        ):
            wrench = np.concatenate((force, np.cross(position, force)))
            total = on_cushion if other == "cushion" else on_block
            total += wrench / 8
            deepest[other] = max(deepest[other], depth)
    assert on_cushion[2] > 100.0
    assert world.mean_wrench() == pytest.approx(on_block, abs=1e-6)
    assert world.touches == ()
    assert world.penetration == pytest.approx(deepest["block"], abs=1e-12)
    assert world.padding_compression == pytest.approx(deepest["cushion"], abs=1e-12)


def test_carried_points_are_the_mean_of_all_steps_without_what_is_leant_on(body):
    """Normal forces times normals are those of the engine; a cushion that is leant on has none."""
    blocks = [
        Obstacle("block", Box((0.4, 0.3, 0.2)), translation=(0.1, 0.15, -0.1)),
        Obstacle("cushion", Box((0.4, 0.3, 0.2)), translation=(0.1, -0.15, -0.1)),
    ]
    world = World(compile_model(body, Scene(blocks, floor_height=None)), padded=("cushion",))
    everything = tuple(segment.name for segment in body.segments)
    world.plan_touches([(everything, "block")], leaning=[(everything, "cushion")])
    world.reset(body.standing_posture())
    world.carried()
    wanted = np.zeros(3)
    for _ in range(8):
        world.advance(np.zeros(body.nv - 6), 1)
        sensed = world.sense()
        on_block = np.array([other == "block" for other in sensed.others])
        normal = np.einsum("ki,ki->k", sensed.forces, sensed.normals)
        wanted += (normal[:, None] * sensed.normals)[on_block].sum(axis=0) / 8
    found = world.carried()
    assert set(found.others) == {"block"}
    assert all(name.startswith("left_") for name in found.segments)
    assert found.forces @ found.normals == pytest.approx(wanted, abs=1e-9)
    assert wanted[2] > 100.0
    assert not len(world.carried().forces)
