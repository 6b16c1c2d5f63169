"""Limbs: chains, mirrors, forward kinematics of many samples, reach."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import (
    Configuration,
    Limb,
    ShapeKind,
    are_mirrored,
    human,
    insect,
    limb_named,
    limb_placement,
    random_configuration,
    with_further_contacts,
    with_knees_and_elbows,
)
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.body.limbs import is_further, limb_slots, parent_segment, with_round_tips
from manikin.body.natural_range import NaturalRange
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.kinematics import LimbKinematics, reach_volume
from manikin.kinematics.limb_kinematics import hull_of

BODIES = {"human": with_knees_and_elbows(human()), "insect": insect()}
LIMBS = [pytest.param(body, limb, id=limb.name) for body in BODIES.values() for limb in body.limbs]
SITTER = with_further_contacts(human())
PELVIS = limb_named(SITTER, "pelvis")


def test_a_human_has_arms_and_legs_and_with_knees_and_elbows_eight_limbs():
    assert [limb.name for limb in human().limbs] == ["left_arm", "right_arm", "left_leg", "right_leg"]
    further = BODIES["human"].limbs[4:]
    assert {limb.name for limb in further} == {"left_knee", "right_knee", "left_elbow", "right_elbow"}
    assert all(limb.kind is ContactKind.POINT for limb in further)


def test_an_insect_has_six_legs_of_five_hinges_and_a_free_root():
    """36 degrees of freedom, as in the results of the thesis."""
    body = insect()
    assert [len(limb_slots(body, limb)) for limb in body.limbs] == [5] * 6
    assert body.nv == 36
    assert body.mass == pytest.approx(2.0)


def test_an_insect_stands_on_six_tips_under_a_lifted_trunk():
    body = insect()
    state = Configuration(body, body.standing_posture())
    tips = np.array([state.effector_placement(limb.effector)[1] for limb in body.limbs])
    assert np.abs(tips[:, 2]).max() < 1e-9
    assert 0.05 < state.q[2] < 0.3
    down = [state.effector_placement(limb.effector)[0][2, 2] for limb in body.limbs]
    assert min(down) > 0.8
    # Left tips in front of each other, and the centre of mass inside of all of them.
    assert tips[0, 0] > tips[2, 0] > tips[4, 0]
    assert tips[:, :2].min(axis=0)[1] < state.com[1] < tips[:, :2].max(axis=0)[1]


def test_further_contacts_are_those_asked_for():
    assert SITTER.limbs == (*BODIES["human"].limbs, PELVIS)
    assert [limb.name for limb in with_further_contacts(human(), ["pelvis"]).limbs[4:]] == ["pelvis"]
    assert with_further_contacts(human(), ()).limbs == human().limbs
    further = [limb.name for limb in SITTER.limbs if is_further(SITTER, limb)]
    assert further == ["left_knee", "right_knee", "left_elbow", "right_elbow", "pelvis"]
    with pytest.raises(BodyError, match=r"^further contact is 'nose'; valid: knees, elbows, pelvis$"):
        with_further_contacts(human(), ("nose",))
    with pytest.raises(BodyError, match="valid: a human"):
        with_further_contacts(insect(), ("pelvis",))


def test_a_pelvis_is_a_limb_without_joints_that_touches_with_what_a_human_sits_on():
    """Its frame is the root's, and its patch the rectangle that presses on a seat."""
    assert (PELVIS.effector, PELVIS.kind, PELVIS.mirror) == ("buttocks", ContactKind.SOLE, None)
    assert PELVIS.patch == pytest.approx((SEAT_LENGTH * 1.75, SEAT_WIDTH * 1.75))
    assert len(limb_slots(SITTER, PELVIS)) == 0
    assert parent_segment(SITTER, PELVIS) == "pelvis"
    with pytest.raises(BodyError, match="patch is"):
        replace(SITTER, limbs=(replace(PELVIS, patch=(0.1, 0.0)),))


def test_the_reach_of_a_pelvis_is_a_small_cube_that_goes_with_the_root():
    volume = reach_volume(SITTER, PELVIS, np.random.default_rng(0))
    place = SITTER.effector("buttocks").translation
    centre, radius = volume.inscribed_sphere
    assert np.allclose(centre, place, atol=1e-9)
    assert radius == pytest.approx(0.03)
    assert volume.residual(place + np.array([0.0, 0.0, 0.04])) == pytest.approx(-0.01)


def test_nothing_in_a_limb_without_joints_can_be_violated():
    chain = LimbKinematics(SITTER, PELVIS)
    angles = chain.random_angles(np.random.default_rng(0), 5)
    assert angles.shape == (5, 0)
    natural = NaturalRange(SITTER, PELVIS)
    assert (natural.normalised(angles) == 1.0).all()
    assert natural.normalised(angles).min() >= 0.0


@pytest.mark.parametrize(("body", "limb"), [*LIMBS, pytest.param(SITTER, PELVIS, id="pelvis")])
def test_forward_kinematics_of_a_limb_are_those_of_the_whole_body(body, limb):
    """Placement and Jacobian against Pinocchio, wherever the root is."""
    rng = np.random.default_rng(1)
    chain, columns = LimbKinematics(body, limb), limb_slots(body, limb) - 1
    samples = [random_configuration(body, rng) for _ in range(20)]
    found = chain.place(np.array([q[chain.slots] for q in samples]))
    for number, q in enumerate(samples):
        state = Configuration(body, q)
        rotation, origin = limb_placement(state, limb)
        turn, place = state.effector_placement(limb.effector)
        assert np.abs(origin + rotation @ found.positions[number] - place).max() < 1e-9
        assert np.abs(rotation @ found.rotations[number] - turn).max() < 1e-9
        jacobian = state.effector_jacobian(limb.effector)[:3, columns]
        assert np.abs(rotation @ found.jacobians[number] - jacobian).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("rigid", [(), ("upper_arm",), ("forearm",), ("hand",), ("upper_arm", "hand")])
def test_segments_of_a_limb_are_placed_whether_hinges_move_them_or_not(rigid):
    """Axes and origins against those of the whole body; some segments are rigid on their parents."""
    person, names = human(), [f"left_{part}" for part in rigid]
    segments = [replace(part, hinges=()) if part.name in names else part for part in person.segments]
    kept = {hinge.name for segment in segments for hinge in segment.hinges}
    angles = {name: angle for name, angle in person.standing_angles.items() if name in kept}
    body = replace(person, segments=tuple(segments), standing_angles=angles)
    rng, limb = np.random.default_rng(8), limb_named(body, "left_arm")
    chain, samples = LimbKinematics(body, limb), [random_configuration(body, rng) for _ in range(5)]
    placed = list(chain.segment_placements(np.array([q[chain.slots] for q in samples])))
    assert [name for name, _, _ in placed] == list(limb.segments)
    for number, q in enumerate(samples):
        state = Configuration(body, q)
        rotation, origin = limb_placement(state, limb)
        for name, turns, places in placed:
            turn, place = state.segment_placement(name)
            np.testing.assert_allclose(rotation @ turns[number], turn, atol=1e-9)
            np.testing.assert_allclose(origin + rotation @ np.array(places)[number], place, atol=1e-9)


@given(st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_the_jacobian_of_an_arm_is_the_derivative_of_its_position(shares):
    body = BODIES["human"]
    chain = LimbKinematics(body, limb_named(body, "left_arm"))
    angles = chain.lower + np.array(shares) * (chain.upper - chain.lower)
    step = 1e-6 * np.eye(len(chain))
    ahead, behind = chain.place(angles + step).positions, chain.place(angles - step).positions
    assert np.allclose(chain.place(angles[None]).jacobians[0], (ahead - behind).T / 2e-6, atol=1e-8)


@pytest.mark.parametrize(("body", "limb"), LIMBS)
def test_equal_angles_of_mirrored_limbs_are_mirrored_places(body, limb):
    other = limb_named(body, limb.mirror)
    assert other.mirror == limb.name
    assert are_mirrored(body, limb, other)
    one, two = LimbKinematics(body, limb), LimbKinematics(body, other)
    angles = one.random_angles(np.random.default_rng(2), 50)
    first, second = one.place(angles), two.place(angles)
    mirror = np.diag([1.0, -1.0, 1.0])
    assert np.allclose(first.positions @ mirror, second.positions, atol=1e-12)
    assert np.allclose(mirror @ first.rotations @ mirror, second.rotations, atol=1e-12)
    assert np.allclose(mirror @ first.jacobians, second.jacobians, atol=1e-12)


def test_limbs_that_are_no_mirror_images_are_told_apart():
    body = insect()
    front, rear = limb_named(body, "left_front_leg"), limb_named(body, "right_rear_leg")
    assert not are_mirrored(body, front, rear)
    person = BODIES["human"]
    assert not are_mirrored(person, limb_named(person, "left_arm"), limb_named(person, "left_leg"))


def test_kneeling_on_a_knee_and_leaning_on_an_elbow_touch_from_below():
    """Shank 6 degrees up to the foot, forearm level before the elbow: both normals point up."""
    body = BODIES["human"]
    bent = np.pi / 2
    q = body.posture({"left_knee_flexion": bent + np.radians(6.0), "left_elbow_flexion": bent})
    state = Configuration(body, q)
    for name in ("left_knee", "left_elbow"):
        turn, place = state.effector_placement(name)
        assert turn[2, 2] > 0.999
        joint = state.segment_placement(body.effector(name).segment)[1]
        assert place[2] < joint[2] - 0.03


@pytest.mark.parametrize(("body", "limb"), LIMBS)
def test_reach_is_convex_closed_and_holds_every_sample(body, limb):
    volume = reach_volume(body, limb, np.random.default_rng(3), 2000)
    assert np.allclose(np.linalg.norm(volume.A, axis=1), 1.0)
    corners = volume.vertices[volume.faces]
    # Closed: the area vectors add up to nothing; outward: the volume is positive.
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(area.sum(axis=0)).max() < 1e-9
    assert np.einsum("fi,fi->", corners[:, 0], area) / 3 > 0.0
    assert (np.einsum("fi,fi->f", area, volume.A) >= 0.0).all()
    assert np.abs(np.einsum("fki,fi->fk", corners, volume.A) - volume.b[:, None]).max() < 1e-9
    assert volume.segment == parent_segment(body, limb)
    same = LimbKinematics(body, limb)
    places = same.place(same.random_angles(np.random.default_rng(3), 2000)).positions
    assert volume.residual(places + body.segment(limb.segments[0]).origin).min() >= -1e-9


def test_reach_is_within_the_length_of_the_arm_and_the_same_for_a_seed():
    body = human()
    arm = limb_named(body, "left_arm")
    first, second = (reach_volume(body, arm, np.random.default_rng(4)) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    origin = body.segment("left_upper_arm").origin
    palm = float(np.linalg.norm(body.effector("left_hand").translation))
    stretched = sum(abs(body.segment(f"left_{part}").origin[2]) for part in ("forearm", "hand")) + palm
    farthest = np.linalg.norm(first.vertices - origin, axis=1).max()
    assert 0.97 * stretched < farthest <= stretched + 1e-9


def test_the_inscribed_sphere_touches_the_hull_from_inside():
    body = human()
    volume = reach_volume(body, limb_named(body, "right_leg"), np.random.default_rng(5), 2000)
    centre, radius = volume.inscribed_sphere
    assert volume.residual(centre) == pytest.approx(radius, abs=1e-9)
    directions = np.random.default_rng(6).standard_normal((200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert volume.residual(centre + radius * directions).min() >= -1e-9


def test_a_unit_cube_has_a_sphere_of_half_its_side():
    cube = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    volume = hull_of(human().limbs[0], "thorax", cube)
    centre, radius = volume.inscribed_sphere
    assert radius == pytest.approx(0.5)
    assert np.allclose(centre, 0.5)
    assert volume.residual([[0.5, 0.5, 0.9], [2.0, 0.5, 0.5]]) == pytest.approx([0.1, -1.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"segments": ("left_thigh", "left_foot")}, "goes from 'left_thigh' to 'left_foot'"),
        ({"segments": ("pelvis", "left_thigh")}, "the root not among them"),
        ({"segments": ("left_wing",)}, "'left_wing'"),
        ({"segments": ()}, "segment none"),
        ({"effector": "right_foot"}, "valid: one of ['left_foot']"),
        ({"mirror": "tail"}, "mirror is 'tail'"),
    ],
)
def test_a_wrong_limb_is_refused_in_one_line(changes, message):
    body = human()
    leg = Limb("left_leg", "left_foot", ("left_thigh", "left_leg", "left_foot"), ContactKind.SOLE)
    with pytest.raises(BodyError) as caught:
        replace(body, limbs=(replace(leg, **changes),))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_misuse_is_refused():
    body = human()
    arm = body.limbs[0]
    with pytest.raises(BodyError, match="twice"):
        replace(body, limbs=(replace(arm, mirror=None), replace(arm, mirror=None)))
    with pytest.raises(BodyError, match="no limb 'tail'; valid: left_arm"):
        limb_named(body, "tail")
    with pytest.raises(BodyError, match="at least 100"):
        reach_volume(body, arm, np.random.default_rng(0), 10)
    with pytest.raises(BodyError, match=r"valid: \(n, 7\)"):
        LimbKinematics(body, arm).place(np.zeros(7))
    with pytest.raises(BodyError, match="of a plane only"):
        hull_of(arm, "thorax", np.random.default_rng(0).uniform(size=(50, 3)) * [1, 1, 0])
    with pytest.raises(BodyError, match="insect length"):
        insect(length=0.0)


# The tips of the fingers, 189 mm from the wrist, come down by the 26 mm before the palm at 8 degrees.
@pytest.mark.parametrize(("part", "tilt"), [("knee", 0.0), ("wrist", 0.0), ("wrist", 6.0)])
def test_what_carries_at_a_point_touches_there_first(part, tilt):
    """A segment with a ball at its tip, tilted either way, touches the ground with the ball alone."""
    body, name = human(), f"left_{part}"
    frame = body.effector(name)
    segment = with_round_tips(body, [name]).segment(frame.segment)
    ball, others = segment.shapes[-1], segment.shapes[:-1]
    assert ball.distance_to(frame.translation) == pytest.approx(0.0, abs=1e-12)
    for axis in (frame.rotation[:, 0], frame.rotation[:, 1]):
        for angle in np.radians((tilt, -tilt)):
            up = np.cos(angle) * frame.rotation[:, 2] + np.sin(angle) * axis
            ground = up @ ball.translation - ball.size[0]
            # A plane below a shape: its lowest point is that of its support function.
            assert all(up @ shape.translation - support(shape, up) > ground for shape in others)


def support(shape, up):
    """How far a box or a capsule extends along a unit vector from its middle [m]."""
    local = shape.rotation.T @ up
    if shape.kind is ShapeKind.BOX:
        return 0.5 * np.abs(local) @ shape.size
    return shape.size[0] + 0.5 * abs(local[2]) * shape.size[1]


def test_bodies_without_such_points_stay_as_they_are():
    """Feet, flat hands and tips of insects touch with their own shapes."""
    person, creature = human(), insect()
    assert with_round_tips(person, ["left_foot", "left_hand"]) is person
    assert with_round_tips(creature, creature.effectors) is creature
