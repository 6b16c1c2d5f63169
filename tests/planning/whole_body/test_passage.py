"""How low a motion takes the body, and how near its head comes to the scene."""

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.motion import Motion
from manikin.motion.passage import head_segments, measure_passage
from manikin.scene import Box, Obstacle, Scene

LEFT = sole("left_foot", (0.0, 0.1, 0.2), length=0.28, width=0.12, friction=0.7)
RIGHT = sole("right_foot", (0.3, -0.1, 0.5), length=0.28, width=0.12, friction=0.7)
HAND = grasp("left_hand", (0.3, 0.2, 0.1), max_force=30.0)
SEAT = sole("buttocks", (-0.3, 0.0, 0.4), length=0.14, width=0.24, friction=0.5, settle=0.5)


def schedule(*stances):
    """One second for each."""
    phases = [Phase(Stance(contacts, 1500.0)) for contacts in stances]
    return ContactSchedule(StanceSequence(phases), np.arange(len(phases) + 1.0))


def motion(body, q, time=(0.0, 1.0), com=0.9):
    """At rest in one configuration, with the CoM's heights that are given."""
    count = len(time)
    places = np.zeros((count, 3))
    places[:, 2] = com
    return Motion(
        time=np.array(time), q=np.tile(q, (count, 1)), v=np.zeros((count, body.nv)),
        a=np.zeros((count, body.nv)), tau=np.zeros((count, body.nv)), com=places,
        angular_momentum=np.zeros((count, 3)), margin=np.ones(count), support=np.ones((count, 1), dtype=bool),
        contact_force=np.zeros((count, 1, 6)), contact_names=("left_foot",), joint_names=body.joint_names,
    )  # fmt: skip


def slab(height, name="slab"):
    """A wide plate with its underside at a height [m]."""
    return Obstacle(name, Box((2.0, 2.0, 0.1)), translation=(0.0, 0.0, height + 0.05))


def clearance(body, q, *obstacles, padded=()):
    return measure_passage(body, Scene(obstacles), schedule([LEFT]), motion(body, q), padded).room


def test_the_head_is_what_lies_above_the_shoulders(person):
    assert head_segments(person) == ("head", "neck")


def test_the_head_is_as_far_from_a_ceiling_as_its_vertex(person):
    """The shape of the head ends within a centimetre of the vertex; the rest is exact."""
    q = person.standing_posture()
    near, far = (clearance(person, q, slab(height)) for height in (1.85, 2.0))
    assert near == pytest.approx(0.1, abs=0.01)
    assert far - near == pytest.approx(0.15, abs=2e-5)


def test_raised_arms_the_floor_and_what_is_padded_do_not_count(person):
    q = np.array(person.standing_posture())
    usual = clearance(person, q, slab(1.85))
    q[7 + person.joint_index("left_shoulder_flexion")] = np.pi
    assert clearance(person, q, slab(1.85)) == pytest.approx(usual, abs=2e-5)
    assert clearance(person, q, slab(1.85), slab(1.7, "cushion"), padded=["cushion"]) == pytest.approx(usual)
    assert clearance(person, q, slab(1.85), slab(1.7, "plate")) < 0.0
    assert clearance(person, q) is None


def test_the_lowest_com_is_measured_above_the_lowest_foot_and_before_sitting_down(person):
    times = np.array([0.5, 1.5, 2.5, 3.5])
    plan = schedule([LEFT, RIGHT], [RIGHT, HAND], [LEFT, RIGHT], [LEFT, RIGHT, SEAT])
    q = person.standing_posture()
    heights = {(1.1, 1.2, 1.0, 0.6): 0.7, (1.0, 1.4, 1.1, 0.6): 0.8, (1.5, 1.2, 1.5, 1.3): 0.7}
    for com, lowest in heights.items():
        found = measure_passage(person, Scene(), plan, motion(person, q, times, np.array(com)))
        assert found.com_lowest == pytest.approx(lowest)


def test_without_a_limb_in_contact_there_is_no_lowest_com(person):
    q = person.standing_posture()
    hanging = measure_passage(person, Scene(), schedule([HAND]), motion(person, q))
    assert hanging.summary() == {"lowest_com_m": None, "head_clearance_m": None}
