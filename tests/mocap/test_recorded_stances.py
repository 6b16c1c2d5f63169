"""Stances of recorded people: of a body whose postures are known, and of real walks."""

import numpy as np
import pytest

from manikin.body import human
from manikin.body.configuration import Configuration
from manikin.mocap import Reconstruction, Targets
from manikin.mocap.recorded_stances import recorded_schedule
from manikin.mocap.recorded_supports import RecordedSupports, Support

RATE, FRAMES, START = 100.0, 101, 2.0


def standing(change=None):
    """Our human who stands for a second, heading along y, and how its hinges change."""
    body = human()
    q = np.tile(body.standing_posture(), (FRAMES, 1))
    q[:, 3:7] = [0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)]
    for name, angles in (change or {}).items():
        q[:, 7 + body.joint_index(name)] += angles
    targets = Targets((), (), np.zeros((0, 3)), np.zeros((FRAMES, 0, 3)), np.zeros(0))
    return Reconstruction(body, np.arange(FRAMES) / RATE, q, targets, np.zeros((FRAMES, 0)))


def foot(found, name, first, last, **seen):
    place = Configuration(found.body, found.q[0]).effector_position(name)
    place = np.array([place[0], place[1], 0.0])
    begin, end = START + first / RATE, START + last / RATE
    return Support(name, begin, end, place, place, place, seen.get("begins", True), seen.get("ends", True))


def test_a_stance_holds_while_its_supports_do():
    found = standing()
    both = (
        foot(found, "left_foot", 0, 60, begins=False),
        foot(found, "right_foot", 40, 100, ends=False),
    )
    schedule = recorded_schedule(found, RecordedSupports(both, START, START + 1.0, (0.0,)))
    np.testing.assert_allclose(schedule.instants, START + np.array([0.0, 0.4, 0.6, 1.0]), atol=1e-9)
    assert [phase.stance.effectors for phase in schedule.sequence] == [
        ("left_foot",), ("left_foot", "right_foot"), ("right_foot",)
    ]  # fmt: skip
    assert [phase.max_duration for phase in schedule.sequence] == pytest.approx([0.4, 0.2, 0.4])
    contact = schedule.sequence[1].stance["left_foot"]
    assert contact.yaw == pytest.approx(np.pi / 2, abs=1e-6)
    assert (contact.length, contact.width) == pytest.approx((found.body.sole_length, found.body.sole_width))
    np.testing.assert_allclose(contact.position[:2], both[0].place[:2], atol=1e-6)
