"""One step of the recovery from a push; a whole recovery.

Run with ``pytest benchmarks/bench_push.py``; a step has 5 ms of simulated time to beat.
"""

import numpy as np
import pytest

from manikin.body import human, kudoh
from manikin.control.recovery import BalanceRecovery, FeltPush, Strategy
from manikin.control.recovery.standing import close_loop
from manikin.simulation import RecoveryTask, push_near_com, recover

BODIES = {"kudoh": kudoh, "human": human}


def pushed_states(body, controller, count=200):
    """States of the standing posture with the feet held and the centre of mass at 0.5 to 0.6 m/s forward."""
    rng = np.random.default_rng(0)
    q = body.standing_posture()
    state = controller._dynamics.evaluate(q, np.zeros(body.nv))
    basis = close_loop(state, controller.groups.feet, FeltPush.none(body.nv)).acceleration.matrix
    com = state.centroidal_map[:3] @ basis / body.mass
    found = []
    for _ in range(count):
        speed = [rng.uniform(0.5, 0.6), 0.05 * rng.normal(), 0.0]
        phi = np.linalg.lstsq(com, speed, rcond=None)[0]
        found.append((q, basis @ phi))
    return found


@pytest.mark.parametrize("name", BODIES)
def test_recovery_step(benchmark, name):
    body = BODIES[name]()
    controller = BalanceRecovery(body, body.standing_posture())
    states = pushed_states(body, controller)
    number = iter(range(10**9))

    def step():
        output = controller.step(*states[next(number) % len(states)])
        assert output.strategy is Strategy.PROGRAM

    benchmark(step)


def test_recovery(benchmark):
    body = kudoh()
    task = RecoveryTask((push_near_com(body, (250.0, 0.0, 0.0), 0.2, 0.1),))
    found = benchmark.pedantic(lambda: recover(body, task), rounds=3)
    assert found.recovered
