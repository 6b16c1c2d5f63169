"""A standing body, its contacts and its plan."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import Configuration, human, insect
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point, sole
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


def standing_still(body, schedule, q):
    """A motion that stays in a posture for one second."""
    n = 1001
    com = pin.centerOfMass(body.pinocchio, body.pinocchio.createData(), q)
    zeros, count = np.zeros((n, body.nv)), len(schedule.sequence.effectors)
    return Motion(
        time=np.arange(n) * 1e-3, q=np.tile(q, (n, 1)), v=zeros, a=zeros, tau=zeros,
        com=np.tile(com, (n, 1)), angular_momentum=np.zeros((n, 3)), margin=np.zeros(n),
        support=np.ones((n, count), dtype=bool), contact_force=np.zeros((n, count, 6)),
        contact_names=schedule.sequence.effectors, joint_names=body.joint_names,
    )  # fmt: skip


@pytest.fixture(scope="session")
def still(body, schedule):
    """A motion that stands still for one second."""
    return standing_still(body, schedule, body.standing_posture())


@pytest.fixture(scope="session")
def on_points():
    """An insect on the points of its six legs, its schedule and a motion that stands still."""
    body = insect()
    q = body.standing_posture()
    state = Configuration(body, q)
    contacts = [
        point(item.effector, state.effector_placement(item.effector)[1], friction=0.8) for item in body.limbs
    ]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(contacts))]), [0.0, 1.0])
    return body, schedule, standing_still(body, schedule, q)


@pytest.fixture(scope="session")
def on_three_points(body):
    """Schedule and motion of a body that stands still on points: of its feet, and of a wrist beside it."""
    q, names = body.standing_posture(), (*FEET, "left_wrist")
    state = Configuration(body, q)
    points = [point(name, state.effector_placement(name)[1], friction=0.7) for name in names]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(points))]), [0.0, 1.0])
    return schedule, standing_still(body, schedule, q)
