"""Motions that stand still in a posture, and what the tests of ergonomics share."""

import numpy as np
import pytest

from manikin.body import human
from manikin.motion import Motion

FEET = ("left_foot", "right_foot")


@pytest.fixture(scope="session")
def body():
    return human()


def still(body, q, *, duration=1.0, rate=20.0, tau=None, contacts=FEET, forces=None):
    """A motion that does not move.

    Args:
        body: The body.
        q: (nq,) or (n, nq).
        duration, rate: Of the samples [s], [Hz].
        tau: (nv,) or None for unknown torques.
        contacts: Effectors in contact.
        forces: Upward force by effector [N]; else the feet share the weight evenly.
    """
    time = np.linspace(0.0, duration, round(duration * rate) + 1)
    n = len(time)
    q = np.broadcast_to(q, (n, body.nq))
    zero = np.zeros((n, body.nv))
    torque = np.full_like(zero, np.nan) if tau is None else np.broadcast_to(tau, zero.shape)
    force = np.zeros((n, len(contacts), 6))
    given = dict.fromkeys(FEET, body.mass * 9.81 / 2.0) if forces is None else forces
    for column, name in enumerate(contacts):
        force[:, column, 2] = given.get(name, 0.0)
    return Motion(
        time=time, q=q, v=zero, a=zero, tau=torque, com=np.tile([0.0, 0.0, 0.95], (n, 1)),
        angular_momentum=np.zeros((n, 3)), margin=np.full(n, np.nan),
        support=np.ones((n, len(contacts)), dtype=bool), contact_force=force,
        contact_names=contacts, joint_names=body.joint_names,
    )  # fmt: skip


def posture(body, **angles):
    """(nq,) standing on the floor with angles [deg] on top of the zero posture."""
    q = body.posture({name: np.deg2rad(value) for name, value in angles.items()})
    q[2] = body.standing_posture()[2]
    return q


def mirrored(body, q):
    """(n, nq) the mirror image in the sagittal plane; equal angles of both sides mean mirrored postures."""
    q = np.array(q)
    found = q.copy()
    found[:, 1] *= -1.0
    found[:, [3, 5]] *= -1.0  # a turn about x or z changes its sense
    for name in body.joint_names:
        column = 7 + body.joint_index(name)
        side, _, rest = name.partition("_")
        if side in ("left", "right"):
            other = "right" if side == "left" else "left"
            found[:, column] = q[:, 7 + body.joint_index(f"{other}_{rest}")]
        elif not name.endswith("_flexion"):
            found[:, column] = -q[:, column]
    return found
