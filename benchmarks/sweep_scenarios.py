"""Every built-in scenario, variant, body and seed: `pytest benchmarks/sweep_scenarios.py -n 2`.

An hour on two cores. The tests run one scenario of each kind; this runs all. ``-k`` chooses: ``-k beam``,
``-k "bodies and walk"``.
"""

import numpy as np
import pytest

import manikin
from manikin.motion.file import read_motions
from manikin.numerics.spatial import IDENTITY
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.pipeline.stages.context import plan_in_world
from manikin.scenarios import list_scenarios, list_variants, load_scenario
from manikin.scene import Proximity, Scene
from manikin.verification import check_contact_plan

EVERY = [
    name if variant is None else f"{name}@{variant}"
    for name in list_scenarios()
    for variant in (None, *list_variants(name))
]
LOWEST_COM = {
    "beam-H1C1": 0.85, "beam-H2C1": 0.80, "beam-H3C1": 0.65, "beam-H1C1@S2": 0.85, "beam-H2C1@S2": 0.80,
    "beam-H3C1@S2": 0.65, "beam-H2C2": 0.80, "beam-H2C3": 0.80,
}  # fmt: skip
"""Lowest CoM heights of people under a beam [m] ([Qiu2012]_ 3.2.3, "about")."""

CAUSES = {f"beam-{case}@slippery": "friction of 0.05 is too low" for case in ("H1C1", "H2C1", "H3C1", "H2C3")}
CAUSES["stand-up-chair@slippery"] = "friction of 0.02 is too low"
"""What the reason of an expected failure names, beside those of the tests."""

BODIES = [
    *[("platform", *body) for body in ((1.60, 58.0, "male"), (1.90, 95.0, "male"), (1.60, 55.0, "female"))],
    *[
        (name, stature, mass, "male")
        for name in ("walk", "walk@flat", "ramp", "ramp-down")
        for stature, mass in ((1.65, 62.0), (1.75, 70.0), (1.85, 78.0))
    ],
    *[
        (name, stature, None, None)
        for name in ("car-ingress", "beam-H2C2", "beam-H3C1")
        for stature in (1.65, 1.85)
    ],
    *[("stand-up-chair", stature, None, None) for stature in (1.50, 1.60, 1.65, 1.70, 1.88)],
]
"""Scenario, stature [m], mass [kg] and sex; those of the scenario where None."""


THESES = (
    "stand-up-sofa", "stand-up-sofa@hands", "stand-up-chair", "stand-up-chair@hands", "pull-rope@wall",
    "truck-egress", "climb-wall",
)  # fmt: skip
"""Scenes of the theses from start and goal alone, to be done by people of other statures."""


@pytest.mark.parametrize("name", EVERY)
def test_every_scenario_ends_as_its_file_says(name):
    """A success stands on its feet in the physics engine; a failure names its stage and its reason."""
    result = manikin.run(name)
    if load_scenario(name).file.expect == "failure":
        assert not result.succeeded
        assert result.summary["failure"]["stage"]
        assert result.summary["failure"]["reason"]
        assert CAUSES.get(name, "") in result.summary["failure"]["reason"]
        return
    assert result.succeeded, result.summary["failure"]
    if result.execution is not None:
        assert not result.execution.fell
        assert result.execution.min_margin > 0.0


def test_getting_into_a_car_is_planned_and_executed_to_the_last_column(tmp_path):
    result = manikin.run("car-ingress", out=tmp_path / "run")
    summary = result.summary
    assert summary["proved"], summary["failure"]
    assert summary["wholebody"]["max_torque_share"] <= 1.0  # of the mean man, the impact on the seat included
    # Qiu (2012), 7.2.2 and Table 7.6.
    assert summary["centroidal"]["min_margin"] >= 18.7
    assert summary["centroidal"]["duration_s"] <= 4.56
    execution = summary["execution"]
    assert not execution["fell"]
    assert execution["min_margin"] > 0.0
    assert execution["max_penetration_m"] < 0.01
    assert result.execution.touches == ()
    schedule = read_motions(result.directory / "motion.h5").schedule
    assert len(schedule.sequence) == 12
    last = schedule.sequence[11].stance
    assert set(last.effectors) == {"left_foot", "right_foot", "left_hand", "right_hand", "buttocks"}
    # The seat carries most of the weight at the end, the hands hardly any.
    names = list(result.executed.contact_names)
    force = result.executed.contact_force[-1, :, 2]
    assert force[names.index("buttocks")] > 0.5 * 79.0 * 9.81
    assert np.abs(force[[names.index("left_hand"), names.index("right_hand")]]).max() < 150.0


@pytest.mark.parametrize("name", [name for name in EVERY if name in LOWEST_COM or name.endswith("@S2")])
def test_the_head_passes_under_the_beam(name):
    """2 cm clear of it; the CoM comes as low as people's within 7 cm, or lower with a hand on a post."""
    result = manikin.run(name)
    assert result.succeeded, result.summary["failure"]
    scenario = load_scenario(name)
    body = scenario.build_body()
    beam = Scene([item for item in scenario.build_scene() if item.name == "beam"], floor_height=None)
    proximity = Proximity(body, beam, self_collision=False)
    others = frozenset((segment.name, "beam") for segment in body.segments if segment.name != "head")
    assert min(proximity.minimum(q, others).distance for q in result.executed.q[::4]) >= 0.02
    if name in LOWEST_COM:
        assert result.summary["execution"]["lowest_com_m"] == pytest.approx(LOWEST_COM[name], abs=0.07)


@pytest.mark.parametrize("name", ["crouch", "stairs", "car-ingress", "beam-H2C2", "climb"])
def test_a_moved_scenario_has_the_same_margins(name):
    """By (10, -7, 0) m and 37 degrees: to 1e-6 of each margin, planned and executed."""
    scenario = load_scenario(name)
    here, there = manikin.run(scenario), manikin.run(scenario.moved(10.0, -7.0, 37.0))
    assert here.verdict == there.verdict
    np.testing.assert_allclose(there.planned.margin, here.planned.margin, rtol=1e-6, atol=0.0)
    if here.executed is not None:
        np.testing.assert_allclose(there.executed.margin, here.executed.margin, rtol=1e-6, atol=0.0)


def test_a_passage_runs_again_through_its_key_frames(tmp_path):
    """The example of [Qiu2012]_ 5.3.3, 9 key frames with a left-hand grasp, on our own recording."""
    recorded = manikin.run("beam-H1C1@S2", out=tmp_path / "recorded")
    file = tmp_path / "again.yaml"
    recording = f"planning: {{method: keyframes, recording: {recorded.directory}}}"
    file.write_text(f"extends: beam-H1C1@S2\nname: again\n{recording}\n")
    result = manikin.run(file)
    assert result.succeeded, result.summary["failure"]
    assert len(result.centroidal.key_instants) == 9
    assert result.summary["execution"]["min_margin"] > 0.0


def test_the_passage_between_two_beams_ends_on_the_seat():
    """At the end the seat carries most of the weight, and the person rests."""
    executed = manikin.run("beam-H2C3").executed
    buttocks = executed.contact_names.index("buttocks")
    assert executed.contact_force[-1, buttocks, 2] > 0.5 * 79.0 * 9.81
    assert np.abs(executed.v[-1]).max() < 0.1


def test_a_knee_high_beam_ends_in_its_true_cause():
    """0.4 m is less than the body folds to; the failure says so."""
    failure = manikin.run("beam-H1C1@knee-high").summary["failure"]
    assert "'beam' leaves 0.40 m above the supports; this body folds to no less than" in failure["reason"]


@pytest.mark.parametrize(("name", "stature", "mass", "sex"), BODIES)
def test_other_bodies_do_the_same(name, stature, mass, sex):
    """The scene does not grow with the body; margins of the scenario are kept by each ([Qiu2012]_ 5.4.4)."""
    scenario = load_scenario(name).with_body(stature, mass, sex)
    result = manikin.run(scenario)
    assert result.succeeded, result.summary["failure"]
    assert result.execution.min_margin > 0.0
    assert result.summary["centroidal"]["min_margin"] >= scenario.required_margin - 1e-6
    if name.startswith(("walk", "ramp-down")):
        assert result.summary["centroidal"]["min_zmp_distance_m"] > 0.0
        assert result.summary["wholebody"]["min_zmp_distance_m"] > 0.0


@pytest.mark.parametrize("name", THESES)
@pytest.mark.parametrize("stature", [1.60, 1.75, 1.88])
def test_scenes_of_the_theses_are_proved_for_other_statures(name, stature):
    """The mass is that of the scenario; measured in docs/refinement.md."""
    result = manikin.run(load_scenario(name).with_body(stature, None, None))
    assert result.succeeded, result.summary["failure"]


@pytest.mark.parametrize(
    "name",
    ["crouch", "stairs", "stand-up-chair", "stand-up-sofa", "platform@found", "climb", "climb-wall"],
)
@pytest.mark.parametrize("seed", range(20))
def test_contacts_are_found_with_every_seed(name, seed):
    scenario = load_scenario(name)
    body, scene = scenario.build_body(), scenario.build_scene()
    found = find_supports(scenario, body, scene, np.random.default_rng(seed))
    assert found.failure is None
    check = check_contact_plan(scenario, plan_in_world(found.plan, IDENTITY))
    assert check.verdict == "certified"
