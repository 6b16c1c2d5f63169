"""The whole way from start and goal to a path, in small scenes."""

import itertools

import networkx as nx
import numpy as np
import pytest

from manikin.planning.guide import NO_MARGINS, Condition, ReachabilityChecker, root_pose
from manikin.planning.guide.guide import GuideTask, GuideWorld, offline_roadmap, plan_guide
from manikin.planning.guide.roadmap import RoadmapSettings, request
from manikin.planning.guide.root_path import (
    RootLimits,
    approximate,
    path_holds,
    prune,
    shorten,
    traverse_times,
)
from manikin.planning.guide.root_pose import distance
from manikin.planning.guide.sampler import SamplingRegion
from manikin.planning.guide.steering import LocalPlanner
from manikin.scene import Box, Obstacle, Scene

START, GOAL = root_pose((-0.7, 0.0, 0.3)), root_pose((0.7, 0.0, 0.3))
SETTINGS = RoadmapSettings(samples=300, failures=60)


def box_room(*, gap):
    """Two rooms of 1.4 m by 1.6 m under a low roof, with a door of ``gap`` [m] in the wall between."""
    walls = [
        Obstacle("north", Box((3.0, 0.1, 0.8)), translation=(0.0, 0.85, 0.4)),
        Obstacle("south", Box((3.0, 0.1, 0.8)), translation=(0.0, -0.85, 0.4)),
        Obstacle("east", Box((0.1, 1.8, 0.8)), translation=(1.45, 0.0, 0.4)),
        Obstacle("west", Box((0.1, 1.8, 0.8)), translation=(-1.45, 0.0, 0.4)),
        Obstacle("roof", Box((3.0, 1.8, 0.1)), translation=(0.0, 0.0, 0.85)),
        Obstacle("wall", Box((0.1, 1.6 - gap, 0.8)), translation=(0.0, -0.5 * gap, 0.4)),
    ]
    return Scene(walls)


def world_of(bug, gap=0.0, **changes):
    region = SamplingRegion((-1.4, -0.8, 0.0), (1.4, 0.8, 0.8))
    values = {"condition": Condition.limbs(at_least=2), "roadmap": SETTINGS, **changes}
    return GuideWorld(box_room(gap=gap), bug, region, **values)


@pytest.fixture(scope="module")
def walled(bug):
    return world_of(bug)


@pytest.fixture(scope="module")
def open_world(bug):
    return world_of(bug, gap=0.5)


@pytest.fixture(scope="module")
def found(open_world):
    return plan_guide(open_world, GuideTask(START, GOAL), np.random.default_rng(0))


def test_every_pose_of_a_path_satisfies_the_plain_condition(open_world, found):
    assert found.succeeded
    checker = ReachabilityChecker(open_world.abstraction, open_world.scene, open_world.condition, NO_MARGINS)
    for pose in found.path.poses(np.linspace(0.0, 1.0, 3000)):
        assert checker.holds(pose)
    np.testing.assert_allclose(found.path.start, START, atol=1e-12)
    np.testing.assert_allclose(found.path.goal[:3], GOAL[:3], atol=1e-12)


def test_trunk_keeps_clear_by_an_independent_measure(open_world, found):
    """The ball's distance to every box in closed form, without Coal."""
    centres = found.path.poses(np.linspace(0.0, 1.0, 3000))[:, :3]
    assert centres[:, 2].min() > 0.1
    for item in open_world.scene:
        if item.name != "floor":
            beyond = np.maximum(np.abs(centres - item.translation) - item.shape.size / 2, 0.0)
            assert np.linalg.norm(beyond, axis=1).min() > 0.1


def test_the_path_goes_through_the_door(found):
    crossing = found.path.poses(np.linspace(0.0, 1.0, 3000))
    crossing = crossing[np.abs(crossing[:, 0]) < 0.05]
    assert len(crossing)
    assert np.all(crossing[:, 1] > 0.3)


def test_a_goal_behind_a_wall_is_walled_off(walled):
    """Two rooms: no way between their parts of the roadmap, and the answer says so."""
    roadmap = offline_roadmap(walled, np.random.default_rng(0))
    for part in nx.connected_components(roadmap.graph):
        sides = np.sign(roadmap.poses[sorted(part)][:, 0])
        assert np.all(sides == sides[0])
    assert nx.number_connected_components(roadmap.graph) == 2
    result = plan_guide(walled, GuideTask(START, GOAL), np.random.default_rng(0))
    assert not result.succeeded
    assert result.where == "roadmap"
    assert "the goal is walled off from the start" in result.failure
    planner = LocalPlanner(walled.checker(), (START, GOAL))
    route = request(roadmap, planner, START, GOAL, np.random.default_rng(0))
    assert "walled off" in route.failure


@pytest.mark.parametrize(
    ("start", "goal", "where", "reason"),
    [
        (root_pose((0.0, -0.5, 0.3)), GOAL, "start", "the trunk's 'trunk/ball' meets 'wall'"),
        (START, root_pose((0.7, 0.0, 5.0)), "goal", "0 limbs reach a usable surface and 2 are wanted"),
    ],
)
def test_an_unfit_end_says_which_condition_fails(walled, start, goal, where, reason):
    result = plan_guide(walled, GuideTask(start, goal), np.random.default_rng(0))
    assert not result.succeeded
    assert result.where == where
    assert reason in result.failure


def test_same_seed_same_bits(open_world, found):
    again = plan_guide(open_world, GuideTask(START, GOAL), np.random.default_rng(0))
    assert np.array_equal(again.path.control_points, found.path.control_points)
    assert again.samples == found.samples


@pytest.fixture(scope="module")
def roadmap(open_world):
    return offline_roadmap(open_world, np.random.default_rng(2))


def test_guards_do_not_see_each_other_and_connections_join(open_world, roadmap):
    """Edges of a visibility roadmap have one guard and one connection; each edge can be walked."""
    assert nx.number_connected_components(roadmap.graph) == 1
    planner = LocalPlanner(open_world.checker())
    for a, b, edge in roadmap.graph.edges(data=True):
        guards = [roadmap.graph.nodes[node]["guard"] for node in (a, b)]
        assert sorted(guards) == [False, True]
        assert edge["weight"] == distance(roadmap.poses[a], roadmap.poses[b])
        points = planner.waypoints(roadmap.poses[a], roadmap.poses[b], roadmap.way(a, b).turn_at)
        assert all(planner.straight(p, q) for p, q in itertools.pairwise(points))


def test_route_is_the_shortest_way_of_the_roadmap(open_world, roadmap):
    """A* with the distance as estimate finds what Dijkstra's algorithm finds."""
    from manikin.planning.guide.roadmap import attach, find_route

    grown, planner = roadmap.copy(), LocalPlanner(open_world.checker(), (START, GOAL))
    ends = [attach(grown, pose, planner, np.random.default_rng(0)) for pose in (START, GOAL)]
    route = find_route(grown, planner, *ends)
    assert route.length == pytest.approx(nx.dijkstra_path_length(grown.graph, *ends))
    assert len(roadmap.poses) == len(grown.poses) - 2


def test_a_roadmap_with_a_way_needs_no_further_poses(open_world, roadmap):
    result = plan_guide(open_world, GuideTask(START, GOAL), np.random.default_rng(1), roadmap)
    assert result.succeeded
    assert result.samples == 0


def test_pruning_and_shortcuts_never_take_longer(open_world, found):
    """Each step of the refinement holds the condition and shortens the way."""
    planner = LocalPlanner(open_world.checker(), (START, GOAL))
    limits, rng = RootLimits(), np.random.default_rng(4)
    detour = np.vstack([found.milestones, found.milestones[::-1][1:], found.milestones[1:]])
    pruned = prune(detour, planner)
    assert traverse_times(pruned, limits)[-1] < traverse_times(detour, limits)[-1]
    assert all(planner.straight(a, b) for a, b in itertools.pairwise(pruned))
    path = approximate(detour, planner, limits, rng)
    assert path.degree == 3
    assert path_holds(path, planner)
    quicker = shorten(path, planner, rng)
    assert path_holds(quicker, planner)
    assert quicker.duration < path.duration


def test_traverse_times_are_changes_over_speeds():
    """0.9 to 1.0 and back at 1 m/s take 0.1 s each (the print gives 0.436 s and no number)."""
    there, back = root_pose((0.9, 0.0, 0.0)), root_pose((1.0, 0.0, 0.0))
    times = traverse_times(np.stack([there, back, there]), RootLimits(1.0, 1.0))
    np.testing.assert_allclose(times, [0.0, 0.1, 0.2], atol=1e-12)
