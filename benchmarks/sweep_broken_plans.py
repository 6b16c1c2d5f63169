"""Contact plans of our planner, and every way of breaking them: `pytest benchmarks/sweep_broken_plans.py`.

The tests break the plan of one scenario; here the plans are found anew and broken in four.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from manikin.pipeline.stages import RunContext
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.pipeline.stages.context import plan_in_world
from manikin.scenarios import load_scenario
from manikin.verification import check_contact_plan

TESTS = Path(__file__).parents[1] / "tests" / "verification" / "test_check.py"
SPEC = importlib.util.spec_from_file_location("test_check", TESTS)
CASES = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(CASES)


@pytest.fixture(scope="module", params=("crouch", "stairs", "stand-up-chair", "platform@found"))
def planned(request):
    name, _, variant = request.param.partition("@")
    scenario = load_scenario(name, variant or None)
    context = RunContext.of(scenario)
    rng = np.random.default_rng(scenario.seed)
    found = find_supports(context.scenario, context.body, context.scene, rng)
    return scenario, plan_in_world(found.plan, context.transform_task_to_world)


def test_the_plan_is_certified(planned):
    """Our own plan keeps every requirement."""
    assert check_contact_plan(*planned).verdict == "certified"


@pytest.mark.parametrize("spoil", CASES.BREAKS, ids=lambda spoil: spoil.__name__)
def test_a_broken_plan_is_refused_with_the_true_cause(planned, spoil):
    """The first requirement that does not hold is the cause."""
    broken = check_contact_plan(*spoil(*planned)).requirements.first_broken
    assert broken is not None
    assert broken.key == CASES.BREAKS[spoil]
