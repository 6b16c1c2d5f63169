"""Contact forces of a planned motion: what they supply, and what limits them."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from manikin.balance import motion_forces
from manikin.balance.motion_forces import TORQUE_SHARES, plan_forces
from manikin.body import human
from manikin.contact import ContactKind, ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.motion.dynamics import FreeDynamics
from manikin.numerics.spatial import GRAVITY_VECTOR

BODY = human()
FRICTION = 0.7
GRASP_FORCE = 400.0
ARMS = [
    BODY.joint_index(name) for name in BODY.joint_names if "shoulder" in name or "elbow" in name
]  # fmt: skip


def posture(arms=None):
    """Standing with the right arm raised to the front, or with other angles of the arms [rad]."""
    q = BODY.standing_posture().copy()
    q[7 + BODY.joint_index("right_shoulder_flexion")] = 1.4
    if arms is not None:
        q[7 + np.array(ARMS)] += arms
    return q


def held(q, effectors, grasp_force):
    """Contacts where the effectors are, for one second."""
    data = BODY.pinocchio.createData()
    pin.framesForwardKinematics(BODY.pinocchio, data, q)
    contacts = []
    for name in effectors:
        place = data.oMf[BODY.effector_frame(name)]
        if "hand" in name:
            contacts.append(grasp(name, place.translation, max_force=grasp_force))
        else:
            contacts.append(
                sole(name, place.translation, rotation=place.rotation, length=BODY.sole_length,
                     width=BODY.sole_width, friction=FRICTION)
            )  # fmt: skip
    return ContactSchedule(StanceSequence([Phase(Stance(contacts, 3000.0))]), [0.0, 1.0])


def shared(effectors, q, v, a, grasp_force=GRASP_FORCE):
    """Forces at one instant well inside the phase, and its contacts."""
    schedule = held(q, effectors, grasp_force)
    tau, forces = plan_forces(BODY, schedule, np.array([0.5]), q[None], v[None], a[None])
    missing = np.linalg.norm(tau[:, :6], axis=1)
    return SimpleNamespace(tau=tau, contact_force=forces, missing=missing), schedule.stance_at(0.5)


def accelerated(*linear):
    """(nv,) acceleration of the whole body along the world axes [m/s^2], which it stands upright in."""
    return np.concatenate([linear, np.zeros(BODY.nv - 3)])


def strain(found):
    """Largest use of a joint's strength."""
    return float(BODY.torque_share(found.tau[0, 6:]).max())


@pytest.mark.parametrize(
    ("effectors", "acceleration", "weakest"),
    [
        (("right_foot", "right_hand"), (-2.0, 1.0, 0.0), "right_knee_rotation"),
        (("left_foot", "right_foot", "right_hand"), (-3.0, -1.0, 0.0), "left_hip_flexion"),
    ],
)
def test_forces_are_shared_within_the_strength_of_the_joints(monkeypatch, effectors, acceleration, weakest):
    """The least forces overload a joint; shared otherwise, the same wrench leaves all a reserve."""
    q, still = posture(), np.zeros(BODY.nv)
    found, _ = shared(effectors, q, still, accelerated(*acceleration))
    monkeypatch.setattr(motion_forces, "_share_within_limits", lambda *_: None)
    least, _ = shared(effectors, q, still, accelerated(*acceleration))
    use = BODY.torque_share(least.tau[0, 6:])
    assert BODY.joint_names[int(np.argmax(use))] == weakest
    assert use.max() > 1.05
    assert strain(found) <= TORQUE_SHARES[0] + 1e-6
    # Both supply the wrench; the cost of the first leaves a thousandth of a newton.
    assert least.missing[0] < 2e-3
    assert found.missing[0] < 2e-3
    assert found.contact_force[0, :, :3].sum(axis=0) == pytest.approx(
        least.contact_force[0, :, :3].sum(axis=0), abs=2e-3
    )


def least_strain(schedule, q, a):
    """The least share of the strength with which contact forces can supply a motion, by a linear program."""
    stance = schedule.stance_at(0.5)
    generators = motion_forces._generators(BODY, stance, stance.effectors)
    dynamics = FreeDynamics.of(BODY, q[None], np.zeros((1, BODY.nv)), a[None])
    gives = motion_forces._joint_map(dynamics.jacobians[0], generators)
    needed, count = dynamics.needed[0], gives.shape[1]
    most = np.where(np.isfinite(generators.upper), generators.upper, None)
    return linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.block([
            [-gives[6:], -BODY.torque_upper[:, None]], [gives[6:], BODY.torque_lower[:, None]],
        ]),
        b_ub=np.concatenate([-needed[6:], needed[6:]]),
        A_eq=np.column_stack([gives[:6], np.zeros(6)]), b_eq=needed[:6],
        bounds=[*((0.0, limit) for limit in most), (0.0, None)],
    ).fun  # fmt: skip


@pytest.mark.parametrize("acceleration", [(-2.0, -1.0, 0.0), (-2.5, -1.5, 0.0), (-3.0, 1.0, 0.0)])
def test_a_wrench_that_overloads_a_joint_is_supplied_with_the_least_strain(acceleration):
    """Where every sharing overloads a joint, the shared forces ask for what a linear program finds least."""
    effectors, q, a = ("right_foot", "right_hand"), posture(), accelerated(*acceleration)
    found, _ = shared(effectors, q, np.zeros(BODY.nv), a)
    least = least_strain(held(q, effectors, GRASP_FORCE), q, a)
    assert least > 1.0
    assert strain(found) == pytest.approx(least, rel=1e-6)
    assert found.missing[0] < 1e-6


def test_a_wrench_beyond_the_limit_of_a_grasp_is_still_supplied():
    """Where no forces within the grasp's limit supply it, the least forces stay, and the torques tell."""
    found, _ = shared(
        ("right_foot", "right_hand"), posture(), np.zeros(BODY.nv), accelerated(-3.0, -2.0, 0.0)
    )
    assert strain(found) > 1.5
    assert found.missing[0] < 5e-3


@given(
    st.sampled_from((("left_foot", "right_foot"), ("left_foot", "right_foot", "right_hand"))),
    st.integers(0, 2**32 - 1),
    st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3.0, 3.0)),
)
def test_shared_forces_obey_newton_euler_and_coulomb(effectors, seed, linear):
    """The contacts give the rate of momentum; soles neither slip, lift nor tip; grasps keep their limit."""
    draw = np.random.default_rng(seed)
    q = posture(draw.uniform(-0.4, 0.4, len(ARMS)))
    v, a = np.zeros(BODY.nv), accelerated(*linear)
    v[6 + np.array(ARMS)] = draw.uniform(-1.0, 1.0, len(ARMS))
    a[6 + np.array(ARMS)] = draw.uniform(-2.0, 2.0, len(ARMS))
    found, stance = shared(effectors, q, v, a)

    data = BODY.pinocchio.createData()
    pin.computeCentroidalMomentumTimeVariation(BODY.pinocchio, data, q, v, a)
    force, moment = np.zeros(3), np.zeros(3)
    for contact, wrench in zip(stance, found.contact_force[0], strict=True):
        force += wrench[:3]
        moment += wrench[3:] + np.cross(contact.position - data.com[0], wrench[:3])
    # The wrench is missed by at most the cost of the forces: 1e-3 relative to 1e3 N, see _WRENCH_WEIGHT.
    assert force == pytest.approx(data.dhg.linear - BODY.mass * GRAVITY_VECTOR, abs=5e-3)
    assert moment == pytest.approx(data.dhg.angular, abs=5e-3)

    for contact, wrench in zip(stance, found.contact_force[0], strict=True):
        if contact.kind is ContactKind.GRASP:
            assert np.all(np.abs(wrench[:3]) <= GRASP_FORCE + 1e-6)
            assert wrench[3:] == pytest.approx(np.zeros(3), abs=1e-9)
            continue
        turn = contact.rotation_contact_to_world
        local, turning = turn.T @ wrench[:3], turn.T @ wrench[3:]
        normal = local[2]
        assert normal >= 0.0
        assert np.all(np.abs(local[:2]) <= FRICTION * normal + 1e-6)
        assert abs(turning[0]) <= 0.5 * BODY.sole_width * normal + 1e-6
        assert abs(turning[1]) <= 0.5 * BODY.sole_length * normal + 1e-6


def test_a_grasp_gives_no_more_than_it_may(monkeypatch):
    """The least forces ask a weak grasp for more than it holds; shared otherwise, they do not."""
    case = (
        ("left_foot", "right_foot", "right_hand"),
        posture(),
        np.zeros(BODY.nv),
        accelerated(-1.0, 0.0, 0.0),
    )
    found, _ = shared(*case, grasp_force=10.0)
    monkeypatch.setattr(motion_forces, "_share_within_limits", lambda *_: None)
    least, _ = shared(*case, grasp_force=10.0)
    assert np.abs(least.contact_force[0, 2, :3]).max() > 20.0
    assert np.abs(found.contact_force[0, 2, :3]).max() <= 10.0 + 1e-6
    assert found.missing[0] < 2e-3
