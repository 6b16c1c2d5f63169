"""Long plans, impossible ones and walks over the whole floor: `pytest benchmarks/sweep_plans.py -n 2`.

A quarter of an hour on two cores. The tests have one case of each kind.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from manikin.balance import wrench_polytope
from manikin.body import human
from manikin.contact import ContactModel, ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.pipeline.runner import run
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning.com import CentroidalProblem, plan_com
from manikin.planning.com.feasibility import polytopes_of
from manikin.planning.whole_body import WholeBodySettings, plan_whole_body, refine_motion
from manikin.planning.whole_body.posture_style import CLOSE
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.swing_planner import with_mid_flights
from manikin.scenarios import load_scenario
from manikin.scenarios.planned import walk_task
from manikin.scene import Box, Obstacle, Scene
from manikin.walking import (
    START,
    Walker,
    WalkObstacle,
    experiment_targets,
    walking_path,
)
from manikin.walking.words import residuals, word_paths

TESTS = Path(__file__).parents[1] / "tests"


def of_the_tests(path):
    """A module of the tests, from which cases are taken."""
    spec = importlib.util.spec_from_file_location(Path(path).stem, TESTS / path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


# --- centre of mass -------------------------------------------------------------------------------


@pytest.mark.parametrize(("variant", "force"), [("trial-2", 150.0), ("trial-4", 250.0), ("trial-5", 250.0)])
def test_trials_between_the_walls_keep_their_margins(variant, force):
    """Table 5.1: 196, 280.55 and 280.60 N, in less than 6 s ([Qiu2012]_ 5.4.4)."""
    result = plan_com(load_scenario("walls", variant).build_centroidal_problem())
    assert result.succeeded
    assert result.d_min >= force
    assert result.trajectory.duration <= 6.0 + 1e-6


def test_a_stance_moved_elsewhere_has_the_polytope_it_would_have():
    """Row by row, in all nineteen phases between the walls [N]."""
    problem = load_scenario("walls", "trial-2").build_centroidal_problem()
    for phase, polytope in zip(problem.sequence, polytopes_of(problem), strict=True):
        direct = wrench_polytope(phase.stance, reference=polytope.reference)
        gaps = np.abs(
            np.column_stack([polytope.H, polytope.h / 1000.0])[:, None]
            - np.column_stack([direct.H, direct.h / 1000.0])[None]
        ).max(axis=2)
        assert gaps.min(axis=1).max() < 1e-7
        assert gaps.min(axis=0).max() < 1e-7


# --- whole body -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cases():
    return of_the_tests("planning/whole_body/refine_cases.py")


def test_constraints_that_forbid_the_postures_are_named(tmp_path):
    """A stride of 1 m with the CoM above 0.94 m: legs of 0.9 m would need it far before the standing foot."""
    band = '[{height_band: {lower: "0.94", upper: "1.0"}}]'
    stride = of_the_tests("pipeline/test_key_postures.py").stride
    result = run(stride(tmp_path, length=1.0, constraints=band))
    failure = result.summary["failure"]
    assert failure["stage"] == "centroidal"
    assert "no posture at T_" in failure["reason"]
    assert "no plan of the centre of mass passes there" in failure["reason"]
    assert "1 further plan of the centre of mass tried" in failure["reason"]
    assert result.summary["centroidal"]["replans"] == 1


@pytest.mark.parametrize(("name", "length"), [("climb", 8), ("crouch", 5)])
def test_a_long_climb_and_a_long_crouch_are_refined(cases, name, length):
    """Eight moves on the wall, six steps under the slab."""
    result = refine_motion(*getattr(cases, name)(length))
    assert result.succeeded, result.failure
    assert result.after.squared_accelerations <= result.before.squared_accelerations / 5.0
    assert result.after.physics_violation <= result.before.physics_violation / 10.0
    assert result.after.min_margin > 0.0


@pytest.mark.parametrize("name", ["climb-wall", "insect-books", "climb@aslant", "climb@down"])
def test_limbs_go_all_the_way_and_are_refined(name):
    """Margin at every sample of 5 ms, no penetration, contacts kept."""
    scenario = load_scenario(name)
    body, scene = scenario.build_body(), scenario.build_scene()
    found = find_supports(scenario, body, scene, np.random.default_rng(scenario.seed))
    assert found.failure is None
    schedule = found.plan.schedule(ContactModel.of_body(body.mass))
    keyed = with_mid_flights(body, scene, schedule, KeyPath(*found.plan.keys(schedule.instants)), ())
    refined = refine_motion(body, scene, keyed.time, keyed.q, schedule)
    assert refined.failure is None, refined.failure
    assert refined.certificate.value("min_margin") > 0.0
    assert refined.certificate.value("max_penetration_m") < 1e-3


def test_refinement_makes_a_contact_plan_a_motion():
    """Against the postures joined by straight lines, at the same timing."""
    scenario = load_scenario("crouch")
    body, scene = scenario.build_body(), scenario.build_scene()
    found = find_supports(scenario, body, scene, np.random.default_rng(0))
    sequence = found.scenario.build_sequence()
    time = np.concatenate([[0.0], np.cumsum([phase.min_duration for phase in sequence])])
    refined = refine_motion(body, scene, time, found.plan.postures, ContactSchedule(sequence, time))
    assert refined.failure is None
    before, after = refined.before, refined.after
    assert before.physics_violation > 10.0 * after.physics_violation
    assert before.squared_accelerations > 5.0 * after.squared_accelerations
    assert after.min_clearance_m > max(0.0, before.min_clearance_m)
    assert refined.certificate.value("min_margin") > 0.0


def test_a_climb_with_hands_stays_within_the_learnt_ranges_where_that_is_asked_for():
    ranges = of_the_tests("planning/contacts/test_learnt_ranges.py")
    _, freely = ranges.found_with("limits", "climb")
    assert freely.min() < -np.deg2rad(10.0)
    _, kept = ranges.found_with("learnt", "climb")
    assert kept.min() >= -ranges.SLACK


@pytest.mark.parametrize("height", [1.1, 1.2, 1.3])
def test_a_ceiling_below_the_head_is_reported_with_its_pair(height):
    """No person of 1.75 m keeps the centre of mass at 0.93 m below it."""
    size = {"length": 0.28, "width": 0.12, "friction": 0.7}
    right = sole("right_foot", (0.0, -0.1, 0.0), **size)
    behind, ahead = (sole("left_foot", (x, 0.1, 0.0), **size) for x in (0.0, 0.25))
    stances = ([behind, right], [right], [ahead, right])
    person = human(1.75, 79.0, "male", sole_length=0.28, sole_width=0.12)
    com = plan_com(
        CentroidalProblem(
            person.mass, StanceSequence([Phase(Stance(held, 1500.0), 0.5, 1.2) for held in stances]),
            (-0.02, 0.0, 0.93), (0.1, 0.0, 0.93), required_margin=10.0, max_duration=3.5,
        )
    ).trajectory  # fmt: skip
    scene = Scene([Obstacle("ceiling", Box((4.0, 4.0, 0.1)), translation=(0.0, 0.0, height + 0.05))])
    # Coarse: what is impossible is tried in every way there is.
    coarse = WholeBodySettings(guide_spacing=0.5, knot_spacing=0.15, manner=CLOSE)
    result = plan_whole_body(person, scene, com, rng=np.random.default_rng(0), settings=coarse)
    assert not result.succeeded
    assert result.certificate.value("min_clearance_m") < 0.01
    assert "ceiling" in str(result.certificate.closest_pair) or "error" in result.failure.reason


# --- recorded ranges of motion --------------------------------------------------------------------


def test_people_and_clips_that_were_not_learnt_from_are_inside():
    """Hips and shoulders: 95 % of the frames of each fourth of the clips, and of each person left out.

    Shoulders of the three who climbed, crawled and swung their arms as nobody else did: 80 %.
    """
    anatomy = of_the_tests("recordings/test_anatomy.py")
    script = of_the_tests("../docs/ranges_of_motion.py")
    clips = script.recorded_angles(Path(__file__).parents[2] / "shared/data/mocap")
    names = sorted(clips)
    folds = [(number, set(names[number::4])) for number in range(4)]
    people = [(person, {name for name in names if name[0] == person}) for person in {n[0] for n in names}]
    for label, left_out in (*folds, *people):
        learnt = script.learn(clips[name] for name in names if name not in left_out)
        own = [clips[name] for name in sorted(left_out)]
        assert anatomy.inside(learnt, own, "thigh") >= 0.95, label
        shoulder = 0.8 if label in ("01", "Male1", "08") else 0.95
        assert anatomy.inside(learnt, own, "upper_arm") >= shoulder, label


# --- walks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(20, 30))
def test_walks_to_goals_at_random_are_executed(seed):
    """Up to 4 m away, in any direction, facing anywhere."""
    rng = np.random.default_rng(seed)
    far, where, facing = rng.uniform(0.5, 4.0), *rng.uniform(-180.0, 180.0, 2)
    goal = far * np.cos(np.radians(where)), far * np.sin(np.radians(where))
    result = run(walk_task((*goal, facing), max_speed=1.4, execute=True))
    assert result.succeeded, result.summary["failure"]
    np.testing.assert_allclose(result.executed.com[-1, :2], goal, atol=0.06)


def test_every_path_of_the_experiment_is_solved_from_both_guesses_and_certified():
    """106 targets; the tests have 28."""
    for path in (walking_path(START, goal) for goal in experiment_targets()):
        assert path.succeeded, path.task.goal
        assert {"straight", "turning"} <= set(path.others), path.task.goal
        assert path.residuals().within(1e-7), path.task.goal


def test_a_gap_narrower_than_the_shoulders_is_passed_sideways():
    """Beside 0.05 m of room, 0.15 m are left for the discs' centres, which are 0.25 m apart."""
    walls = [
        WalkObstacle(name, [(side * 6.0, 1.4), (side * 0.25, 1.4), (side * 0.25, 1.6), (side * 6.0, 1.6)])
        for name, side in (("left wall", -1.0), ("right wall", 1.0))
    ]
    path = walking_path(START, (0.0, 3.0, np.pi / 2), obstacles=walls, walker=Walker(0.25, 0.5))
    assert path.succeeded
    inside = np.abs(path.y - 1.5) < 0.05
    assert np.abs(np.sin(path.heading[inside])).max() < 0.15 / 0.25 + 1e-3
    assert path.holonomic[inside].all()


def test_a_way_is_found_among_many():
    places = [(0.2, 0.9), (1.3, 2.2), (1.0, 2.6), (-0.7, 2.2), (-0.8, 2.4), (-0.7, 3.5), (0.0, 4.0)]
    discs = [WalkObstacle.disc(f"disc {i}", place, 0.3) for i, place in enumerate(places)]
    path = walking_path(START, (0.0, 5.0, np.pi / 2), obstacles=discs)
    assert path.succeeded
    assert path.residuals().within()
    assert path.length < 6.5


@pytest.mark.parametrize("heading", range(0, 360, 10))
def test_every_goal_of_a_slice_satisfies_the_maximum_principle(heading):
    """Goals of the thesis' grid every 0.4 m: met to 1e-9, u2 as the adjoint says, the Hamiltonian zero."""
    x, y = np.meshgrid(np.arange(-2.0, 2.01, 0.4), np.arange(3.0, 9.01, 0.4))
    goals = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, np.radians(heading))])
    paths = word_paths(goals)
    found = residuals(
        np.array(START), np.array([path.goal for path in paths]), np.array([path.shape for path in paths]),
        np.array([path.length for path in paths]),
    )  # fmt: skip
    assert found.position.max() < 1e-9
    assert found.heading.max() < 1e-9
    assert found.adjoint.max() < 1e-3
    assert found.hamiltonian.max() < 1e-3
