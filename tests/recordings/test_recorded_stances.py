"""Stances of a body whose postures and supports are known."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.body.anthropometry import TOE_HINGE_FROM_HEEL
from manikin.contact import ContactKind, SolePart
from manikin.errors import InputError
from manikin.kinematics import PointTargets
from manikin.recordings import Reconstruction, recorded_schedule
from manikin.recordings.supports.body_supports import RecordedSupports, Support
from manikin.recordings.supports.supports import sole_points

RATE, FRAMES, START = 100.0, 101, 2.0


def standing(change=None):
    """Our human who stands for a second, heading along y, and how hinges change."""
    body = human()
    q = np.tile(body.standing_posture(), (FRAMES, 1))
    q[:, 3:7] = [0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)]
    for name, angles in (change or {}).items():
        q[:, 7 + body.joint_index(name)] += angles
    targets = PointTargets(("hips",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    return Reconstruction(body, np.arange(FRAMES) / RATE, q, targets, np.zeros((FRAMES, 1)))


def support(name, first, last, place=(0.0, 0.0, 0.0), begins=True, ends=True):
    where = np.array(place)
    return Support(name, START + first / RATE, START + last / RATE, where, where, where, begins, ends)


def recorded(*supports):
    return RecordedSupports(supports, START, START + (FRAMES - 1) / RATE, (0.0,))


def test_a_stance_holds_while_its_supports_do():
    found = standing()
    both = (support("left_foot", 0, 60, begins=False), support("right_foot", 40, 100, ends=False))
    schedule = recorded_schedule(found, recorded(*both))
    np.testing.assert_allclose(schedule.instants, START + np.array([0.0, 0.4, 0.6, 1.0]), atol=1e-9)
    stances = [phase.stance for phase in schedule.sequence]
    assert [stance.effectors for stance in stances] == [
        ("left_foot",), ("left_foot", "right_foot"), ("right_foot",)
    ]  # fmt: skip
    assert [phase.max_duration for phase in schedule.sequence] == pytest.approx([0.4, 0.2, 0.4])
    contact = stances[1]["left_foot"]
    heel, toes = sole_points(found)["left_foot"]
    assert contact.yaw == pytest.approx(np.arctan2(*(toes - heel)[0, 1::-1]), abs=1e-9)
    assert (contact.length, contact.width) == pytest.approx((found.body.sole_length, found.body.sole_width))
    np.testing.assert_allclose(contact.position[:2], 0.5 * (heel + toes)[0, :2], atol=1e-9)
    assert contact.position[2] == 0.0
    assert contact.friction == 0.8


def test_a_flight_is_a_stance_without_contacts():
    schedule = recorded_schedule(standing(), recorded(support("left_foot", 0, 50, begins=False)))
    assert [len(phase.stance) for phase in schedule.sequence] == [1, 0]


def test_a_seat_is_as_large_as_what_presses_on_it_and_a_hand_grasps():
    found = standing()
    contacts = (
        support("buttocks", 0, 100, (0.0, 0.0, 0.45), begins=False, ends=False),
        support("left_hand", 0, 100, (0.3, 0.2, 1.0), begins=False, ends=False),
    )
    (phase,) = recorded_schedule(found, recorded(*contacts)).sequence
    seat, hand = phase.stance["buttocks"], phase.stance["left_hand"]
    assert (seat.length, seat.width) == pytest.approx((0.08 * 1.75, 0.14 * 1.75))
    assert seat.yaw == pytest.approx(np.pi / 2)
    assert hand.kind is ContactKind.GRASP
    np.testing.assert_allclose(hand.position, (0.3, 0.2, 1.0))


def test_a_lifted_heel_leaves_the_toes_and_lifted_toes_the_heel():
    # The ankle turns by 15 degrees: heel and toes of a stiff sole part by 7 cm.
    turn = np.deg2rad(15.0) * np.clip((np.arange(FRAMES) - 50.0) / 10.0, 0.0, 1.0)
    for sign, part in ((-1.0, SolePart.TOES), (1.0, SolePart.HEEL)):
        found = standing({"left_ankle_dorsiflexion": sign * turn})
        lowest = np.min([end[:, 2] for end in sole_points(found)["left_foot"]], axis=0)
        q = np.array(found.q)
        q[:, 2] -= lowest - lowest[0]
        found = replace(found, q=q)
        held = recorded(support("left_foot", 0, 100, begins=False, ends=False))
        schedule = recorded_schedule(found, held, rolling=True)
        flat, tilted = (phase.stance["left_foot"] for phase in schedule.sequence)
        assert (flat.part, tilted.part) == (SolePart.FULL, part)
        assert tilted.same_place(flat)
        front = (1.0 - TOE_HINGE_FROM_HEEL) if part is SolePart.TOES else 0.25
        assert tilted.length == pytest.approx(front * flat.length)
        assert len(recorded_schedule(found, held).sequence) == 1


def test_one_instant_is_refused():
    found = standing()
    one = Reconstruction(
        found.body, found.time[:1], found.q[:1],
        PointTargets(("hips",), ("pelvis",), np.zeros((1, 3)), found.q[:1, None, :3], np.ones(1)),
        np.zeros((1, 1)),
    )  # fmt: skip
    with pytest.raises(InputError, match="valid: at least two"):
        recorded_schedule(one, recorded())
