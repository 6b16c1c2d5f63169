"""A box of 10 kg against one of 40 kg: margin, torques, low back and scores change as statics demands."""

from types import SimpleNamespace

import numpy as np
import pytest

from manikin.balance.motion_forces import carried_motion
from manikin.body import Configuration, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.ergonomics import Circumstances, ergonomics_of
from manikin.motion.motion import effector_positions
from manikin.numerics.spatial import GRAVITY

from .conftest import FEET, posture, still

ELBOWS = {f"{side}_elbow_flexion": 90.0 for side in ("left", "right")}
LOADS = (0.0, 10.0, 40.0)


@pytest.fixture(scope="module")
def held():
    """The same standing posture, forearms forward, with nothing, 10 kg and 40 kg in the hands."""
    body = human()
    motion = still(body, posture(body, **ELBOWS), duration=0.2, rate=10.0)
    places = effector_positions(body, motion, FEET)
    soles = [
        sole(name, places[name][0], length=body.sole_length, width=body.sole_width, friction=0.8)
        for name in FEET
    ]
    schedule = ContactSchedule(StanceSequence((Phase(Stance(tuple(soles))),)), (0.0, 0.2))
    found = {}
    for load in LOADS:
        carrier, carried = carried_motion(body, motion, schedule, load)
        given = Circumstances(load_kg=load)
        report = ergonomics_of(carrier, carried, schedule=schedule, given=given)
        found[load] = SimpleNamespace(body=carrier, motion=carried, report=report)
    return found


def differences(held, value):
    """What 10 kg and 40 kg add to a value."""
    none, ten, forty = (value(held[load]) for load in LOADS)
    return ten - none, forty - none


def test_the_feet_bear_the_box(held):
    def weight(one):
        return one.motion.contact_force[0, :, 2].sum()

    assert differences(held, weight) == pytest.approx((10.0 * GRAVITY, 40.0 * GRAVITY))


def test_the_centre_of_mass_moves_to_the_box(held):
    """By the box's share of the mass of both, times its distance."""
    body = held[0.0].body
    hands = effector_positions(body, held[0.0].motion, ("left_hand", "right_hand"))
    before = held[0.0].motion.com[0]
    away = np.mean([place[0] for place in hands.values()], axis=0) - before
    for load in LOADS[1:]:
        share = load / (body.mass + load)
        assert held[load].motion.com[0] == pytest.approx(before + share * away, abs=1e-9)


@pytest.mark.parametrize("joint", ["elbow_flexion", "shoulder_flexion", "lumbar_flexion"])
def test_torques_grow_with_the_weight_times_its_lever(held, joint):
    """In proportion to the mass of the box; at the elbow half of the box on the forearm's lever."""
    body = held[0.0].body
    name = joint if joint.startswith("lumbar") else f"left_{joint}"
    column = 6 + body.joint_index(name)
    ten, forty = differences(held, lambda one: one.motion.tau[0, column])
    assert forty == pytest.approx(4.0 * ten, rel=1e-6)
    if joint == "elbow_flexion":
        there = Configuration(body, held[0.0].motion.q[0])
        lever = there.effector_placement("left_hand")[1][0] - there.segment_placement("left_forearm")[1][0]
        assert abs(ten) == pytest.approx(5.0 * GRAVITY * lever, rel=1e-3)


@pytest.mark.parametrize(("load", "edge"), [(0.0, "rear"), (10.0, "rear"), (40.0, "front")])
def test_the_margin_is_that_of_tipping_over_the_nearer_edge(held, load, edge):
    """It is m g d / sqrt(1 + d^2 + h^2), with the distance d and the height h of the CoM from the edge.

    10 kg bring the centre of mass from the heels to the middle of the feet, 40 kg on to the toes: the edge
    that the body would tip over changes.
    """
    one = held[load]
    com, sole = one.motion.com[0], effector_positions(one.body, one.motion, FEET)["left_foot"][0]
    toe = sole[0] + 0.5 * one.body.sole_length
    distance = toe - com[0] if edge == "front" else com[0] - (toe - one.body.sole_length)
    height = com[2] - sole[2]
    margin = one.body.mass * GRAVITY * distance / np.sqrt(1.0 + distance**2 + height**2)
    assert one.report.margin.value == pytest.approx(margin, rel=1e-6)
    assert f"{edge} edge" in one.report.margin.limiting.description


def test_the_low_back_bears_four_times_as_much_more(held):
    for name in ("flexion_moment", "compression", "shear"):
        ten, forty = differences(held, lambda one, name=name: getattr(one.report.loads.low_back, name)[0])
        assert ten > 0.0
        assert forty == pytest.approx(4.0 * ten, rel=1e-9)


def test_scores_and_strength_follow(held):
    """RULA, REBA and OWAS by the kilograms of their tables; fewer people have the strength."""
    none, ten, forty = (held[load].report for load in LOADS)
    assert none.posture.rula.score[0] < ten.posture.rula.score[0] <= forty.posture.rula.score[0]
    assert none.posture.reba.score[0] <= ten.posture.reba.score[0] < forty.posture.reba.score[0]
    assert [one.loads.owas.code(0)[-1] for one in (none, ten, forty)] == ["1", "1", "3"]
    for sex in ("male", "female"):
        shares = [one.loads.capable[sex].weakest[1] for one in (none, ten, forty)]
        assert shares[0] > shares[1] > shares[2]
    assert none.strength.peak.max() < ten.strength.peak.max() < forty.strength.peak.max()
    assert forty.as_dict()["low_back"]["level"] == "above the action limit"
