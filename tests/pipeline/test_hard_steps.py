"""Steps that feet alone do not make easily: from rest to rest, hands on rails."""

from itertools import pairwise

import numpy as np
import pytest

from manikin.pipeline import runner
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scene import Proximity

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def beside_a_rail(tmp_path_factory):
    """Onto a block, or down, with a hand on a rail; the motion alone."""
    scenario = draw_scene(FAMILIES["blocks"], 1306, tmp_path_factory.mktemp("scene"))
    scenario = scenario.with_overrides(["execution=none"])
    return scenario, runner.run(scenario)


def test_a_body_rests_whenever_a_limb_of_a_hard_step_has_come_to_its_contact(beside_a_rail):
    """Between its flights a body that holds on with a hand stands still."""
    _, result = beside_a_rail
    assert result.summary["planned"], result.summary["failure"]
    refined = result.wholebody
    assert any("hand" in name for phase in refined.schedule.sequence for name in phase.stance.effectors)
    held = [set(phase.stance.effectors) for phase in refined.schedule.sequence]
    landings = [k for k, (before, after) in enumerate(pairwise(held), 1) if after > before]
    found = refined.spline.evaluate(refined.schedule.instants[landings])
    np.testing.assert_allclose(found.v, 0.0, atol=1e-6)


def test_a_forearm_keeps_off_the_rail_that_its_hand_holds(beside_a_rail):
    """At rest on it, by a centimetre: a grip gives way by some millimetres."""
    scenario, result = beside_a_rail
    proximity, near = Proximity(scenario.build_body(), scenario.build_scene()), []
    schedule = result.wholebody.schedule
    for time, phase in zip(schedule.instants[:-1], schedule.sequence, strict=True):
        if "left_hand" in phase.stance or "right_hand" in phase.stance:
            q = result.planned.q[int(np.argmin(np.abs(result.planned.time - time)))]
            found = proximity.evaluate(q, 0.05)
            pairs = zip(found.distance, found.pairs, strict=True)
            near += [away for away, (shape, other) in pairs if "forearm" in shape and other == "rail"]
    assert min(near, default=1.0) > 0.01
