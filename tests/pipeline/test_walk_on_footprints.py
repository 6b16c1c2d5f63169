"""Walks that are planned on footprints and executed: the scenarios, and what is refused."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.errors import ScenarioError
from manikin.pipeline.stages.context import Report, RunContext
from manikin.pipeline.stages.walking_stage import walk_on_footprints
from manikin.scenarios import load_scenario


def on_footprints(name: str, *overrides: str) -> RunContext:
    context = RunContext.of(load_scenario(name, overrides=overrides))
    found = walk_on_footprints(context, Report(context, None, None, 0.0))
    assert found is not None
    return found


def test_a_walk_before_a_plan_ends_on_its_first_feet():
    """Its last phases are those of the plan; the foot that flies first is not the one that just landed."""
    whole = on_footprints("walk-and-platform").scenario.explicit_supports().resolved_phases()
    plan = load_scenario("platform").in_task_frame().explicit_supports().resolved_phases()
    seam = len(whole) - len(plan)
    assert seam > 10
    for mine, theirs in zip(whole[seam:], plan, strict=True):
        assert mine.keys() == theirs.keys()
        for foot, contact in mine.items():
            np.testing.assert_allclose(contact.position, theirs[foot].position, atol=1e-9)
    assert set(whole[seam - 1]) == {"left_foot"}
    assert set(whole[seam + 1]) == {"right_foot"}


@pytest.mark.parametrize(("variant", "way"), [("", 3.0), ("@curved", 2.8), ("@sideways", 1.2)])
def test_footprints_lead_from_start_to_goal(variant, way):
    context = on_footprints(f"stroll{variant}")
    first, last = (
        np.mean([context.scenario.build_sequence()[at].stance[foot].position for foot in
                 ("left_foot", "right_foot")], axis=0)
        for at in (0, -1)
    )  # fmt: skip
    task = load_scenario(f"stroll{variant}").file.task
    np.testing.assert_allclose(first[:2], task.start.at, atol=0.01)
    np.testing.assert_allclose(last[:2], task.goal.at, atol=0.01)
    assert np.hypot(*(last - first)[:2]) == pytest.approx(way, abs=0.05)


@pytest.mark.long
@pytest.mark.slow
def test_the_walk_to_the_platform_goes_on_without_a_seam(runs):
    """No planned sample is farther from the one before than its velocities and accelerations explain."""
    result = runs("walk-and-platform", overrides=(*runs.shorter_by("walk-and-platform"), "execution=none"))
    assert result.succeeded
    assert result.planned is not None
    motion, body = result.planned, on_footprints("walk-and-platform").body
    step = np.diff(motion.time)[:, None]
    moved = np.array([
        pin.difference(body.pinocchio, a, b) for a, b in zip(motion.q[:-1], motion.q[1:], strict=True)
    ])  # fmt: skip
    mean = 0.5 * (motion.v[1:] + motion.v[:-1])
    # At 1 kHz the trapezoid rule is wrong by j dt^3 / 12; jerks up to 1e4 leave 1e-6.
    assert np.abs(moved - step * mean).max() < 1e-6
    assert np.abs(np.diff(motion.v, axis=0) - step * 0.5 * (motion.a[1:] + motion.a[:-1])).max() < 1e-4


@pytest.mark.parametrize(
    ("name", "override", "words"),
    [
        ("platform", "walking={}", "walking.start"),
        ("stroll", "walking.start={at: [0, 0]}", "walking.start"),
        ("stroll", "walking.via=[{at: [1, 0]}]", "walking.via"),
        ("stroll", "walking.wait_s=2.0", "walking.wait_s is 2 in a planned walk; valid there: leave it out"),
        ("walk-and-platform", "walking.wait_s=0.5", "walking.wait_s is 0.5"),
        ("goal-left", "walking.footprints=library", "walking.footprints is library"),
        ("walk-and-platform", "walking.footprints=library", "walking.footprints is library"),
        ("stroll", "contacts={}", "contacts"),
        ("walk-and-platform", "walking.start.at=[0.0, 0.0]", "already is"),
        ("walk-and-platform", "supports.phases.0.left_foot=null", "left_foot"),
    ],
)
def test_what_cannot_be_walked_is_refused(name, override, words):
    with pytest.raises(ScenarioError, match=words) as caught:
        on_footprints(name, override)
    assert "\n" not in str(caught.value)
