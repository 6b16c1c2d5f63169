"""Plans in worlds that are not as believed: what is drawn, what acts, and what is told of it."""

from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, quadruped
from manikin.control import ControlSettings, ReturnSettings, StateNoise
from manikin.control.delay import DelayEstimator
from manikin.control.settings import Impedances
from manikin.errors import InputError
from manikin.pipeline.stages.execution_stage import _trials
from manikin.reports.summary_table import trials_line
from manikin.scenarios import load_scenario
from manikin.scene import Box, Obstacle, Scene
from manikin.simulation import execute
from manikin.simulation.execute import _Run
from manikin.simulation.trials import TrialTask, run_trials
from manikin.simulation.uncertainty import Uncertainty

STATED = Uncertainty()
NOTHING = STATED.scaled(0.0)


@pytest.fixture(scope="module")
def still(stand):
    """A tenth of a second of standing."""
    return stand(0.1)


@pytest.fixture(scope="module")
def shelf():
    return Scene([Obstacle("shelf", Box((0.3, 1.0, 0.05)), translation=(0.8, 0.0, 0.4))])


@given(st.integers(0, 2**32 - 1))
def test_worlds_are_within_what_is_stated(body, still, shelf, seed):
    """Masses, friction, heights, delay, angles and push; and the centre of mass in the standing posture."""
    truth = STATED.draw(body, shelf, still.motion, seed)
    shares = [a.mass / b.mass for a, b in zip(truth.body.segments, body.segments, strict=True)]
    assert 0.95 <= min(shares) <= max(shares) <= 1.05
    standing = body.standing_posture()
    same = replace(
        truth.body, nominal_mass=None,
        segments=tuple(
            replace(segment, mass=true.mass, inertia=true.inertia)
            for true, segment in zip(truth.body.segments, body.segments, strict=True)
        ),
    )  # fmt: skip
    moved = Configuration(truth.body, standing).com - Configuration(same, standing).com
    assert np.abs(moved).max() <= 0.01 + 1e-12
    assert 0.8 <= truth.friction <= 1.0
    assert 0.0 <= truth.delay <= 0.015
    assert np.abs(truth.joints).max() <= np.deg2rad(1.0)
    assert abs(truth.scene["shelf"].translation[2] - 0.4) <= 0.005
    assert truth.scene.floor_height == shelf.floor_height
    (push,) = truth.pushes
    assert np.linalg.norm(push.force) == pytest.approx(50.0)
    assert push.force[2] == 0.0
    assert 0.0 <= push.start <= still.motion.duration - push.duration
    again = STATED.draw(body, shelf, still.motion, seed)
    assert again.body.segments[3].mass == truth.body.segments[3].mass
    np.testing.assert_array_equal(again.joints, truth.joints)


def test_who_is_light_is_pushed_by_as_much_speed_as_a_person(body):
    """50 N for 0.1 s change the speed of 75 kg by 67 mm/s."""
    assert Uncertainty.of(body) == STATED
    light = quadruped()
    assert light.mass < 75.0
    mine = Uncertainty.of(light)
    assert mine.push_N * mine.push_s / light.mass == pytest.approx(50.0 * 0.1 / 75.0)
    assert replace(mine, push_N=50.0) == STATED


def test_noise_has_the_stated_deviations(body):
    """Of 2000 draws of each coordinate; the deviation of a deviation is then 1.6 %."""
    noise, rng, q = StateNoise(0.01, 0.002, 0.03), np.random.default_rng(0), body.standing_posture()
    told = [noise.told(body, q, np.zeros(body.nv), rng) for _ in range(2000)]
    off = np.array([pin.difference(body.pinocchio, q, one) for one, _ in told]).std(axis=0)
    rates = np.array([rate for _, rate in told]).std(axis=0)
    assert off[:3] == pytest.approx(np.full(3, 0.002), rel=0.08)
    assert off[3:] == pytest.approx(np.full(body.nv - 3, 0.01), rel=0.08)
    assert rates[:3] == pytest.approx(np.full(3, 0.03), rel=0.08)
    assert rates[3:] == pytest.approx(np.full(body.nv - 3, 0.1), rel=0.08)


def test_a_world_without_uncertainty_is_the_believed_one(body, still, shelf):
    """To the rounding of turns by nothing, 1e-14 when the motion begins, which contacts make larger."""
    told = {"motion": still.motion, "schedule": still.schedule, "hold": 0.1}
    truth = NOTHING.draw(body, shelf, still.motion, 3)
    assert truth.pushes == ()
    plain = execute(body, shelf, **told)
    other = execute(body, shelf, **told, truth=truth)
    np.testing.assert_allclose(plain.motion.q, other.motion.q, atol=1e-9)
    np.testing.assert_allclose(plain.motion.tau, other.motion.tau, atol=1e-5)


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.015])
def test_torques_act_after_the_delay(body, still, shelf, delay):
    """The engine gets in its k-th step what was commanded a delay before; at first the first command."""
    truth = replace(NOTHING.draw(body, shelf, still.motion, 0), delay=delay)
    run = _Run(body, shelf, still.motion, still.schedule, None, None, (), (), (), truth)
    acted = []
    run.world.advance = lambda tau, steps: acted.extend([float(tau[0])] * steps)
    for number in range(10):
        run._advance(np.full(body.nv - 6, float(number)), 1)
        run._advance(np.full(body.nv - 6, float(number)), 3)
    late = round(1e3 * delay)
    commanded = [float(k // 4) for k in range(40)]
    assert acted == [commanded[max(k - late, 0)] for k in range(40)]


def test_torques_jump_less_where_control_knows_of_the_noise(body, still, shelf):
    """Root mean square of their steps in a third of a second of standing, at the stated noise alone."""
    stated = replace(NOTHING, angle_noise_deg=0.1, position_noise_m=0.001, velocity_noise_m_s=0.005)
    truth = stated.draw(body, shelf, still.motion, 0)
    steps = []
    for noise in (StateNoise(), stated.noise):
        settings = ControlSettings(noise=noise)
        found = execute(body, shelf, still.motion, still.schedule, hold=0.25, settings=settings, truth=truth)
        assert not found.fell
        share = body.torque_share(np.diff(found.motion.tau[:, -(body.nv - 6) :], axis=0))
        steps.append(np.sqrt(np.mean(share**2)))
    assert steps[1] < 0.5 * steps[0]


def test_feet_begin_where_the_true_ground_carries_them(body, still):
    """On a board that is 5 mm higher the body begins 5 mm higher."""
    board = Obstacle("board", Box((1.0, 1.0, 0.1)), translation=(0.0, 0.0, -0.05))
    believed = Scene([board], floor_height=None)
    higher = Scene([Obstacle("board", board.shape, translation=(0.0, 0.0, -0.045))], floor_height=None)
    truth = replace(NOTHING.draw(body, believed, still.motion, 0), scene=higher)
    run = _Run(body, believed, still.motion, still.schedule, None, None, (), (), (), truth)
    # Distances of the soles are exact to the tolerance of the distance library.
    assert run._first_posture()[2] - still.motion.q[0, 2] == pytest.approx(0.005, abs=1e-5)


def test_standing_is_kept_in_stated_worlds_and_not_in_wild_ones(body, still):
    """Five kilograms more or less and a push of 50 N do not fell who stands; 40 times that does."""
    settings_ = ControlSettings(returning=ReturnSettings())
    task = TrialTask(body, Scene(), still.motion, still.schedule, settings_, hold=0.3)
    # First angles that are 1 degree off have the feet centimetres from their plan to the end.
    stated = run_trials(task, 2, uncertainty=replace(STATED, joints_deg=0.0), seed=1)
    assert stated.summary() == {
        "worlds": 2, "stood_share": 1.0, "arrived_share": 1.0, "first_failures": {},
    }  # fmt: skip
    pushed = replace(NOTHING, push_N=2000.0, push_s=0.2)
    wild = run_trials(task, 1, uncertainty=pushed, seed=1)
    assert wild.stood_share == wild.arrived_share == 0.0
    assert wild.summary()["first_failures"] == {"fell in phase 0 on left_foot, right_foot": 1}


@pytest.mark.long
def test_other_processes_find_the_same(body, still):
    task = TrialTask(body, Scene(), still.motion, still.schedule, ControlSettings(), hold=0.0)
    assert run_trials(task, 2, seed=5, workers=2).worlds == run_trials(task, 2, seed=5).worlds


@pytest.mark.parametrize(("name", "value"), [("mass_share", 1.0), ("delay_s", -0.1), ("friction_share", 2.0)])
def test_uncertainties_that_mean_nothing_are_refused(name, value):
    with pytest.raises(InputError, match=f"uncertainty {name}"):
        replace(STATED, **{name: value})


def test_a_run_tells_its_trials_and_their_uncertainty(body, still):
    """What a file leaves out has the default, by the factor; what it gives is as given."""
    scenario = load_scenario("platform").replaced(
        execution={"trials": 1, "uncertainty": {"factor": 0.5, "push_N": 0.0, "delay_s": 0.004}}
    )
    task, told = TrialTask(body, Scene(), still.motion, still.schedule, ControlSettings(), hold=0.0), []
    block = _trials(scenario, task, SimpleNamespace(progress=lambda *share: told.append(share)))
    assert (block["worlds"], block["stood_share"], told) == (1, 1.0, [("trials", 1.0)])
    assert block["uncertainty"]["push_N"] == 0.0
    assert block["uncertainty"]["delay_s"] == 0.004
    assert block["uncertainty"]["mass_share"] == 0.5 * STATED.mass_share
    assert block["uncertainty"]["push_s"] == STATED.push_s
    line = trials_line(block | {"first_failures": {"fell in phase 2 on right_foot": 3}})
    assert line == "trials: 1 other worlds, stood in 100%, arrived in 100%; 3 x fell in phase 2 on right_foot"


def test_a_creature_is_pushed_on_its_root(still):
    """It has no thorax; its worlds are drawn like a person's."""
    creature = quadruped()
    truth = STATED.draw(creature, Scene(), still.motion, 0)
    assert truth.pushes[0].segment == creature.segments[0].name


def test_late_torques_are_asked_for_ahead_of_time(body, stand, monkeypatch):
    """A squat of 15 cm in 0.7 s with torques 20 ms late: who foresees that asks for half the changes.

    It need not be told: who feels its torques asks for no more than 1.3 times as many.
    """
    plan = stand(0.7, lambda t: np.array([0.0, 0.0, -0.075]) * (1.0 - np.cos(np.pi * t / 0.7)))
    late = replace(NOTHING.draw(body, Scene(), plan.motion, 0), delay=0.02)
    changes, errors = [], []
    for told, feels in ((0.02, True), (0.0, True), (0.0, False)):
        with monkeypatch.context() as patch:
            if not feels:
                patch.setattr(DelayEstimator, "felt", lambda *_: None)
            settings = ControlSettings(delay=told)
            result = execute(
                body, Scene(), plan.motion, plan.schedule, settings=settings, truth=late, hold=0.2
            )
        changes.append(np.abs(np.diff(result.motion.tau[:, 6:], axis=0)).mean())
        errors.append(result.com_max_error_m)
    assert changes[0] < 0.5 * changes[2]
    assert errors[0] < errors[2]
    assert changes[1] < 1.3 * changes[0]


def test_the_delay_is_found_where_some_programs_are_not_solved(body, stand, monkeypatch):
    """In every second step the torques before are asked for again; to half of the engine's step."""
    plan = stand(0.7, lambda t: np.array([0.0, 0.0, -0.03]) * (1.0 - np.cos(np.pi * t / 0.7)))
    late = replace(NOTHING.draw(body, Scene(), plan.motion, 0), delay=0.013)
    run = _Run(
        body, Scene(), plan.motion, plan.schedule, ControlSettings(delay=0.005), None, (), (), (), late
    )
    solve, steps = run.controller._solve, count()
    monkeypatch.setattr(
        run.controller, "_solve",
        lambda problem: (None, "previous torques") if next(steps) % 2 else solve(problem),
    )  # fmt: skip
    assert not run.run(0.0, None).fell
    assert run.controller._late.delay == pytest.approx(0.013, abs=5e-4)


def test_a_trunk_heavier_on_one_side_is_held_upright(body, stand):
    """Its centre of mass is 3 cm aside: after a second the joints are nearer to the plan than without.

    Who estimates the state estimates the disturbance as well: the mean error of the trunk's angles is less
    than a third of what it is where its stiffness alone holds it.
    """
    plan = stand(1.5)
    segments = tuple(
        replace(item, com=item.com + np.array([0.0, 0.03, 0.0])) if item.name == "thorax" else item
        for item in body.segments
    )
    stated = replace(NOTHING, angle_noise_deg=0.01, position_noise_m=1e-4, velocity_noise_m_s=5e-4)
    truth = replace(
        stated.draw(body, Scene(), plan.motion, 0), body=replace(body, nominal_mass=None, segments=segments)
    )
    trunk = [k for k, name in enumerate(body.joint_names) if name.startswith(("lumbar", "thorax"))]
    errors = []
    for noise in (StateNoise(), stated.noise):
        settings = ControlSettings(noise=noise)
        result = execute(body, Scene(), plan.motion, plan.schedule, settings=settings, truth=truth, hold=0.5)
        late = result.motion.time > 1.5
        away = result.motion.q[late][:, 7:] - plan.motion.q[-1, 7:]
        errors.append(np.abs(away[:, trunk].mean(axis=0)).max())
    assert errors[1] < errors[0] / 3.0


def test_a_free_arm_yields_by_the_inverse_of_its_stiffness(body, stand):
    """With its centre of mass 1 cm aside a forearm turns about itself until I k angle = m g d cos(angle).

    So k angle / cos(angle) is the same for two gains; 3 %, as the rest of the body gives way a little.
    """
    plan = stand(1.5)
    q, joint = np.array(plan.motion.q[0]), body.joint_index("left_forearm_pronation")
    q[7 + body.joint_index("left_elbow_flexion")] = 0.5 * np.pi
    q[7 + joint] = 0.0
    com = np.tile(Configuration(body, q).com, (len(plan.motion.time), 1))
    bent = replace(plan.motion, q=np.tile(q, (len(com), 1)), com=com)
    arm = Configuration(body, q)
    axis = arm.segment_placement("left_forearm")[0][:, 2]
    aside = np.cross(axis, (0.0, 0.0, 1.0))
    aside *= 0.01 / np.linalg.norm(aside)
    segments = tuple(
        replace(item, com=item.com + arm.segment_placement(item.name)[0].T @ aside)
        if item.name == "left_forearm" else item
        for item in body.segments
    )  # fmt: skip
    truth = NOTHING.draw(body, Scene([], 0.0), bent, 0)
    truth = replace(truth, body=replace(truth.body, nominal_mass=None, segments=segments))
    gains, turned = Impedances(), []
    for arms in (gains.arms, gains.posture):
        asked = ControlSettings(impedances=replace(gains, arms=arms))
        done = execute(body, Scene([], 0.0), bent, plan.schedule, settings=asked, truth=truth).motion
        turned.append(done.q[-1, 7 + joint] - q[7 + joint])
    free, as_all = turned
    load = gains.arms.stiffness * free / np.cos(free)
    assert load == pytest.approx(gains.posture.stiffness * as_all / np.cos(as_all), rel=0.03)
    assert 0.1 < abs(free) < 0.2 < abs(as_all)
