"""The human: structure, dimensions, postures."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from manikin.body import Configuration, ShapeKind, body_from_signature, human, integrate
from manikin.body.human_parts import HUMAN_HINGES
from manikin.errors import BodyError

SEXES = st.sampled_from(["male", "female"])
STATURES = st.floats(1.50, 2.00)
MASSES = st.floats(45.0, 120.0)


@pytest.fixture(scope="module")
def body():
    return human(1.75, 79.0, "male", sole_length=0.28, sole_width=0.12)


def self_distances(body, q):
    """Distance of every collision pair, smallest first."""
    geometry, data = body.geometry, body.pinocchio.createData()
    placed = geometry.createData()
    pin.updateGeometryPlacements(body.pinocchio, data, geometry, placed, q)
    distances = [
        pin.computeDistance(geometry, placed, number).min_distance
        for number in range(len(geometry.collisionPairs))
    ]
    return sorted(zip(distances, body.collision_pairs, strict=True))


def test_structure_is_that_of_qiu(body):
    """19 segments and 45 degrees of freedom, distributed as in Table 2.1."""
    assert len(body.segments) == 19
    assert (body.nv, body.nq) == (45, 46)
    counts = {s.name: len(s.hinges) for s in body.segments}
    assert counts["lumbar"] == counts["thorax"] == counts["neck"] == 3
    assert counts["pelvis"] == counts["head"] == 0
    for side in ("left", "right"):
        limbs = ("upper_arm", "forearm", "hand", "thigh", "leg", "foot", "toes")
        assert [counts[f"{side}_{name}"] for name in limbs] == [3, 2, 2, 3, 2, 2, 1]


def test_joint_order_is_that_of_the_pinocchio_model(body):
    assert tuple(body.pinocchio.names)[2:] == body.joint_names
    np.testing.assert_array_equal(body.pinocchio.lowerPositionLimit[7:], body.lower)
    np.testing.assert_array_equal(body.pinocchio.upperPositionLimit[7:], body.upper)
    np.testing.assert_array_equal(body.pinocchio.upperVelocityLimit[6:], body.velocity_limit)
    np.testing.assert_array_equal(body.pinocchio.lowerEffortLimit[6:], body.torque_lower)
    np.testing.assert_array_equal(body.pinocchio.upperEffortLimit[6:], body.torque_upper)


@given(STATURES, MASSES, SEXES)
def test_stature_and_mass_are_those_asked_for(stature, mass, sex):
    body = human(stature, mass, sex)
    total = pin.computeTotalMass(body.pinocchio)
    assert total == pytest.approx(mass, rel=1e-12)
    assert sum(segment.mass for segment in body.segments) == pytest.approx(mass, rel=1e-12)
    zero = Configuration(body, body.zero_posture())
    top, sole = (zero.effector_placement(name)[1][2] for name in ("head", "right_foot"))
    assert top - sole == pytest.approx(stature, abs=1e-9)


@given(STATURES, MASSES, SEXES)
def test_centre_of_mass_of_a_standing_person(stature, mass, sex):
    """Between 0.55 and 0.57 of the stature above the sole, above the middle of the foot."""
    body = human(stature, mass, sex)
    standing = Configuration(body)
    assert 0.55 < standing.com[2] / stature < 0.57
    sole = standing.effector_placement("left_foot")[1]
    # 2 cm of 28 at 1.75 m: behind the sole's centre, in front of the ankle.
    assert -0.015 * stature < standing.com[0] - sole[0] < 0.0


@given(STATURES, MASSES, SEXES)
def test_standing_body_has_flat_soles_and_clear_limbs(stature, mass, sex):
    body = human(stature, mass, sex)
    q = body.standing_posture()
    standing = Configuration(body, q)
    assert q[0] == q[1] == 0.0
    for side in ("left", "right"):
        rotation, position = standing.effector_placement(f"{side}_foot")
        np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)
        assert position[2] == pytest.approx(0.0, abs=1e-12)
    assert np.all((q[7:] >= body.lower) & (q[7:] <= body.upper))
    distance, pair = self_distances(body, q)[0]
    assert distance >= 0.0199, pair  # 2 cm; the last 0.1 mm for the extreme of build


def test_soles_make_one_flat_rectangle(body):
    """Heel and toe box meet at the metatarsal line, flush with the sole, with the sizes asked for."""
    foot, toes = body.segment("left_foot"), body.segment("left_toes")
    heel_box, toe_box = foot.shapes[0], toes.shapes[0]
    toe_centre = toes.origin + toe_box.translation
    sole = body.effector("left_foot").translation
    assert heel_box.kind == toe_box.kind == ShapeKind.BOX
    for box, centre in ((heel_box, heel_box.translation), (toe_box, toe_centre)):
        assert centre[2] - box.size[2] / 2 == pytest.approx(sole[2], abs=1e-12)
        assert box.size[1] == 0.12
    front_of_heel = heel_box.translation[0] + heel_box.size[0] / 2
    assert front_of_heel == pytest.approx(toe_centre[0] - toe_box.size[0] / 2, abs=1e-12)
    heel, tip = heel_box.translation[0] - heel_box.size[0] / 2, toe_centre[0] + toe_box.size[0] / 2
    assert tip - heel == pytest.approx(0.28, abs=1e-12)
    assert (tip + heel) / 2 == pytest.approx(sole[0], abs=1e-12)
    assert front_of_heel - heel == pytest.approx(0.73 * 0.28, abs=1e-12)
    # The hinge is above the sole, so that raised toes do not dig into the ground.
    assert toes.origin[2] > sole[2]


def test_skull_reaches_the_vertex_and_nothing_is_above_it(body):
    head = body.segment("head")
    skull = head.shapes[0]
    vertex = body.effector("head").translation
    assert skull.translation[2] + skull.size[0] == pytest.approx(vertex[2], abs=1e-12)


def test_sides_are_mirror_images(body):
    """Equal angles on both sides mirror every placement in the sagittal plane."""
    rng = np.random.default_rng(3)
    q = body.zero_posture()
    for name in body.joint_names:
        if name.startswith("left_"):
            hinge = body.hinges[body.joint_index(name)]
            other = body.hinges[body.joint_index("right_" + name[5:])]
            assert (hinge.lower, hinge.upper) == (other.lower, other.upper)
            angle = rng.uniform(hinge.lower, hinge.upper)
            q[7 + body.joint_index(name)] = q[7 + body.joint_index("right_" + name[5:])] = angle
    state = Configuration(body, q)
    mirror = np.diag([1.0, -1.0, 1.0])
    for segment in body.segments:
        if segment.name.startswith("left_"):
            rotation, position = state.segment_placement(segment.name)
            other_rotation, other_position = state.segment_placement("right_" + segment.name[5:])
            np.testing.assert_allclose(mirror @ rotation @ mirror, other_rotation, atol=1e-12)
            np.testing.assert_allclose(mirror @ position, other_position, atol=1e-12)


@pytest.mark.parametrize(("hinge", "effector", "direction"), [
    ("left_hip_flexion", "left_foot", (1, 0, 0)), ("left_hip_abduction", "left_foot", (0, 1, 0)),
    ("right_hip_abduction", "right_foot", (0, -1, 0)), ("left_knee_flexion", "left_foot", (-1, 0, 0)),
    ("right_elbow_flexion", "right_hand", (1, 0, 0)), ("lumbar_flexion", "head", (1, 0, 0)),
    ("lumbar_side_bend", "head", (0, -1, 0)), ("left_shoulder_flexion", "left_hand", (1, 0, 0)),
    ("left_shoulder_abduction", "left_hand", (0, 1, 0)),
    ("right_shoulder_abduction", "right_hand", (0, -1, 0)),
    ("left_wrist_flexion", "left_hand", (0, -1, 0)), ("right_wrist_flexion", "right_hand", (0, 1, 0)),
    ("left_wrist_radial_deviation", "left_hand", (1, 0, 0)), ("left_toe_extension", None, (0, 0, 1)),
])  # fmt: skip
def test_positive_angles_are_the_anatomical_directions(body, hinge, effector, direction):
    """From the zero posture the effector starts to move in the named direction."""
    state = Configuration(body, body.zero_posture())
    column = 6 + body.joint_index(hinge)
    if effector is None:
        velocity = state.point_jacobian("left_toes", [0.05, 0.0, 0.0])[:, column]
    else:
        velocity = state.effector_jacobian(effector)[:3, column]
    assert velocity @ np.array(direction) > 0.5 * np.linalg.norm(velocity)


def test_turning_hinges_turn_the_anatomical_way(body):
    """Inversion lifts the inner edge of the foot, inward rotation points the toes inward."""
    angle = 0.2
    inner = {"left": -1.0, "right": 1.0}
    for side, sign in inner.items():
        state = Configuration(body, body.posture({f"{side}_ankle_inversion": angle}))
        rotation, _ = state.effector_placement(f"{side}_foot")
        assert (rotation @ [0, sign, 0])[2] > 0.1
        for hinge in ("hip_rotation", "knee_rotation"):
            state = Configuration(body, body.posture({f"{side}_{hinge}": angle}))
            rotation, _ = state.effector_placement(f"{side}_foot")
            assert (rotation @ [1, 0, 0])[1] * sign > 0.1
    state = Configuration(body, body.posture({"left_ankle_dorsiflexion": angle}))
    assert (state.effector_placement("left_foot")[0] @ [1, 0, 0])[2] > 0.1


def test_palm_on_a_table_has_the_axes_of_the_world(body):
    """Elbow bent by 90 degrees and forearm fully pronated: x to the fingers, z out of the hand's back."""
    angles = {"left_elbow_flexion": np.pi / 2, "left_forearm_pronation": np.pi / 2}
    state = Configuration(
        body, body.posture({**angles, **{k.replace("left", "right"): v for k, v in angles.items()}})
    )
    for side in ("left", "right"):
        rotation, _ = state.effector_placement(f"{side}_hand")
        np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)


def test_shoulder_is_far_from_gimbal_lock_in_reaching_postures(body):
    """Arm hanging, forward, to the side and overhead: the three axes stay independent.

    The smallest singular value of the three axes is 0 in gimbal lock and 1 for orthogonal axes.
    """
    lift, spread = (np.array(entry.axis) for entry in HUMAN_HINGES["upper_arm"][:2])
    for arm in ([0, 0, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.7, 0.7, 0], [1, -0.5, 0]):
        direction = np.array(arm, dtype=float) / np.linalg.norm(arm)
        angles = {
            "left_shoulder_flexion": float(np.arctan2(direction @ spread, -direction[2])),
            "left_shoulder_abduction": float(np.arcsin(direction @ -lift)),
        }
        state = Configuration(body, body.posture(angles))
        elbow = state.segment_placement("left_forearm")[1] - state.segment_placement("left_upper_arm")[1]
        np.testing.assert_allclose(elbow / np.linalg.norm(elbow), direction, atol=1e-9)
        start = 6 + body.joint_index("left_shoulder_flexion")
        axes = state.segment_jacobian("left_upper_arm")[3:, start : start + 3]
        # Straight to the side and 27 degrees across the chest are the worst of these.
        assert np.linalg.svd(axes, compute_uv=False)[-1] > 0.3


def crouch(body, com_height):
    """Configuration with flat feet 0.25 m apart whose centre of mass is above the sole's centre."""
    guess = body.posture({
        "lumbar_flexion": 0.4, "thorax_flexion": 0.3,
        **{f"{side}_{name}": np.deg2rad(angle) for side in ("left", "right") for name, angle in (
            ("hip_flexion", 90), ("hip_abduction", 10), ("knee_flexion", 110),
            ("ankle_dorsiflexion", 30), ("shoulder_flexion", 50), ("shoulder_abduction", 15),
            ("elbow_flexion", 60),
        )},
    })  # fmt: skip
    guess[2] = 0.5
    state = Configuration(body)

    def residual(step):
        state.update(integrate(body, guess, step))
        parts = [state.com - [0.0, 0.0, com_height], 0.001 * step[6:]]
        for side, y in (("left", 0.125), ("right", -0.125)):
            rotation, position = state.effector_placement(f"{side}_foot")
            parts += [position - [0.0, y, 0.0], pin.log3(np.array(rotation))]
        return np.concatenate(parts)

    free = np.full(6, np.inf)
    bounds = np.concatenate([-free, body.lower - guess[7:]]), np.concatenate([free, body.upper - guess[7:]])
    solution = least_squares(residual, np.zeros(body.nv), bounds=bounds, max_nfev=40)
    return state.update(integrate(body, guess, solution.x))


@pytest.mark.parametrize("height", [0.60, 0.66])
def test_body_can_crouch_under_a_low_roof(body, height):
    """Centre of mass 0.60-0.66 m above flat soles, vertex below 1.26 m, held by the joints' strength."""
    state = crouch(body, height)
    # The posture term pulls the tasks off by less than a millimetre.
    np.testing.assert_allclose(state.com, [0.0, 0.0, height], atol=1e-3)
    assert state.effector_placement("head")[1][2] < 1.26
    assert np.all((state.q[7:] >= body.lower - 1e-9) & (state.q[7:] <= body.upper + 1e-9))
    assert self_distances(body, state.q)[0][0] > 0.0
    torque = state.nonlinear_effects.copy()
    for name in ("left_foot", "right_foot"):
        rotation, position = state.effector_placement(name)
        np.testing.assert_allclose(position[2], 0.0, atol=1e-3)
        np.testing.assert_allclose(rotation, np.eye(3), atol=3e-3)
        force = np.array([0.0, 0.0, body.mass * 9.81 / 2])
        moment = np.cross([state.com[0] - position[0], 0.0, 0.0], force)
        torque -= state.effector_jacobian(name).T @ np.concatenate([force, moment])
    assert body.torque_share(torque[6:]).max() < 0.5


def test_signature_makes_the_same_body_again(body):
    again = body_from_signature(body.signature())
    assert again.signature() == body.signature()
    for first, second in zip(body.segments, again.segments, strict=True):
        assert first.mass == second.mass
        np.testing.assert_array_equal(first.inertia, second.inertia)


@pytest.mark.parametrize("signature", [{}, {"model": "dog"}, {"model": "human", "stature": 1.75}])
def test_broken_signature_is_refused(signature):
    with pytest.raises(BodyError, match="valid"):
        body_from_signature(signature)
