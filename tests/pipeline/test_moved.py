"""Nothing depends on where a scene's origin lies or where its x axis points.

The moved scenario's coordinates are written anew in the world; its run finds the frame of the task by itself.
One scenario of each kind of supports is run; ``benchmarks/sweep_scenarios.py`` has crouch, stairs and others.
"""

import numpy as np
import pytest

from manikin.motion.file import read_motions
from manikin.numerics.spatial import PlanarTransform
from manikin.pipeline.runner import run
from manikin.pipeline.stages.context import reason_in_world
from manikin.scenarios import load_scenario

MOVE = (10.0, -7.0, 37.0)

NAMES = (
    "step", "goal-left",
    *(pytest.param(name, marks=pytest.mark.long) for name in ("platform", "stand-up-chair", "push-back-500")),
)  # fmt: skip
"""Supports that are listed and a walk; in the sweep supports that are found and a push as well."""


@pytest.fixture
def both(runs):
    """Runs of a scenario and of the same one moved."""

    def made(name):
        if name == "step":
            return runs.step(), runs.step(moved=MOVE)
        return runs.shorter(name), runs.shorter(name, moved=MOVE)

    return made


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_moved_scenario_succeeds_with_the_same_margins(both, name):
    """To 1e-6 of each margin, planned and executed, as the design asks for."""
    here, there = both(name)
    assert here.succeeded, here.summary["failure"]
    assert there.succeeded, there.summary["failure"]
    for first, second in ((here.planned, there.planned), (here.executed, there.executed)):
        assert (first is None) == (second is None)
        if first is not None:
            np.testing.assert_allclose(second.margin, first.margin, rtol=1e-6, atol=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_moved_scenario_has_the_same_motion_elsewhere(both, name):
    """Joints, velocities and torques agree where two runs of one scenario do.

    These differ by up to 1e-8 rad, planned, by what their process did before; a touch-down of the execution
    makes some 100 times as much of it, and its accelerations jump there.
    """
    here, there = both(name)
    transform = PlanarTransform(*MOVE)
    pairs = (here.planned, there.planned, 1.0), (here.executed, there.executed, 100.0)
    for first, second, factor in pairs:
        if first is None:
            continue
        np.testing.assert_array_equal(second.support, first.support)
        np.testing.assert_allclose(second.time, first.time, rtol=0.0, atol=1e-12)
        for unmoved, tolerance in (("v", 1e-6), ("tau", 1e-3)):
            np.testing.assert_allclose(
                getattr(second, unmoved), getattr(first, unmoved), rtol=0.0, atol=factor * tolerance,
                err_msg=unmoved,
            )  # fmt: skip
        np.testing.assert_allclose(second.q[:, 7:], first.q[:, 7:], rtol=0.0, atol=factor * 1e-7)
        wanted = transform.poses(first.q)
        np.testing.assert_allclose(second.q[:, :3], wanted[:, :3], rtol=0.0, atol=factor * 1e-7)
        cosine = np.abs(np.sum(second.q[:, 3:7] * wanted[:, 3:7], axis=1))
        np.testing.assert_allclose(cosine, 1.0, rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(second.com, transform.points(first.com), rtol=0.0, atol=factor * 1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_files_of_a_moved_run_are_in_the_world(both, name):
    """Motion, contacts and scene stand where the scenario stands: contacts on its surfaces, to 5 mm."""
    _, there = both(name)
    assert there.directory is not None
    content = read_motions(there.directory / "motion.h5")
    scenario = load_scenario(there.directory / "scenario.yaml")
    scene = scenario.build_scene()
    for contact in (contact for phase in content.schedule.sequence for contact in phase.stance):
        assert content.scene.touched_obstacles(contact, 0.005) == scene.touched_obstacles(contact, 0.005)
    kept = content.executed if content.planned is None else content.planned
    start = np.array(scenario.file.task.start.com or scenario.file.task.start.at)[:2]
    assert np.hypot(*(kept.com[0, :2] - start)) < 0.5


def test_a_place_in_a_reason_is_one_of_the_world():
    """Nobody sits beside the chair: the reason names the place as the file does, to its digits."""
    scenario = load_scenario("stand-up-chair", overrides=["task.start.at=[3.0, 1.0]"])
    reasons = [run(job).summary["failure"]["reason"] for job in (scenario, scenario.moved(*MOVE))]
    assert "[3.0, 1.0] m" in reasons[0]
    # 10 + 3 cos 37 deg - sin 37 deg, -7 + 3 sin 37 deg + cos 37 deg
    assert reasons[1] == reasons[0].replace("[3.0, 1.0] m", "[11.8, -4.4] m")


@pytest.mark.parametrize(
    ("reason", "moved"),
    [
        ("nothing near [1.0, 2.00] m", "nothing near [8.0, 2.0] m"),
        ("at [-0.5, 0.25, 1.125] m and [0, 0] m", "at [9.75, 0.5, 1.125] m and [10.0, 1.0] m"),
        ("margin [N.m] of phase [3] is at most 14.58", "margin [N.m] of phase [3] is at most 14.58"),
    ],
)
def test_positions_in_a_reason_are_moved_and_heights_and_other_numbers_stay(reason, moved):
    assert reason_in_world(reason, PlanarTransform(10.0, 1.0, 90.0)) == moved
