"""Regions of the centre of mass over a stance, from the body's kinematics."""

import numpy as np
import pytest
from scipy.optimize import linprog

from manikin.body import Configuration, human, insect
from manikin.contact import point, sole
from manikin.kinematics import PostureProblem, SolverSettings, generate_posture
from manikin.kinematics.com_reach import NORMALS, ComReach
from manikin.kinematics.step_reach import StepReach
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.scene import Proximity, Scene


def feet(body, *places):
    """Left and right sole at (x, y, z, yaw)."""
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    names = ("left_foot", "right_foot")
    return [sole(name, p[:3], p[3], **size) for name, p in zip(names, places, strict=False)]


@pytest.fixture(scope="module")
def body():
    return human(1.68, 61.0, "female")


def standing_com(body):
    return np.array(Configuration(body, body.standing_posture()).com)


def test_standing_is_in_reach_and_a_com_higher_than_upright_is_not(body):
    """The faces are within 10 cm of upright above, and leave room to crouch to half of that height."""
    state = Configuration(body, body.standing_posture())
    places = [state.effector_placement(f"{side}_foot")[1] for side in ("left", "right")]
    region = ComReach.of(body).region(feet(body, *((*p, 0.0) for p in places)))
    com = standing_com(body)
    assert region.violation(com - [0.0, 0.0, 0.03]) < 0.0
    assert region.violation(com + np.array([0.0, 0.0, 0.10])) > 0.0
    assert region.violation(com - [0.0, 0.0, 0.5 * (com[2] - places[0][2])]) < 0.0


def test_long_strides_lower_the_com_and_impossible_ones_leave_no_region(body):
    reach = ComReach.of(body)
    up = NORMALS[:, 2] > 0.999
    tops = [
        float(reach.region(feet(body, (0, 0.1, 0, 0), (x, -0.1, 0, 0))).offsets[up][0])
        for x in (0.0, 0.4, 0.8)
    ]
    assert tops[0] > tops[1] > tops[2]
    assert reach.region(feet(body, (0, 0.1, 0, 0), (1.6, -0.1, 0, 0))).empty


def test_a_stance_that_few_postures_hold_has_a_region():
    """A long step down on flat feet, by a small woman: few samples come near, in no box."""
    body = human(1.61, 63.9, "female")
    stance = feet(body, (0.554, 0.101, 0.0, 0.0), (0.0, -0.081, 0.153, 0.0))
    region = ComReach.of(body).region(stance)
    assert not region.empty
    # A posture of the whole body, whose spine and arms the sampling simplifies, lies there within 2 cm.
    posed = generate_posture(PostureProblem(body, tuple(stance)), settings=SolverSettings(tolerance=1e-4))
    assert posed.succeeded, posed.failure
    assert region.violation(Configuration(body, posed.q).com) < 0.02


def test_the_region_moves_with_the_stance(body):
    """Turned by 2 rad and moved by 10 m: violations equal to a micrometre."""
    reach = ComReach.of(body)
    stance = [(0.0, 0.12, 0.0, 0.1), (0.3, -0.1, 0.15, -0.4)]
    points = np.random.default_rng(0).uniform([-0.3, -0.4, 0.4], [0.6, 0.4, 1.2], (50, 3))
    c, s = np.cos(2.0), np.sin(2.0)
    turn, shift = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([10.0, -7.0, 0.3])
    moved = [(*(turn @ np.array(p[:3]) + shift), p[3] + 2.0) for p in stance]
    here = reach.region(feet(body, *stance)).violation(points)
    there = reach.region(feet(body, *moved)).violation(points @ turn.T + shift)
    np.testing.assert_allclose(there, here, atol=1e-6)


def test_faces_are_reached_by_full_inverse_kinematics(body):
    """A posture holds both soles with the centre of mass 1 cm inside each of the region's six faces."""
    stance = feet(body, (0.0, 0.1, 0.0, 0.2), (0.45, -0.12, 0.2, -0.1))
    region = ComReach.of(body).region(stance)
    proximity = Proximity(body, Scene([], floor_height=None))
    rng = np.random.default_rng(1)
    axes = region.normals[[21, 15, 13]]
    low, high = -region.offsets[[4, 10, 12]], region.offsets[[21, 15, 13]]
    points = rng.uniform(low, high, (400, 3)) @ axes
    inside = points[region.violation(points) < -0.01][:8]
    found = [
        generate_posture(
            PostureProblem(body, tuple(stance), com=p, proximity=proximity),
            settings=SolverSettings(tolerance=1e-3, explain=False),
        ).succeeded
        for p in inside
    ]
    assert len(found) == 8
    assert all(found)


def test_limbs_of_other_bodies_have_regions_too():
    """An insect on six points, as it stands: its centre of mass is in reach, half a metre aside it is not."""
    body = insect()
    state = Configuration(body, body.standing_posture())
    contacts = [
        point(limb.effector, state.effector_placement(limb.effector)[1], friction=0.7) for limb in body.limbs
    ]
    region = ComReach.of(body).region(contacts)
    assert not region.empty
    assert region.violation(state.com) < 0.01
    assert region.violation(state.com + np.array([0.5, 0.0, 0.0])) > 0.0


def test_places_of_a_foot_grow_with_the_body_and_are_mirrored():
    """A scaled body reaches scaled places; a place of the left foot is that of the right one reflected."""
    short, tall = (StepReach.of(human(stature, 22.0 * stature**2, "male")) for stature in (1.6, 1.92))
    places = np.random.default_rng(2).uniform([-0.6, -0.5, -0.4, -0.8], [0.6, 0.0, 0.4, 0.8], (200, 4))
    scaled = places * [1.2, 1.2, 1.2, 1.0]
    np.testing.assert_allclose(tall.room(scaled), 1.2 * short.room(places), rtol=1e-6, atol=1e-9)
    reflected = places * [1.0, -1.0, 1.0, -1.0]
    np.testing.assert_allclose(short.room(reflected, "left_foot"), short.room(places))


@pytest.mark.parametrize("heels", ["down", "both up"])
def test_a_foot_reaches_as_far_down_as_up(heels):
    """Whoever has one foot up has the other down; to the 32 bits of the table."""
    reach = StepReach.of(human(1.75, 70.0, "male"), heels)
    free = [(None, None)] * 4
    up, down = (linprog([0.0, 0.0, sign, 0.0], reach.A, reach.b, bounds=free).fun for sign in (-1.0, 1.0))
    assert up < -0.7
    assert down == pytest.approx(up, rel=1e-5)


def test_the_shipped_places_are_those_that_sampling_finds():
    """Few rounds of sampling reach no place beyond the table by more than 2 cm."""
    body = human(1.75, 70.0, "male")
    sampled, shipped = StepReach.sampled(body, rounds=8), StepReach.of(body)
    places = np.random.default_rng(3).uniform([-1.0, -0.8, -0.6, -1.0], [1.0, 0.0, 0.6, 1.0], (2000, 4))
    inside = sampled.contains(places)
    assert inside.sum() > 20
    assert shipped.room(places[inside]).min() > -0.02


def test_a_high_step_down_needs_the_rear_heel():
    """0.45 m down and half a metre ahead, the body resting on the lower foot: not with both soles flat.

    A man of 1.75 m; people step down as far.
    """
    body, place = human(1.75, 75.0, "male"), np.array([[0.50, -0.15, -0.45, 0.0]])
    flat, raised = (StepReach.sampled(body, heels, "moved", rounds=100) for heels in ("down", "standing up"))
    assert flat.room(place)[0] < -0.1
    assert raised.contains(place)[0]


@pytest.mark.parametrize(("ahead", "rests"), [(0.35, True), (0.80, False)])
def test_steps_at_rest_are_shorter_than_those_that_legs_reach(ahead, rests):
    """A posture on flat soles over the rear foot exists 0.35 m ahead, and not 0.80 m, which legs reach."""
    body = human(1.75, 70.0, "male")
    left, right = feet(body, (0.0, 0.1, 0.0, 0.0), (ahead, -0.1, 0.0, 0.0))
    place = np.array([[ahead, -0.2, 0.0, 0.0]])
    assert StepReach.of(body).contains(place)[0]
    assert StepReach.at_rest(body).contains(place)[0] == rests
    held = {contact.effector: contact for contact in (left, right)}
    found = PostureFinder(body, Scene([], 0.0)).pose(
        held, {"left_foot": left}, np.array(body.standing_posture()), restarts=True
    )
    assert (found.q is not None) == rests


def test_shipped_sets_at_rest_are_those_that_sampling_finds():
    """Places that few rounds of sampling reach are at most 5 cm beyond the sets of either foot.

    Hulls of a hundred extreme places each leave out that much where these are far apart.
    """
    body = human(1.75, 70.0, "female")
    places = np.random.default_rng(3).uniform([-0.8, -0.7, -0.5, -0.8], [0.8, 0.0, 0.5, 0.8], (2000, 4))
    for rest in ("standing", "moved"):
        inside = StepReach.sampled(body, rest=rest, rounds=60).contains(places)
        assert inside.sum() > 20
        assert StepReach.of(body, rest=rest).room(places[inside]).min() > -0.05
