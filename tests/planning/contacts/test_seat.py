"""Seats: a start that suits body and seat, rising at rest or in motion, sitting down."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from manikin.balance import StaticRegion, static_torque_share
from manikin.body import Configuration, human
from manikin.body.segments import FEET
from manikin.contact import Stance
from manikin.numerics.polytope import signed_distance
from manikin.numerics.spatial import IDENTITY
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.pipeline.stages.context import plan_in_world
from manikin.planning.contacts import Endpoints, Habit, PostureFinder, leave_seat, rising_times
from manikin.planning.contacts.seat import hand_supports
from manikin.scenarios import load_scenario
from manikin.scene import Box, Obstacle, Scene
from manikin.verification import check_contact_plan


def on_chair(*, stature, mass, sex, height, task=None):
    """A chair closed below, so that the feet stay before it."""
    scenario = load_scenario("stand-up-chair").replaced(
        body={"model": "human", "stature_m": stature, "mass_kg": mass, "sex": sex},
        scene=[
            {"name": "seat", "padded": True, "box": [0.42, 0.46, height], "position": [0, 0, 0.5 * height]},
            {"name": "back", "box": [0.04, 0.46, 0.5], "position": [-0.25, 0.0, height + 0.3]},
        ],
        task=task or {"start": {"at": [0.0, 0.0], "posture": "seated"}, "goal": {"at": [0.3, 0.0]}},
    )  # fmt: skip
    return scenario.in_task_frame()


def planned(scenario):
    body, scene = scenario.build_body(), scenario.build_scene()
    found = find_supports(scenario, body, scene, np.random.default_rng(0))
    assert found.failure is None
    check = check_contact_plan(scenario, plan_in_world(found.plan, IDENTITY))
    assert check.verdict == "certified"
    return found


@cache
def mean_man():
    """Contacts of 1.75 m and 75 kg on a seat 0.45 m high."""
    return planned(on_chair(stature=1.75, mass=75.0, sex="male", height=0.45))


def test_a_small_woman_rises_from_a_chair():
    """1.55 m and 52 kg, a seat 0.45 m high: contacts hold, the feet before the seat."""
    found = planned(on_chair(stature=1.55, mass=52.0, sex="female", height=0.45))
    start = found.plan.stages[0].contacts
    assert start["left_foot"].position[0] - 0.5 * start["left_foot"].length > 0.21


def test_the_pelvis_rolls_so_that_the_spine_need_not_bend():
    """The weight is 4.5 cm inside the feet with less than half of the bend that lumbar and thorax have."""
    found = mean_man()
    body, off = human(1.75, 75.0, "male"), next(s for s in found.plan.stages if "buttocks" not in s.contacts)
    region = StaticRegion.of(Stance(list(off.contacts.values())), body.mass)
    assert signed_distance(off.com[:2], region.polygon) > 0.044
    bend = {name: angle for name, angle in zip(body.joint_names, off.q[7:], strict=True) if "flexion" in name}
    assert bend["lumbar_flexion"] < 0.5
    assert bend["thorax_flexion"] < 0.35
    turn, place = Configuration(body, off.q).effector_placement("buttocks")
    assert np.arctan2(-turn[2, 0], turn[0, 0]) > 0.3
    moved, tilt = found.plan.stages[0].contacts["buttocks"].rolled_away(turn, place)
    assert max(moved, tilt) < 1e-3


def test_the_times_of_a_rise_are_peoples():
    """Young adults take 1.60 s (SD 0.28) to lean and rise (Kazi, Miller and Silverman 2025)."""
    found = mean_man()
    times, stages = rising_times(found.plan.stages), found.plan.stages
    assert 1.60 - 2.0 * 0.28 < sum(times) < 1.60 + 0.28
    assert min(times) > 0.0
    assert "buttocks" in stages[len(times) - 2].contacts
    assert "buttocks" not in stages[len(times) - 1].contacts
    assert sum(times) < 0.8 * sum(stage.min_duration for stage in stages[: len(times)])
    assert rising_times(stages[len(times) :]) == []


def test_who_stands_before_a_table_stands_up_straight():
    """Below its top a squat is nearer to the seated posture: it was taken for the one that has risen."""
    found = planned(load_scenario("stand-up-chair").in_task_frame())
    heights = [float(stage.com[2]) for stage in found.plan.stages]
    assert min(heights) > 0.95 * heights[0] - 0.01
    assert heights[len(rising_times(found.plan.stages))] > 0.95


def test_a_person_sits_down():
    """The last change makes the contact of the buttocks, on the seat, and feet stay where they are."""
    task = {"start": {"at": [0.7, 0.1]}, "goal": {"at": [0.0, 0.0], "posture": "seated"}}
    found = planned(on_chair(stature=1.70, mass=66.0, sex="female", height=0.44, task=task))
    before, last = found.plan.stages[-2:]
    assert set(last.contacts) - set(before.contacts) == {"buttocks"}
    assert all(last.contacts[foot] is before.contacts[foot] for foot in before.contacts)
    assert last.contacts["buttocks"].position[2] == pytest.approx(0.44)
    assert found.plan.goal_com[0] < last.com[0]


def test_a_seat_that_cannot_be_left_at_rest_is_left_in_motion():
    """Feet so far in front that no lean brings the weight over them: speed does, and only then."""
    body = human(1.75, 75.0, "male")
    scene = Scene([Obstacle("seat", Box((0.4, 0.5, 0.45)), translation=(0.0, 0.0, 0.225))])
    start = Endpoints(PostureFinder(body, scene), 0.7).find(np.zeros(2), 0.0, Habit.SEATED).stage
    poser = PostureFinder(body, scene)
    farther = np.array([0.09, 0.0, 0.0])
    moved = {
        name: replace(contact, position=contact.position + farther) if "foot" in name else contact
        for name, contact in start.contacts.items()
    }
    posed = poser.pose(moved, moved, start.q, place=start.com[:2], restarts=True)
    leaving = leave_seat(poser, type(start).of(body, moved, posed.q, 0.35), frozenset(FEET))
    assert leaving.failure is None
    off = leaving.stages[-2]
    heel = off.contacts["left_foot"].position[0] - 0.5 * off.contacts["left_foot"].length
    assert off.com[0] < heel
    assert 0.1 <= off.momentum.velocity[0] <= 0.6
    on_feet = Stance(list(off.contacts.values()))
    assert static_torque_share(body, off.q, on_feet) == np.inf
    assert static_torque_share(body, off.q, on_feet, off.momentum.acceleration) < 1.0
    assert off.com == pytest.approx(Configuration(body, off.q).com)


def test_hands_push_until_the_weight_is_over_the_feet():
    """Half the strength of an adult: hands on armrests carry with the feet when the seat is left."""
    body = human(1.75, 75.0, "male", strength=0.5)
    seat = Obstacle("seat", Box((0.42, 0.46, 0.06)), translation=(0.02, 0.0, 0.40))
    arms = [
        Obstacle(f"{side}_armrest", Box((0.32, 0.05, 0.04)), translation=(0.05, sign * 0.27, 0.64))
        for side, sign in (("left", 1.0), ("right", -1.0))
    ]
    scene = Scene([seat, *arms])
    poser = PostureFinder(body, scene)
    sat = Endpoints(PostureFinder(body, scene), 0.7).find(np.zeros(2), 0.0, Habit.SEATED).stage
    held = {**sat.contacts, **hand_supports(scene, sat.contacts["buttocks"], 1.75, 0.7, 0.9)}
    posed = poser.pose(held, held, sat.q, place=sat.com[:2], restarts=True)
    leaving = leave_seat(poser, type(sat).of(body, held, posed.q, 0.35), frozenset(FEET))
    assert leaving.failure is None
    off, _, free = leaving.stages[-4:-1]
    assert set(off.contacts) == {"left_foot", "right_foot", "left_wrist", "right_wrist"}
    assert set(free.contacts) == {"left_foot", "right_foot"}
    assert static_torque_share(body, off.q, Stance(list(off.contacts.values()))) <= 0.95
    assert off.contacts["left_wrist"].position[2] == pytest.approx(0.66)


@pytest.mark.parametrize(
    ("name", "stature"),
    [("stand-up-chair@hands", 1.60), pytest.param("stand-up-sofa@hands", 1.88, marks=pytest.mark.long)],
)
def test_hands_push_where_they_are_to_be_used(name, stature):
    """The heels of both hands carry with the feet as the seat is left, level within what a palm yields."""
    scenario = load_scenario(name).replaced(
        body={"model": "human", "stature_m": stature, "mass_kg": 75.0, "sex": "male"}
    )  # fmt: skip
    stages, body = planned(scenario.in_task_frame()).plan.stages, scenario.build_body()
    off = next(stage for stage in stages if "buttocks" not in stage.contacts)
    assert set(off.contacts) == {"left_foot", "right_foot", "left_wrist", "right_wrist"}
    for hand in ("left_wrist", "right_wrist"):
        up = Configuration(body, off.q).effector_placement(hand)[0][:, 2]
        assert up[2] > np.cos(np.deg2rad(20.0))
