"""Scenarios whose supports are the footprints of a walk."""

import numpy as np
import pytest

from manikin.contact import FRICTION_MODELS
from manikin.errors import InputError, ScenarioError
from manikin.scenarios import load_scenario
from manikin.scenarios.planned import LEAST, walk_before, walking_supports
from manikin.walking import walking_path
from manikin.walking.footprints import FEET
from manikin.walking.stepper import StepRule, place_footprints


@pytest.fixture(scope="module")
def ahead():
    """Footprints of 2 m straight on."""
    return place_footprints(walking_path((0, 0, 0), (2, 0, 0), max_speed=0.6))


@pytest.fixture(scope="module")
def to_platform():
    """Footprints of 2 m to the platform, on which its plan begins."""
    path = walking_path((0, -2, np.pi / 2), (0, 0, np.pi / 2), max_speed=0.6)
    return place_footprints(path, first="right_foot")


def test_supports_are_the_footprints(ahead):
    scenario = walking_supports(ahead, load_scenario("walk"))
    flights = scenario.build_sequence().swings()
    assert [flight.effector for flight in flights] == [step.effector for step in ahead.steps[2:]]
    for flight, step in zip(flights, ahead.steps[2:], strict=True):
        assert flight.end is not None
        assert np.allclose(flight.end.position, step.position)
        assert flight.end.yaw == pytest.approx(step.yaw)
    scenario.check_contacts(scenario.build_scene())


@pytest.mark.parametrize("model", FRICTION_MODELS)
def test_a_walk_keeps_to_the_friction_model_that_is_asked_for(ahead, model):
    """In the plan of the centre of mass and on the real supports."""
    asked = load_scenario("walk").with_overrides([f"planning.friction_model={model}"])
    scenario = walking_supports(ahead, asked)
    sequences = scenario.build_sequence(), scenario.build_centroidal_problem().sequence
    assert {phase.stance.friction_model for sequence in sequences for phase in sequence} == {model}


def test_supports_last_at_least_as_long_as_in_the_walk(ahead):
    scenario = walking_supports(ahead, load_scenario("walk"))
    phases = scenario.explicit_supports().phases
    for phase, (held, seconds) in list(zip(phases, ahead.phases(), strict=True))[1:-1]:
        assert phase.min_duration_s == max(seconds, LEAST[len(held)])


@pytest.mark.parametrize("stature", [1.55, 1.95])
def test_other_bodies_walk_with_their_own_heights(ahead, stature):
    """Whether heights are written for a reference stature or not, the body stands equally straight."""
    referred = load_scenario("walk").with_body(stature_m=stature)
    own = referred.replaced(reference_stature_m=None, reference_mass_kg=None)
    heights = [walking_supports(ahead, scenario).start_com[2] for scenario in (referred, own)]
    assert np.allclose(heights, 0.96 * stature / 1.75)
    margins = [walking_supports(ahead, scenario).required_margin for scenario in (referred, own)]
    assert np.allclose(margins, 10.9 * stature / 1.75)
    steps = place_footprints(walking_path((0, 0, 0), (2, 0, 0), max_speed=0.6), StepRule().scaled(stature))
    assert walking_supports(steps, own).build_centroidal_problem().support_distance == pytest.approx(
        0.985 * stature / 1.75
    )


def test_a_walk_before_a_plan_ends_on_its_first_stance(to_platform):
    platform = load_scenario("platform")
    scenario = walk_before(to_platform, platform)
    whole, own = scenario.build_sequence(), platform.build_sequence()
    assert len(whole.swings()) == to_platform.count + len(own.swings())
    for foot in FEET:
        landed = [flight.end for flight in whole.swings() if flight.effector == foot][-2:]
        assert landed[-1] is not None
        assert landed[-1].same_place(own.phases[-1].stance[foot])
    walked = whole.swings()[: to_platform.count]
    for foot in FEET:
        last = [flight.end for flight in walked if flight.effector == foot][-1]
        assert last is not None
        assert last.same_place(own.phases[0].stance[foot])
    assert np.allclose(scenario.start_com, [0.0, -2.0, platform.start_com[2]])
    assert np.allclose(scenario.goal_com, platform.goal_com)
    scenario.check_contacts(scenario.build_scene())


def test_walks_that_do_not_fit_are_refused(ahead, to_platform):
    with pytest.raises(InputError, match="from where the plan goes on"):
        walk_before(ahead, load_scenario("platform"))
    with pytest.raises(ScenarioError, match="supports"):
        walk_before(to_platform, load_scenario("platform", "found"))
