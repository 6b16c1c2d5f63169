"""Joint torques beyond the strength, as residuals of the whole-body fit."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.contact import sole
from manikin.motion.configuration_spline import StateSamples
from manikin.motion.file import read_motions
from manikin.numerics.spatial import skew
from manikin.planning.whole_body import plan_whole_body
from manikin.planning.whole_body.fit import SPARED, MotionFit
from manikin.planning.whole_body.fit_strength import HeldForces, compliance, excess_torque
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
    """Each foot pressed so that the root lacks nothing; changes are shared by forces at eight points."""
    model, data = body.pinocchio, body.pinocchio.createData()
    feet = ("left_foot", "right_foot")
    joints = tuple(model.frames[body.effector_frame(name)].parentJoint for name in feet)
    force = np.hstack([rng.uniform(-100, 100, (2, 2)), rng.uniform(200, 700, (2, 1))])
    point = np.array([[0.1, 0.2, 0.0], [0.0, -0.2, 0.0]])
    wrench = np.tile(np.hstack([force, np.cross(point, force)]), (len(states.q), 1, 1))
    corners = [[0.1, 0.05, 0.0], [0.1, -0.05, 0.0], [-0.1, 0.05, 0.0], [-0.1, -0.05, 0.0]]
    shape = {"length": 0.2, "width": 0.1, "friction": 0.8}
    contacts = [sole(name, at, **shape) for name, at in zip(feet, point, strict=True)]
    sharing = np.zeros((*wrench.shape, 6))
    for s, (q, v, a) in enumerate(zip(states.q, states.v, states.a, strict=True)):
        # Of a point with the load d in its contact, the wrench of a unit force, made longer by sqrt(d).
        load = np.linalg.norm(force, axis=1)
        unit = np.hstack([
            np.sqrt(d) * np.vstack([np.eye(3), skew(at + np.array(corner))])
            for d, at in zip(load, point, strict=True) for corner in corners
        ])  # fmt: skip
        by_point = np.linalg.lstsq(unit, np.eye(6), rcond=None)[0]
        sharing[s] = [unit[:, part] @ by_point[part] for part in (slice(0, 12), slice(12, 24))]
        give = [d * compliance(contact) for d, contact in zip(load, contacts, strict=True)]
        np.testing.assert_allclose(give @ np.linalg.inv(sum(give)), sharing[s], atol=1e-9)
        missing = pin.rnea(model, data, q, v, a, local_forces(body, q, wrench[s], joints))[:6]
        pin.forwardKinematics(model, data, q)
        wrench[s] += sharing[s] @ data.oMi[1].act(pin.Force(missing)).vector
    known = np.ones(len(states.q), dtype=bool)
    hinges = tuple(range(body.nv - 6))
    return HeldForces(joints, known, wrench, sharing, hinges, (body.pinocchio,) * len(known))


def jacobians_of(body, states):
    model, data = body.pinocchio, body.pinocchio.createData()
    return np.array([pin.computeJointJacobians(model, data, q) for q in states.q])


def required(body, held, s, forces, states):
    """(n, nv - 6) torque shares of states, with what the root lacks supplied by the contacts."""
    model, data = body.pinocchio, body.pinocchio.createData()
    shares = []
    for q, v, a in states:
        full = pin.rnea(model, data, q, v, a, forces)
        pin.computeJointJacobians(model, data, q)
        lacking = data.oMi[1].act(pin.Force(full[:6])).vector
        for joint, sharing in zip(held.joints, held.sharing[s], strict=True):
            jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.WORLD)
            full = full - jacobian.T @ sharing @ lacking
        np.testing.assert_allclose(full[:6], 0.0, atol=1e-7)
        shares.append(body.torque_share(full[6:]))
    return np.array(shares)


def local_forces(body, q, wrench, joints):
    data = body.pinocchio.createData()
    pin.forwardKinematics(body.pinocchio, data, q)
    forces = pin.StdVec_Force()
    forces.extend([pin.Force.Zero() for _ in range(body.pinocchio.njoints)])
    for joint, part in zip(joints, wrench, strict=True):
        forces[joint] += data.oMi[joint].actInv(pin.Force(part))
    return forces


def test_derivatives_are_those_of_inverse_dynamics_whose_root_lacks_nothing(body):
    """Central differences by posture and acceleration, at a wanted share below that of every active hinge."""
    rng = np.random.default_rng(5)
    states = states_of(body, rng)
    held = held_of(body, states, rng)
    excess = excess_torque(body, states, jacobians_of(body, states), held, wanted=0.05)
    model = body.pinocchio
    assert excess.value.shape[1] > 5
    for s in range(len(states.q)):
        q, v, a = states.q[s], states.v[s], states.a[s]
        forces = local_forces(body, q, held.wrench[s], held.joints)
        ahead, behind = (
            required(body, held, s, forces, [(pin.integrate(model, q, h * u), v, a) for u in np.eye(body.nv)])
            for h in (STEP, -STEP)
        )
        by_posture = (ahead - behind).T / (2 * STEP)
        at, more = required(body, held, s, forces, [(q, v, a), (q, v, a + np.eye(body.nv)[8])])
        for column in range(excess.value.shape[1]):
            value = excess.value[s, column]
            if value == 0.0:
                assert not np.any(excess.by_state[0][s, column])
                continue
            hinge = excess.hinges[column]
            assert value == pytest.approx(at[hinge] - 0.05, abs=1e-12)
            np.testing.assert_allclose(excess.by_state[0][s, column], by_posture[hinge], atol=1e-5)
            assert excess.by_state[2][s, column, 8] == pytest.approx((more - at)[hinge], abs=1e-9)


@pytest.mark.parametrize("loaded", [False, True])
def test_torques_with_a_motions_own_forces_are_the_motions(runs, loaded):
    """Torques are linear in the forces, so the planned ones come back; toes are left out.

    The planned forces leave the root up to 1e-4 N.m, which the contacts give here: 1e-6 of a strength.
    """
    load = "body.load={mass_kg: 6, hand: right, from_phase: 1, until_phase: 1}"
    result = runs.step((load, "execution=none")) if loaded else runs("platform")
    scenario = load_scenario(result.directory / "scenario.yaml")
    body = scenario.build_body()
    content = read_motions(result.directory / "motion.h5")
    motion, rows = content.planned, np.arange(0, len(content.planned.time), 47)
    states = StateSamples(motion.q[rows], motion.v[rows], motion.a[rows])
    held = HeldForces.of(body, content.schedule, motion.time[rows], states)
    excess = excess_torque(body, states, jacobians_of(body, states), held, wanted=0.0)
    share = np.maximum(body.torque_share(motion.tau[rows, 6:]), 0.0)
    assert len(excess.hinges) > 30
    np.testing.assert_allclose(excess.value, share[:, excess.hinges], atol=1e-6)


def test_at_a_touch_down_the_foot_that_lands_carries_nothing(runs):
    """The instant before asks for most, as one foot carries; a lift-off is on the stance after it."""
    result = runs("platform")
    body, content = load_scenario("platform").build_body(), read_motions(result.directory / "motion.h5")
    schedule, motion, names = content.schedule, content.planned, content.planned.contact_names
    rows = np.searchsorted(motion.time, schedule.instants[1:-1])
    states = StateSamples(motion.q[rows], motion.v[rows], motion.a[rows])
    held = HeldForces.of(body, schedule, schedule.instants[1:-1], states)
    pairs = zip(schedule.sequence.phases[:-1], schedule.sequence.phases[1:], strict=True)
    changed = 0
    for sample, (before, after) in enumerate(pairs):
        for column, name in enumerate(names):
            if (name in before.stance) != (name in after.stance):
                changed += 1
                assert not held.wrench[sample, column].any()
                assert not held.sharing[sample, column].any()
    assert changed >= 4


@pytest.mark.long
def test_the_first_fit_knows_the_strength(step_com, step_motion, flat_ground, monkeypatch):
    """Who is as weak as to need 1.25 of the strength for a step has one that keeps it after one fit."""
    needed, fits = step_motion.certificate.value("max_torque_share"), []
    solve = MotionFit.solve
    monkeypatch.setattr(MotionFit, "solve", lambda *args, **more: fits.append(1) or solve(*args, **more))
    weak = human(1.75, 79.0, "male", sole_length=0.28, sole_width=0.12, strength=needed / 1.25)
    result = plan_whole_body(weak, flat_ground, step_com, rng=np.random.default_rng(0))
    assert result.succeeded
    assert len(fits) == 1
    # Between the samples of the fit, and with forces shared anew, it is a little more.
    assert result.certificate.value("max_torque_share") < 0.85 + SPARED + 0.02
