"""A motion made with a load in the hands."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.balance import wrench_polytope
from manikin.balance.motion_forces import carried_motion, full_motion, plan_forces
from manikin.body import Configuration, carrying, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY

LOAD = 8.0
BODY = human()


@pytest.fixture(scope="module")
def standing():
    """Ten milliseconds of standing on both feet, the right forearm held forward, and its contacts."""
    q = BODY.standing_posture().copy()
    q[7 + BODY.joint_index("right_elbow_flexion")] = np.deg2rad(90.0)
    state = Configuration(BODY, q)
    contacts = [
        sole(name, state.effector_placement(name)[1], length=0.28, width=0.12, friction=0.7)
        for name in ("left_foot", "right_foot")
    ]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(contacts, 3000.0))]), [0.0, 0.01])
    time = np.array([0.0, 0.005, 0.01])
    rows, still = np.tile(q, (3, 1)), np.zeros((3, BODY.nv))
    polytope = wrench_polytope(schedule.sequence[0].stance, reference=np.zeros(3))
    motion, _ = full_motion(BODY, schedule, [polytope], time, rows, still, still)
    return schedule, motion


def test_standing_with_a_load_changes_everything_in_closed_form(standing):
    """The right hand's load shifts the centre of mass and loads feet, elbow, shoulder and margin."""
    schedule, motion = standing
    loaded, found = carried_motion(BODY, motion, schedule, LOAD, "right")
    q = motion.q[0]
    _, hand = Configuration(BODY, q).effector_placement("right_hand")
    com = (BODY.mass * motion.com[0] + LOAD * hand) / (BODY.mass + LOAD)
    np.testing.assert_allclose(found.com[0], com, atol=1e-12)
    weight = (BODY.mass + LOAD) * GRAVITY
    # Sharing leaves a thousandth of a newton per kilonewton.
    np.testing.assert_allclose(found.contact_force[0, :, 2].sum(), weight, rtol=1e-5)
    state = Configuration(BODY, q)
    jacobian = state.point_jacobian("right_hand", BODY.effector("right_hand").translation)
    bare = jacobian.T @ np.array([0.0, 0.0, LOAD * GRAVITY])
    for name in ("right_elbow_flexion", "right_shoulder_flexion", "right_wrist_radial_deviation"):
        index = 6 + BODY.joint_index(name)
        change = found.tau[0, index] - motion.tau[0, index]
        assert change == pytest.approx(bare[index], abs=1e-9)
        assert abs(change) > 1.0
    # Torques of the arm do not depend on how the ground shares the load: the arm hangs on the trunk alone.
    other = 6 + BODY.joint_index("left_elbow_flexion")
    assert found.tau[0, other] == pytest.approx(motion.tau[0, other], abs=1e-9)
    stance = schedule.sequence[0].stance
    wrench = np.concatenate([[0.0, 0.0, weight], np.cross(com, [0.0, 0.0, weight])])
    polytope = wrench_polytope(stance, reference=com)
    about = np.concatenate([wrench[:3], np.zeros(3)])
    assert found.margin[0] == pytest.approx(float(polytope.margin(about)), abs=1e-6)
    assert loaded.loads == {"right_hand": LOAD}


def test_the_load_is_in_the_torques_of_the_legs_too(standing):
    """Forces of the loaded body balance it: nothing is left at the root."""
    schedule, motion = standing
    loaded, found = carried_motion(BODY, motion, schedule, LOAD, "both")
    tau, _ = plan_forces(carrying(BODY, LOAD), schedule, motion.time, motion.q, motion.v, motion.a)
    np.testing.assert_array_equal(found.tau, tau)
    assert np.linalg.norm(tau[:, :6], axis=1).max() < 2e-2
    gravity = pin.computeGeneralizedGravity(loaded.pinocchio, loaded.pinocchio.createData(), motion.q[0])
    assert gravity[2] == pytest.approx((BODY.mass + LOAD) * GRAVITY)


def test_a_motion_that_carries_already_takes_no_second_load(standing):
    schedule, motion = standing
    with pytest.raises(InputError, match="8 kg"):
        carried_motion(carrying(BODY, LOAD), motion, schedule, 1.0)
