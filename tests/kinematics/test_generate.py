"""The posture generator: requirements exact, limits and clearances kept, failures explained."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.body.configuration import Configuration
from manikin.contact import grasp, point
from manikin.errors import BodyError, InputError
from manikin.kinematics import (
    Placement,
    PostureProblem,
    SolverSettings,
    com_target,
    generate_posture,
    place_over_contacts,
    touching_pairs,
)
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import Box, Obstacle, Proximity, Scene, SphereProximity


def certify(problem, result, tolerance=1e-6):
    """Measure everything afresh: contacts, placements, centre of mass, limits, distances."""
    assert result.succeeded, result.failure
    assert result.failure is None
    body = problem.body
    configuration = Configuration(body, result.q)
    for contact in problem.contacts:
        rotation, position = configuration.effector_placement(contact.effector)
        np.testing.assert_allclose(position, contact.position, atol=tolerance)
        if contact.kind == "sole":
            np.testing.assert_allclose(rotation, contact.rotation_contact_to_world, atol=2 * tolerance)
    for name, placement in problem.placements.items():
        rotation, position = configuration.effector_placement(name)
        if placement.position is not None:
            np.testing.assert_allclose(position, placement.position, atol=tolerance)
        if placement.rotation is not None and placement.rotation_weight is None:
            np.testing.assert_allclose(rotation, placement.rotation, atol=2 * tolerance)
    if problem.com is not None:
        given_axes = np.isfinite(problem.com)
        np.testing.assert_allclose(configuration.com[given_axes], problem.com[given_axes], atol=tolerance)
    assert np.all(result.q[7:] >= body.lower - 1e-9)
    assert np.all(result.q[7:] <= body.upper + 1e-9)
    if problem.proximity is not None:
        closest = problem.proximity.minimum(result.q, problem.ignore)
        # The generator may intrude by 0.1 mm.
        assert closest.distance >= min(problem.clearance, problem.self_clearance) - 1e-4
    return configuration


@pytest.mark.parametrize("key", range(8))
def test_key_postures_of_the_platform_scenario(platform, key):
    """All eight exist with 2 cm to roof, threshold and platform; the trunk stays human."""
    problem = platform.problem(key)
    configuration = certify(problem, generate_posture(problem))
    near = platform.proximity.evaluate(configuration.q, 0.1, problem.ignore)
    scene = [d for d, (_, other) in zip(near.distance, near.pairs, strict=True) if "/" not in other]
    assert min(scene, default=1.0) >= 0.02 - 1e-4
    heads_up = configuration.segment_placement("head")[0][2, 2]
    assert heads_up > np.cos(np.deg2rad(30))
    facing = configuration.segment_placement("pelvis")[0][:2, 0]
    assert facing[1] > np.cos(np.deg2rad(35)) * np.linalg.norm(facing)


def test_the_end_posture_is_a_crouch_under_the_roof(platform):
    """Head below the roof, knees bent, though the body would be taller."""
    result = generate_posture(platform.problem(7))
    configuration = Configuration(platform.body, result.q)
    assert configuration.effector_placement("head")[1][2] < 1.475
    knee = platform.body.joint_index("left_knee_flexion")
    assert np.rad2deg(result.q[7 + knee]) > 60


def test_a_neighbouring_posture_is_found_from_the_first(platform):
    """Warm starts need few iterations and stay close."""
    problem = platform.problem(0)
    first = generate_posture(problem)
    moved = platform.problem(0)
    moved = PostureProblem(**{**vars(moved), "com": np.array([0.005, 0.003, 0.918])})
    second = generate_posture(moved, first.q)
    certify(moved, second)
    assert second.iterations <= 6
    assert np.abs(second.q[7:] - first.q[7:]).max() < 0.1


@given(
    st.floats(-0.03, 0.06), st.floats(-0.05, 0.05), st.floats(0.55, 0.95),
    st.floats(-0.2, 0.2), st.floats(-0.05, 0.1),
)  # fmt: skip
@settings(max_examples=15)
def test_every_centre_of_mass_over_the_feet_is_reached(on_the_floor, x, y, z, stride, widen):
    """From an almost upright stance to a deep squat, feet apart and in stride."""
    problem = on_the_floor()
    contacts = []
    for contact, sign in zip(problem.contacts, (1, -1), strict=True):
        place = np.add(contact.position, (0.5 * sign * stride, 0.5 * sign * widen, 0))
        contacts.append(type(contact)(**{**vars(contact), "position": place}))
    problem = on_the_floor(contacts=tuple(contacts), com=(x, y, z))
    certify(problem, generate_posture(problem))


def test_free_axes_of_the_centre_of_mass_are_free(on_the_floor):
    """Only the height is asked for."""
    problem = on_the_floor(com=com_target(z=0.8))
    assert np.isnan(problem.com[:2]).all()
    certify(problem, generate_posture(problem))


def test_points_and_grasps_hold_positions_only(on_the_floor):
    """A hand on a handle and a fingertip on a wall, their orientation free."""
    held = grasp("right_hand", (0.35, -0.25, 1.1), max_force=100.0)
    touched = point("left_hand", (0.4, 0.3, 1.2), friction=0.5, normal=(-1, 0, 0))
    problem = on_the_floor(com=(0.03, 0, 0.93))
    problem = on_the_floor(contacts=(*problem.contacts, held, touched), com=(0.03, 0, 0.93))
    certify(problem, generate_posture(problem))


def test_a_placement_may_be_a_pose_a_position_or_a_wish(on_the_floor):
    """Standing on the left foot, the right one in the air; its turn required or only wished."""
    left = on_the_floor().contacts[0]
    turn = rotation_from_rpy(0.0, 0.5, -0.2)
    for weight in (None, 0.1):
        flying = Placement(np.array([0.2, -0.15, 0.3]), turn, weight)
        problem = on_the_floor(contacts=(left,), placements={"right_foot": flying}, com=com_target(0.0, 0.08))
        configuration = certify(problem, generate_posture(problem))
        rotation = configuration.effector_placement("right_foot")[0]
        assert np.arccos((np.trace(rotation.T @ turn) - 1) / 2) < 0.6


def test_the_reference_is_kept_where_nothing_else_is_asked(on_the_floor, body):
    """The standing posture stays the standing posture."""
    configuration = Configuration(body)
    contacts = []
    for contact in on_the_floor().contacts:
        place = configuration.effector_placement(contact.effector)[1]
        contacts.append(type(contact)(**{**vars(contact), "position": np.array(place)}))
    result = generate_posture(on_the_floor(contacts=tuple(contacts), upright=False))
    assert result.succeeded
    assert np.abs(result.q - body.standing_posture()).max() < 0.02


def test_a_roof_forces_a_crouch(body, on_the_floor):
    """Under 1.30 m the body bends until every shape is 3 cm below it."""
    roof = Obstacle("roof", Box((2, 2, 0.1)), translation=(0, 0, 1.35))
    problem = on_the_floor(
        proximity=Proximity(body, Scene([roof])), clearance=0.03, com=com_target(0.02, 0.0)
    )
    configuration = certify(problem, generate_posture(problem))
    near = problem.proximity.evaluate(configuration.q, 0.5)
    roof_distances = [d for d, (_, other) in zip(near.distance, near.pairs, strict=True) if other == "roof"]
    assert min(roof_distances) >= 0.03 - 1e-4


def test_bounding_spheres_may_stand_in_for_the_exact_shapes(body, on_the_floor):
    """Spheres cover the shapes: what is clear of them is clear of the shapes ([Qiu2012]_ 6.2.2)."""
    pole = Scene([Obstacle("pole", Box((0.06, 0.06, 1.0)), translation=(0.05, 0.42, 1.0))], None)
    spheres = SphereProximity(body, pole, self_collision=False, count={"pole": 24})
    assert spheres.minimum(body.standing_posture(), frozenset()).distance < 0.02
    problem = on_the_floor(com=com_target(0.02, 0.0), proximity=spheres, clearance=0.02)
    result = generate_posture(problem)
    assert result.succeeded, result.failure
    exact = Proximity(body, pole, self_collision=False)
    # 1e-4 m is the tolerance of the generator's own clearance.
    assert exact.minimum(result.q, problem.ignore).distance >= 0.02 - 1e-4


def test_arms_go_around_the_body(on_the_floor):
    """A hand in front of the belly bends the elbow instead of piercing the trunk."""
    place = Placement(np.array([0.24, -0.02, 1.05]))
    for name in ("left_hand", "right_hand"):
        problem = on_the_floor(placements={name: place}, com=com_target(0.02, 0.0))
        certify(problem, generate_posture(problem))


def test_a_contact_out_of_reach_is_explained(on_the_floor):
    """The message names the contact, the distance, and what would help."""
    far = grasp("right_hand", (1.6, -0.2, 1.2), max_force=100.0)
    problem = on_the_floor(contacts=(*on_the_floor().contacts, far), com=(0.0, 0.0, 0.9))
    result = generate_posture(problem)
    assert not result.succeeded
    assert "contact 'right_hand' misses its position by" in result.failure
    assert "a posture exists without contact 'right_hand'" in result.failure


def test_a_centre_of_mass_out_of_reach_is_explained(on_the_floor):
    """Nobody stands with the centre of mass at 1.4 m."""
    result = generate_posture(on_the_floor(com=(0.0, 0.0, 1.4)))
    assert not result.succeeded
    assert "without the centre-of-mass requirement" in result.failure
    assert result.error > 0.05


def test_a_room_too_low_is_explained(body, on_the_floor):
    """Under 0.35 m nobody keeps both soles on the floor."""
    roof = Obstacle("ceiling", Box((4, 4, 0.2)), translation=(0, 0, 0.45))
    problem = on_the_floor(proximity=Proximity(body, Scene([roof])), com=(0.0, 0.0, 0.6))
    result = generate_posture(problem)
    assert not result.succeeded
    assert "ceiling" in result.failure or "the clearances" in result.failure
    assert result.clearance < 0


def test_hinges_at_their_limits_are_named(on_the_floor):
    """The deepest squat ends at a limit of a hinge, and says so."""
    result = generate_posture(on_the_floor(com=(0.0, 0.0, 0.2)))
    assert not result.succeeded
    assert result.at_limit
    assert "at the end of their range" in result.failure


def test_same_problem_same_bits(platform):
    """Nothing is random."""
    first, second = (generate_posture(platform.problem(4)) for _ in range(2))
    assert np.array_equal(first.q, second.q)


def test_the_body_is_placed_over_its_contacts(platform):
    """Heading and mean position of the feet match."""
    problem = platform.problem(0)
    configuration = Configuration(platform.body, place_over_contacts(problem, problem.reference))
    feet = [configuration.effector_placement(name) for name in ("left_foot", "right_foot")]
    np.testing.assert_allclose(np.mean([p for _, p in feet], axis=0), [0, 0, 0], atol=1e-9)
    for rotation, _ in feet:
        assert rotation[1, 0] > 0.99


def test_touching_pairs_include_the_toes(body):
    """The sole reaches over foot and toes."""
    pairs = touching_pairs(body, [("left_foot", "platform")])
    assert pairs == {("left_foot", "platform"), ("left_toes", "platform")}


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"placements": {"tail": Placement()}}, BodyError, "tail"),
        ({"com": (0, 0)}, InputError, "com"),
        ({"com": (0, 0, np.inf)}, InputError, "com"),
        ({"reference": np.zeros(3)}, BodyError, "reference"),
        ({"clearance": np.nan}, InputError, "clearance"),
    ],
)
def test_misuse_is_refused(body, options, error, message):
    """Unknown effectors and bad numbers raise one line."""
    with pytest.raises(error, match=message):
        PostureProblem(body, **options)


def test_bad_settings_and_starts_are_refused(on_the_floor):
    """Tolerances are positive and starts are configurations."""
    with pytest.raises(InputError, match="tolerance"):
        SolverSettings(tolerance=0.0)
    with pytest.raises(BodyError, match="start"):
        generate_posture(on_the_floor(), np.zeros(4))
    with pytest.raises(InputError, match="rotation"):
        Placement(rotation=np.ones((3, 3)))


def test_a_range_margin_keeps_hinges_inside_their_ranges(platform):
    """With the centre of mass as high as 1.0 m a knee is stretched; with a margin it keeps 0.1 rad."""
    problem, margin = platform.problem(0), 0.1
    stretched = replace(problem, com=com_target(z=1.0), proximity=None)
    body = problem.body
    room = np.minimum(margin, 0.25 * (body.upper - body.lower))

    def least_room(found):
        angles = certify(stretched, found).q[7:]
        return float(np.min(np.minimum(angles - body.lower, body.upper - angles) - room))

    assert least_room(generate_posture(stretched)) < -0.05
    assert least_room(generate_posture(replace(stretched, range_margin=margin))) >= -1e-9
    with pytest.raises(InputError, match="range_margin"):
        replace(problem, range_margin=-1.0)
