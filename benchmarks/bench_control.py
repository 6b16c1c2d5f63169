"""One control step and its quadratic program in a disturbed stand; the execution of a second.

Run with ``pytest benchmarks/bench_control.py``; a step has 5 ms of simulated time to beat. The executions are
measured in processor time; with ``--benchmark-json FILE`` the file has it per simulated second.
"""

import time

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.control import Controller, ControlSettings, ReturnSettings
from manikin.motion import Motion
from manikin.numerics.qp import WarmQPSolver
from manikin.scene import Scene
from manikin.simulation import execute
from manikin.simulation.execute import SETTLING
from manikin.simulation.uncertainty import Uncertainty

PERIOD = 0.005


@pytest.fixture(scope="module")
def standing():
    body = human()
    q, data = body.standing_posture(), body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    contacts = [
        sole(
            name, data.oMf[body.effector_frame(name)].translation, length=body.sole_length,
            width=body.sole_width, friction=0.7, normal_force_cap=1500.0,
        )
        for name in ("left_foot", "right_foot")
    ]  # fmt: skip
    schedule = ContactSchedule(StanceSequence([Phase(Stance(contacts))]), [0.0, 1.0])
    n, com = 1001, pin.centerOfMass(body.pinocchio, data, q)
    zeros = np.zeros((n, body.nv))
    motion = Motion(
        time=np.arange(n) * 1e-3, q=np.tile(q, (n, 1)), v=zeros, a=zeros, tau=zeros,
        com=np.tile(com, (n, 1)), angular_momentum=np.zeros((n, 3)), margin=np.zeros(n),
        support=np.ones((n, 2), dtype=bool), contact_force=np.zeros((n, 2, 6)),
        contact_names=schedule.sequence.effectors, joint_names=body.joint_names,
    )  # fmt: skip
    return body, motion, schedule


def disturbed_states(body, count=200):
    rng = np.random.default_rng(0)
    q, model = body.standing_posture(), body.pinocchio
    return [
        (pin.integrate(model, q, 1e-3 * rng.normal(size=body.nv)), 1e-2 * rng.normal(size=body.nv))
        for _ in range(count)
    ]


def test_control_step(benchmark, standing):
    body, motion, schedule = standing
    controller = Controller(body, motion, schedule)
    states = disturbed_states(body)
    number = iter(range(10**9))

    def step():
        k = next(number) % len(states)
        return controller.step(0.5 * k / len(states), *states[k])

    output = benchmark(step)
    assert not output.fallback


def test_program_alone(benchmark, standing):
    body, motion, schedule = standing
    controller = Controller(body, motion, schedule)
    programs = [controller.step(0.0, q, v).problem.program for q, v in disturbed_states(body)]
    solver = WarmQPSolver()
    number = iter(range(10**9))
    solution = benchmark(lambda: solver.solve(programs[next(number) % len(programs)]))
    assert solution.solved


@pytest.mark.benchmark(timer=time.process_time)
@pytest.mark.parametrize("world", ["as believed", "another"])
def test_execution_of_one_second(benchmark, standing, world):
    """Processor time of an execution with its measures, in the believed world and in one of the trials."""
    (body, motion, schedule), scene = standing, Scene()
    truth = None if world == "as believed" else Uncertainty().draw(body, scene, motion, 0)
    settings = None if truth is None else ControlSettings(returning=ReturnSettings())
    result = benchmark.pedantic(
        lambda: execute(body, scene, motion, schedule, settings=settings, hold=0.0, truth=truth),
        rounds=5, iterations=1,
    )  # fmt: skip
    assert not result.fell
    share = benchmark.stats.stats.median / (motion.duration + SETTLING)
    benchmark.extra_info["processor seconds per simulated second"] = round(share, 3)
