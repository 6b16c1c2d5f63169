import numpy as np
import pytest
from tests.planning.push_pull.conftest import FEW

from manikin.body import Configuration, human
from manikin.contact import ContactKind, grasp
from manikin.kinematics.limb_samples import sample_limbs
from manikin.kinematics.trunk_postures import TrunkClearance, TrunkPostures
from manikin.numerics.spatial import GRAVITY, onto_normal
from manikin.planning.contacts import Candidates, ClosestDistance
from manikin.planning.push_pull import Act, BraceSettings, find_braced_posture
from manikin.planning.push_pull.stance_heuristics import Loads, Mirrored
from manikin.scene import Box, Obstacle, Proximity, Scene


def test_a_push_is_braced_free_and_within_strength(body, scene, brace):
    """Palms on the face, the feet one behind the other, balanced without and with the force, nothing hit."""
    for hand in brace.hands.values():
        assert hand.kind is ContactKind.GRASP
        assert hand.position[0] == pytest.approx(0.5 - BraceSettings().palm_room)
        np.testing.assert_allclose(hand.normal, (-1.0, 0.0, 0.0), atol=1e-9)
    left, right = brace.feet["left_foot"], brace.feet["right_foot"]
    assert left.position[1] > right.position[1]
    assert abs(left.position[0] - right.position[0]) > 0.1
    assert brace.margin >= FEW.margin
    assert brace.forces.torque_share <= FEW.torque_share
    assert brace.largest.force >= 200.0
    found = Proximity(body, scene).evaluate(brace.q, 0.1)
    touching = {"left_hand", "right_hand", "left_foot", "right_foot", "left_toes", "right_toes"}
    for pair, distance in zip(found.pairs, found.distance, strict=True):
        segments = {name.split("/")[0] for name in pair}
        if not (segments & touching and segments & {"cupboard", "floor"}):
            assert distance > 0.0, pair


def test_the_same_request_has_the_same_answer(body, scene, samples, push, brace):
    again = find_braced_posture(body, scene, samples, push, np.zeros(2), settings=FEW)
    np.testing.assert_array_equal(again.brace.q, brace.q)
    assert all(other.forces.torque_share >= brace.forces.torque_share for other in again.others)


def test_efort_needs_less_of_the_joints_strength_than_the_closest_contacts(body, scene, samples, push, brace):
    closest = find_braced_posture(
        body, scene, samples, push, np.zeros(2), settings=FEW,
        hands_by=ClosestDistance(), feet_by=ClosestDistance(),
    )  # fmt: skip
    assert closest.brace is not None
    assert brace.forces.torque_share < closest.brace.forces.torque_share


def test_a_body_acts_at_a_turned_object_on_a_raised_floor(body, samples):
    """The whole scene turned by 90 degrees and raised by 0.4 m gives the same kind of posture there."""
    box = Obstacle("cupboard", Box((1.2, 0.6, 1.9)), translation=(0.0, 0.8, 1.35))
    act = Act("push", "cupboard", (0.0, 1.0, 0.0), 200.0)
    found = find_braced_posture(
        body, Scene([box], floor_height=0.4), samples, act, np.zeros(2), level=0.4, settings=FEW
    )
    assert found.failure is None
    for foot in found.brace.feet.values():
        assert foot.position[2] == pytest.approx(0.4)
    for hand in found.brace.hands.values():
        np.testing.assert_allclose(hand.normal, (0.0, -1.0, 0.0), atol=1e-9)


def test_who_would_slide_puts_a_foot_to_the_wall(body, samples):
    """300 N are more than the friction of a floor with 0.3 holds; one foot is on the wall behind the bar."""
    wall = Obstacle("wall", Box((0.2, 1.2, 1.9)), translation=(1.9, 0.0, 0.95))
    bar = Obstacle("bar", Box((0.05, 0.6, 0.06)), translation=(1.425, 0.0, 0.95))
    act = Act("pull", "bar", (-1.0, 0.0, 0.0), 300.0)
    asked = BraceSettings(enough=1, friction=0.3)
    brace = find_braced_posture(
        body, Scene([wall, bar], 0.0), samples, act, np.zeros(2), settings=asked
    ).brace
    assert brace is not None
    np.testing.assert_allclose(brace.feet["right_foot"].normal, (-1.0, 0.0, 0.0), atol=1e-9)
    assert 0.3 < brace.feet["right_foot"].position[2] < 0.6
    assert brace.feet["left_foot"].position[2] == pytest.approx(0.0)
    pressing = brace.forces.contact_force[list(brace.contacts).index("right_foot"), 0]
    assert pressing < -300.0 + 0.3 * body.mass * GRAVITY
    # The hands hold on before the foot leaves the ground.
    before, holding, lifting, acting = (set(stage.contacts) for stage in brace.stages)
    assert before == {"left_foot", "right_foot"}
    assert holding == acting == before | {"left_hand", "right_hand"}
    assert lifting == acting - {"right_foot"}


@pytest.mark.parametrize("stature", [1.60, 1.88])
def test_the_body_arrives_upright_before_a_bar(stature):
    """0.97 of its height when it stands leaves knees a little bent; the trunk has room there as it stands."""
    small = human(stature, 79.0, "male")
    wall = Obstacle("wall", Box((0.2, 1.2, 1.9)), translation=(1.9, 0.0, 0.95))
    scene = Scene([wall, Obstacle("bar", Box((0.05, 0.6, 0.06)), translation=(1.425, 0.0, 0.95))], 0.0)
    limbs = sample_limbs(small, np.random.default_rng(0), 10_000)
    act, asked = Act("pull", "bar", (-1.0, 0.0, 0.0), 300.0), BraceSettings(enough=1, friction=0.3)
    brace = find_braced_posture(small, scene, limbs, act, np.zeros(2), settings=asked).brace
    assert brace is not None
    arrival = brace.stages[0]
    assert arrival.q[2] > 0.97 * small.standing_posture()[2]
    left, right = (arrival.contacts[f"{side}_foot"] for side in ("left", "right"))
    forwards = left.rotation_contact_to_world[:, 0]
    place = np.append(0.5 * (left.position + right.position), np.arctan2(forwards[1], forwards[0]))
    assert TrunkClearance(TrunkPostures.of(small), scene).cheapest(place[None])[0] == 0


def test_an_object_out_of_reach_is_explained(body, samples, push):
    high = Scene([Obstacle("cupboard", Box((0.6, 1.2, 0.6)), translation=(0.8, 0.0, 3.2))], floor_height=0.0)
    found = find_braced_posture(body, high, samples, push, np.zeros(2))
    assert found.brace is None
    assert "no surface is within reach of left_arm" in found.failure


def test_a_force_beyond_all_postures_is_explained(body, scene, samples):
    act = Act("push", "cupboard", (1.0, 0.0, 0.0), 1500.0)
    found = find_braced_posture(body, scene, samples, act, np.zeros(2), settings=FEW)
    assert found.brace is None
    assert "to push cupboard with 1500 N" in found.failure
    assert "no stance of the feet is balanced without and with the force" in found.failure


def test_an_object_without_a_face_to_the_body_is_explained(body, scene, samples):
    act = Act("push", "floor", (1.0, 0.0, 0.0), 100.0)
    assert "has no face" in find_braced_posture(body, scene, samples, act, np.zeros(2)).failure


def test_feet_slide_where_the_load_is_beyond_their_friction(body, brace, push):
    """On level ground at ``mu m g``: below it there is a margin somewhere, above it nowhere."""
    feet = list(brace.feet.values())
    limit = 0.7 * body.mass * GRAVITY
    near = Configuration(body, brace.q).com
    margins = []
    for force in (0.2 * limit, 1.01 * limit):
        low = np.concatenate([push.reaction(force), np.zeros(3)])  # at the height of the ground: no tipping
        margins.append(Loads(body.mass, low[None]).best_place(feet, near, np.array([0.1, 0.1]))[1])
    assert margins[0] > 0.0
    assert margins[1] == -np.inf


def test_both_hands_hold_the_same_face_of_a_bar():
    """One on the near face and one behind the bar, 5 cm further, would put a forearm through it."""
    other = grasp(
        "left_hand", (1.40, 0.2, 0.95), max_force=400.0, rotation=onto_normal(np.eye(3), [-1.0, 0.0, 0.0])
    )
    points = np.array([[1.40, -0.2, 0.95], [1.45, -0.2, 0.95], [1.40, -0.4, 0.95]])
    normals = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    none = np.zeros(3)
    there = Candidates(
        np.arange(3), np.arange(3), points, normals, np.zeros((3, 3, 3)), none, np.zeros((3, 3, 3))
    )
    alike = Mirrored(other, np.zeros(3), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_array_equal(alike.score(None, there), [1.0, 0.0, 0.0])
