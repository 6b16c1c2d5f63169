"""Flights over the platform's threshold: smooth curves, and the Bi-RRT where they fail."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence, point, roll_feet, sole
from manikin.planning.com import plan_com
from manikin.planning.contacts import PostureFinderSettings
from manikin.planning.contacts.crawl_postures import CRAWLERS, on_all_fours
from manikin.planning.whole_body import swing_planner
from manikin.planning.whole_body.swing import SwingLimits, check_swing
from manikin.planning.whole_body.swing_path import Pose
from manikin.planning.whole_body.swing_planner import FlightPlanner
from manikin.scenarios import load_scenario
from manikin.scene import Scene

from .conftest import step_sequence


@pytest.fixture(scope="module")
def planner():
    scenario = load_scenario("platform")
    body, scene = scenario.build_body(), scenario.build_scene()
    trajectory = plan_com(scenario.build_centroidal_problem()).trajectory
    assert trajectory is not None
    standing = body.standing_posture()
    return FlightPlanner(body, scene, trajectory, SwingLimits(), np.random.default_rng(0), lambda _: standing)


def test_every_step_of_the_platform_has_a_smooth_curve_that_keeps_clear(planner):
    for swing in planner.flights:
        found = planner.plan(swing)
        assert found.method == "smooth"
        assert found.failure is None
        np.testing.assert_allclose(found.curve.start.position, swing.start.position, atol=1e-12)
        np.testing.assert_allclose(found.curve.end.position, swing.end.position, atol=1e-12)
        # Measured again at 1 ms, four times as dense as planned.
        dense = check_swing(found.curve, planner._clearance(swing), replace(SwingLimits(), time_step=1e-3))
        assert dense.slack > -1.5e-3
        assert dense.curve.peak_speed <= SwingLimits().speed


@pytest.mark.parametrize("number", [0, pytest.param(2, marks=pytest.mark.long)])
def test_the_bi_rrt_takes_over_where_no_smooth_curve_is_found(planner, monkeypatch, number):
    """With the smooth family made to pass through something, a step of the platform is searched instead."""
    swing = planner.flights[number]
    real = swing_planner.plan_swing

    def fails(*args, **kwargs):
        return replace(real(*args, **kwargs), clearance=-0.01, failure="made to fail")

    monkeypatch.setattr(swing_planner, "plan_swing", fails)
    found = planner._planned(swing)  # not the flight that is known
    assert found.method == "bi-rrt", found.failure
    check = check_swing(found.curve, planner._clearance(swing), SwingLimits())
    # The search checks at its own instants; between them 2 mm may be lost.
    assert check.slack > -2e-3


def test_a_curve_a_little_too_near_or_too_fast_is_not_searched_anew(planner, monkeypatch):
    """The fit has the last word on it; what it misses is known."""
    real = swing_planner.plan_swing

    def near(*args, **kwargs):
        return replace(real(*args, **kwargs), clearance=0.02, failure="speed reaches 3.06 m/s")

    monkeypatch.setattr(swing_planner, "plan_swing", near)
    found = planner._planned(planner.flights[0])
    assert (found.method, found.failure, found.searched) == ("smooth", "speed reaches 3.06 m/s", False)


def test_a_roll_is_searched_where_no_smooth_curve_is_clear(monkeypatch):
    """The foot still tilts, and what it tilts about keeps clear with it."""
    sequence = roll_feet(step_sequence(), 0.0644)
    schedule = ContactSchedule(sequence, np.cumsum([0.0, *(phase.min_duration for phase in sequence)]))
    trajectory = SimpleNamespace(schedule=schedule, position=lambda _: np.array([0.1, 0.0, 0.9]))
    planner = FlightPlanner(human(), Scene(), trajectory, SwingLimits(), np.random.default_rng(0), None)
    (swing,) = planner.flights
    smooth = planner.plan(swing)
    assert (smooth.method, smooth.failure) == ("smooth", None)
    failed = SimpleNamespace(curve=smooth.curve, failure="made to fail", succeeded=False, clearance=-0.01)
    monkeypatch.setattr(swing_planner, "plan_swing", lambda *_, **__: failed)
    found = planner._planned(swing)
    assert found.method == "bi-rrt", found.failure
    assert found.roll is not None
    ends, clearance, limits = planner._way(swing, found.roll)
    for pose, end in zip((found.curve.start, found.curve.end), ends, strict=True):
        np.testing.assert_allclose(pose.position, end.position, atol=1e-12)
    # The search checks at its own instants; between them 2 mm may be lost.
    assert check_swing(found.curve, clearance, limits).slack > -2e-3


def test_a_trailing_foot_points_its_toes_down_and_a_leading_one_does_not(planner):
    first, trailing, _ = planner.flights
    starts = [planner.schedule.swing_interval(swing)[0] for swing in (first, trailing)]
    assert planner._pitch(first, starts[0]) == pytest.approx(0.0)
    assert 0.2 < planner._pitch(trailing, starts[1]) <= 0.9


def test_a_foot_does_not_pass_round_the_far_side_of_the_one_that_stands(planner):
    """Legs that did would cross. The last step of the platform ends before the foot that stands."""
    for swing in planner.flights[:2]:
        sides = {np.sign(lateral) for lateral in planner._laterals(swing)}
        assert sides == ({0.0, 1.0} if swing.effector == "left_foot" else {0.0, -1.0})


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("carrier", "apart"), [("knee", True), ("hand", False), (None, False)])
def test_a_foot_whose_knee_carries_meanwhile_is_put_away_and_reached_with(side, carrier, apart):
    """The leg stands on its knee in the middle of the foot's flight; a hand does not matter."""
    other = {"left": "right", "right": "left"}[side]
    size = {"length": 0.28, "width": 0.12, "friction": 0.7}
    standing = sole(f"{other}_foot", (0.0, -0.1, 0.0), **size)
    before, after = (sole(f"{side}_foot", (x, 0.1, 0.0), **size) for x in (0.0, 0.3))
    between = [] if carrier is None else [point(f"{side}_{carrier}", (0.3, 0.1, 0.0), friction=0.7)]
    stances = [[standing, before], [standing], [standing, *between], [standing], [standing, after]]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0), 0.5) for contacts in stances])
    trajectory = SimpleNamespace(schedule=ContactSchedule(sequence, np.arange(6.0)))
    planner = FlightPlanner(human(), Scene(), trajectory, SwingLimits(), np.random.default_rng(0), None)
    found = [
        (swing.start and swing.start.position[0], swing.end and swing.end.position[0])
        for swing in planner.flights if swing.effector == f"{side}_foot"
    ]  # fmt: skip
    assert found == ([(0.0, None), (None, 0.3)] if apart else [(0.0, 0.3)])
    # Straight up from the knee there is no way for a thigh that stands on it.
    assert not any(swing.effector.endswith("knee") for swing in planner.flights)


def test_a_thigh_that_kneels_is_kept_clear_of_where_the_posture_has_it():
    """On hands and knees it is upright; the centre of mass, ahead between the limbs, moves."""
    body = human()
    q = on_all_fours(body, PostureFinderSettings()).q
    state, held = Configuration(body, q), dict[str, Contact]()
    for name in CRAWLERS:
        rotation, place = state.effector_placement(name)
        held[name] = point(name, place, friction=0.7, rotation=rotation)
    without = [contact for name, contact in held.items() if name != "left_knee"]
    stances = [[*held.values()], without, [*held.values()]]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0), 0.5) for contacts in stances])
    trajectory = SimpleNamespace(
        schedule=ContactSchedule(sequence, np.arange(4.0)),
        position=lambda time: state.com + np.array([0.1 * time, 0.0, 0.0]),
    )
    planner = FlightPlanner(body, Scene(), trajectory, SwingLimits(), np.random.default_rng(0), lambda _: q)
    (swing,) = planner.flights
    assert planner._pitch(swing, 1.0) == 0.0  # a shank needs no turn, unlike a foot left as far behind
    clearance, pose = planner._clearance(swing), Pose.of(held["left_knee"])
    beside = Pose(pose.position + np.array([0.25, -0.02, 0.08]), pose.rotation)
    places, turns = (np.array([part] * 3) for part in beside)
    room = clearance(np.array([1.0, 1.5, 2.0]), places, turns).distance
    np.testing.assert_allclose(room, room[0], atol=1e-9)
    # Nearest is the thigh that stands, upright by less than 20 degrees.
    radius = {name: body.segment(name).shapes[0].size[0] for name in ("left_leg", "right_thigh")}
    aside = abs(float(beside.position[1] - held["right_knee"].position[1]))
    assert room[0] == pytest.approx(aside - sum(radius.values()), abs=0.02)
