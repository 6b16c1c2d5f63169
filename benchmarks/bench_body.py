"""Building a body and evaluating its configurations."""

import mujoco
import numpy as np
import pytest

from manikin.body import Configuration, human, insect, random_configuration
from manikin.kinematics import reach_volume
from manikin.scene import Scene
from manikin.simulation import compile_model


@pytest.fixture(scope="module")
def states():
    body = human()
    rng = np.random.default_rng(0)
    return body, [(random_configuration(body, rng), rng.standard_normal(body.nv)) for _ in range(100)]


def build():
    body = human()
    return body.pinocchio, body.geometry


def test_build_the_human_with_both_models(benchmark):
    benchmark(build)


def test_compile_to_mujoco(benchmark):
    benchmark(compile_model, human(), Scene([]))


def test_place_all_frames(benchmark, states):
    """100 updates of a configuration."""
    body, samples = states
    state = Configuration(body)
    benchmark(lambda: [state.update(q, v) for q, v in samples])


def test_everything_a_controller_asks_for(benchmark, states):
    """100 states: mass matrix, nonlinear effects, momentum, six effectors with Jacobian."""
    body, samples = states
    state = Configuration(body)

    def control_terms():
        for q, v in samples:
            state.update(q, v)
            _ = state.mass_matrix, state.nonlinear_effects, state.com_jacobian
            for name in body.effectors:
                _ = state.effector_jacobian(name)

    benchmark(control_terms)


def test_hundred_physics_steps_standing(benchmark):
    model = compile_model(human(), Scene([]))
    data = mujoco.MjData(model.mujoco)

    def steps():
        model.set_state(data, model.body.standing_posture())
        for _ in range(100):
            mujoco.mj_step(model.mujoco, data)

    benchmark(steps)


@pytest.mark.parametrize("count", [10_000, 100_000])
@pytest.mark.parametrize("make", [human, insect])
def test_reach_of_a_limb(benchmark, make, count):
    """Sampling and hull."""
    body = make()
    benchmark(lambda: reach_volume(body, body.limbs[0], np.random.default_rng(0), count))
