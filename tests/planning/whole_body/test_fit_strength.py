"""Joint torques beyond the strength, as residuals of the whole-body fit."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.motion.configuration_spline import StateSamples
from manikin.motion.file import read_motions
from manikin.planning.whole_body.fit_strength import HeldForces, excess_torque
from manikin.scenarios import load_scenario

STEP = 1e-6
"""Step of the differences [rad]: their error is about STEP^2 times the third derivative, far below 1e-5."""


@pytest.fixture(scope="module")
def body():
    return human(1.75, 79.0)


def states_of(body, rng, n=3):
    q = np.tile(body.standing_posture(), (n, 1))
    q[:, 7:] += 0.3 * rng.uniform(-1.0, 1.0, (n, body.nv - 6))
    v, a = rng.uniform(-1.0, 1.0, (2, n, body.nv))
    return StateSamples(q, v, 5.0 * a)


def held_of(body, states, rng):
    """Each foot pressed with up to the body's weight somewhere near it."""
    model = body.pinocchio
    joints = tuple(
        model.frames[body.effector_frame(name)].parentJoint for name in ("left_foot", "right_foot")
    )
    force = np.hstack([rng.uniform(-100, 100, (2, 2)), rng.uniform(200, 700, (2, 1))])
    point = np.array([[0.1, 0.2, 0.0], [0.0, -0.2, 0.0]])
    wrench = np.hstack([force, np.cross(point, force)])
    known = np.ones(len(states.q), dtype=bool)
    return HeldForces(
        joints,
        known,
        np.tile(wrench, (len(states.q), 1, 1)),
        tuple(range(body.nv - 6)),
        (body.pinocchio,) * len(known),
    )


def local_forces(body, q, wrench, joints):
    data = body.pinocchio.createData()
    pin.forwardKinematics(body.pinocchio, data, q)
    forces = pin.StdVec_Force()
    forces.extend([pin.Force.Zero() for _ in range(body.pinocchio.njoints)])
    for joint, part in zip(joints, wrench, strict=True):
        forces[joint] += data.oMi[joint].actInv(pin.Force(part))
    return forces


def test_derivatives_are_those_of_inverse_dynamics_with_the_forces_on_their_segments(body):
    """Central differences by posture and acceleration, at a wanted share below that of every active hinge."""
    rng = np.random.default_rng(5)
    states = states_of(body, rng)
    held = held_of(body, states, rng)
    excess = excess_torque(body, states, held, wanted=0.05)
    model, data = body.pinocchio, body.pinocchio.createData()
    assert excess.value.shape[1] > 5
    for s in range(len(states.q)):
        q, v, a = states.q[s], states.v[s], states.a[s]
        forces = local_forces(body, q, held.wrench[s], held.joints)
        share = np.array([
            [body.torque_share(pin.rnea(model, data, *moved, forces)[6:]) for moved in pair]
            for pair in (
                [(pin.integrate(model, q, sign * STEP * unit), v, a) for sign in (1, -1)]
                for unit in np.eye(body.nv)
            )
        ])  # fmt: skip
        by_posture = (share[:, 0] - share[:, 1]).T / (2 * STEP)
        at = body.torque_share(pin.rnea(model, data, q, v, a, forces)[6:])
        for column in range(excess.value.shape[1]):
            value = excess.value[s, column]
            if value == 0.0:
                assert not np.any(excess.by_posture[s, column])
                continue
            hinge = excess.hinges[column]
            assert value == pytest.approx(at[hinge] - 0.05, abs=1e-12)
            np.testing.assert_allclose(excess.by_posture[s, column], by_posture[hinge], atol=1e-5)
            more = pin.rnea(model, data, q, v, a + np.eye(body.nv)[8], forces)[6:]
            assert excess.by_acceleration[s, column, 8] == pytest.approx(
                (body.torque_share(more) - at)[hinge], abs=1e-9
            )


@pytest.mark.parametrize(
    "overrides", [(), ("body.load={mass_kg: 6, hand: right, from_phase: 1, until_phase: 4}",)]
)
def test_torques_with_a_motions_own_forces_are_the_motions(runs, overrides):
    """Torques are linear in the forces, so the planned ones come back to rounding; toes are left out."""
    result = runs("platform", overrides=overrides)
    scenario = load_scenario("platform", None, overrides)
    body = scenario.build_body()
    content = read_motions(result.directory / "motion.h5")
    motion, rows = content.planned, np.arange(0, len(content.planned.time), 97)
    held = HeldForces.of(body, content.schedule, motion, motion.time[rows])
    states = StateSamples(motion.q[rows], motion.v[rows], motion.a[rows])
    excess = excess_torque(body, states, held, wanted=0.0)
    share = np.maximum(body.torque_share(motion.tau[rows, 6:]), 0.0)
    assert len(excess.hinges) > 30
    np.testing.assert_allclose(excess.value, share[:, excess.hinges], atol=1e-9)
