"""A standing body, its contacts and its plan."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.motion import Motion

FEET = ("left_foot", "right_foot")


@pytest.fixture(scope="session")
def body():
    return human()


@pytest.fixture(scope="session")
def contacts(body):
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, body.standing_posture())
    return tuple(
        sole(
            name, data.oMf[body.effector_frame(name)].translation, length=body.sole_length,
            width=body.sole_width, friction=0.7, normal_force_cap=1500.0,
        )
        for name in FEET
    )  # fmt: skip


@pytest.fixture(scope="session")
def schedule(contacts):
    return ContactSchedule(StanceSequence([Phase(Stance(contacts))]), [0.0, 1.0])


@pytest.fixture(scope="session")
def still(body, schedule):
    """A motion that stands still for one second."""
    n, q = 1001, body.standing_posture()
    com = pin.centerOfMass(body.pinocchio, body.pinocchio.createData(), q)
    zeros = np.zeros((n, body.nv))
    return Motion(
        time=np.arange(n) * 1e-3, q=np.tile(q, (n, 1)), v=zeros, a=zeros, tau=zeros,
        com=np.tile(com, (n, 1)), angular_momentum=np.zeros((n, 3)), margin=np.zeros(n),
        support=np.ones((n, 2), dtype=bool), contact_force=np.zeros((n, 2, 6)),
        contact_names=schedule.sequence.effectors, joint_names=body.joint_names,
    )  # fmt: skip
