"""A scenario moved in the world has the same coordinates in the frame of its task, and is truly elsewhere."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.numerics.spatial import PlanarTransform
from manikin.scenarios import list_scenarios, load_scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import FrameMoves, Section

NAMES = list_scenarios()
PLACES = st.tuples(
    st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.one_of(st.floats(-360.0, 360.0), st.just(180.0))
)

OF_THE_BODY_OR_SHAPE = {
    ("LimbSection", "position"), ("LimbSection", "normal"), ("ObstacleSection", "box"),
    ("ObstacleSection", "plane"), ("ObstacleSection", "half_space"), ("PushSection", "direction_deg"),
    ("BodySection", "standing_deg"), ("PhaseSection", "com_within_m"), ("ContactSection", "polygon"),
    ("WeightsSection", "velocity"), ("WeightsSection", "acceleration"), ("WeightsSection", "jerk"),
    ("UncertaintySection", "angle_noise_deg"), ("UncertaintySection", "joints_deg"),
}  # fmt: skip
"""Vectors and angles of a file that are not measured in the world."""


def transformed(points, move):
    return PlanarTransform(*move).points(points)


@pytest.mark.parametrize("name", NAMES)
def test_every_moved_scenario_has_the_same_bits_in_the_frame_of_its_task(name):
    scenario = load_scenario(name)
    wanted = scenario.in_task_frame().to_yaml()
    for move in ((10.0, -7.0, 37.0), (-31.4, 2.7, -143.1)):
        assert scenario.moved(*move).in_task_frame().to_yaml() == wanted


@pytest.mark.parametrize("name", ["platform", "corridor"])
@given(move=PLACES)
def test_a_scenario_moved_anywhere_has_the_same_bits_in_the_frame_of_its_task(name, move):
    scenario = load_scenario(name)
    assert scenario.moved(*move).in_task_frame().to_yaml() == scenario.in_task_frame().to_yaml()


@pytest.mark.parametrize("name", NAMES)
def test_the_frame_of_a_task_in_its_own_frame_is_the_identity(name):
    task = load_scenario(name).in_task_frame()
    assert task.transform_task_to_world.is_identity
    assert task.in_task_frame().to_yaml() == task.to_yaml()


@pytest.mark.parametrize("name", ["platform", "narrow"])
@given(move=PLACES)
def test_the_frame_of_a_task_moves_with_it(name, move):
    """To rounding of coordinates of up to 100 m, and of the file's twelve decimals."""
    scenario = load_scenario(name)
    found = scenario.moved(*move).transform_task_to_world
    wanted = PlanarTransform(*move).after(scenario.transform_task_to_world)
    assert np.hypot(found.x - wanted.x, found.y - wanted.y) < 1e-11
    assert abs(PlanarTransform(yaw_deg=-wanted.yaw_deg).turned(found.yaw_deg)) < 1e-11


@pytest.mark.parametrize("name", ["car-ingress", "truck-egress", "ramp"])
def test_a_moved_scene_is_the_scene_elsewhere(name):
    """Points fixed to an obstacle are at the moved places, to rounding and the file's twelve decimals."""
    scenario, move = load_scenario(name), (10.0, -7.0, 37.0)
    transform = PlanarTransform(*move)
    pairs = zip(scenario.build_scene(), scenario.moved(*move).build_scene(), strict=True)
    for here, there in (pair for pair in pairs if pair[0].name != "floor"):
        points = np.vstack([np.zeros(3), np.eye(3)])
        np.testing.assert_allclose(
            there.to_world(points), transform.points(here.to_world(points)), rtol=0.0, atol=1e-11
        )


@pytest.mark.parametrize("name", ["platform", "ramp", "car-ingress", "beam-H2C3", "walls"])
def test_moved_contacts_are_the_contacts_elsewhere(name):
    scenario, move = load_scenario(name), (10.0, -7.0, 37.0)
    transform, moved = PlanarTransform(*move), load_scenario(name).moved(*move)
    moved.check_contacts(moved.build_scene())
    for here, there in zip(scenario.build_sequence(), moved.build_sequence(), strict=True):
        for first, second in zip(here.stance, there.stance, strict=True):
            np.testing.assert_allclose(
                second.points_in_world, transform.points(first.points_in_world), atol=1e-11
            )
            if first.oriented or first.friction > 0.0:
                rotation = transform.rotations(first.rotation_contact_to_world)
                np.testing.assert_allclose(second.rotation_contact_to_world, rotation, atol=1e-11)


@given(yaw=st.floats(-180.0, 180.0))
def test_a_contact_that_faces_down_turns_with_the_world(yaw):
    overrides = ["supports.phases.0.left_foot.normal=[0, 0, -1]", "supports.phases.0.left_foot.kind=point"]
    scenario = load_scenario("walls", overrides=[o.replace("left_foot", "left_hind_foot") for o in overrides])
    here = scenario.build_sequence()[0].stance["left_hind_foot"]
    there = scenario.moved(0.0, 0.0, yaw).build_sequence()[0].stance["left_hind_foot"]
    wanted = PlanarTransform(yaw_deg=yaw).rotations(here.rotation_contact_to_world)
    np.testing.assert_allclose(there.rotation_contact_to_world, wanted, atol=1e-11)


@pytest.mark.parametrize("name", ["platform", "ramp"])
@given(move=PLACES, share=st.floats(0.0, 1.0))
def test_a_moved_height_band_has_the_same_heights_at_the_moved_places(name, move, share):
    """Expressions change by 0.9 m per metre at most, and places by rounding."""
    scenario = load_scenario(name)
    band, there = scenario.height_band, scenario.moved(*move).height_band
    com = scenario.start_com + share * (scenario.goal_com - scenario.start_com)
    moved = transformed(com, move)
    assert abs(band.lower(*com) - there.lower(*moved)) < 1e-10
    assert abs(band.upper(*com) - there.upper(*moved)) < 1e-10


def test_feet_that_point_apart_have_the_heading_of_the_first():
    apart = [
        f"supports.phases.0.{foot}.yaw_deg={yaw}" for foot, yaw in (("left_foot", 60), ("right_foot", -120))
    ]
    assert load_scenario("platform", overrides=apart).start_heading_deg == 60.0


def test_every_place_and_angle_of_a_file_says_whether_it_moves_with_the_world():
    """A new field of two or three numbers, or an angle, is marked, or listed here with those of a body."""
    unmarked = set()
    for section in sections(ScenarioFile):
        for name, field in section.model_fields.items():
            vector = "tuple" in str(field.annotation) or name == "standing_deg"
            if (vector or name.endswith("_deg")) and not any(
                isinstance(m, FrameMoves) for m in field.metadata
            ):
                unmarked.add((section.__name__, name))
    assert unmarked == OF_THE_BODY_OR_SHAPE


def sections(section, seen=None):
    """A section and all that its fields may hold."""
    seen = set() if seen is None else seen
    if section not in seen:
        seen.add(section)
        for field in section.model_fields.values():
            for inner in classes_in(field.annotation):
                sections(inner, seen)
    return seen


def classes_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [found for argument in get_args(annotation) for found in classes_in(argument)]
