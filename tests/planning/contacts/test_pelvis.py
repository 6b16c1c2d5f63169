"""A pelvis that may touch is a limb like others, which no joint moves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human, limb_named, with_further_contacts
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import ContactKind
from manikin.errors import ScenarioError
from manikin.kinematics.efort import MOST_RATIO, Task, efort
from manikin.kinematics.limb_samples import sample_limbs
from manikin.motion.description import body_from, describe_body
from manikin.numerics.spatial import rotation_from_rpy
from manikin.planning.contacts import (
    ContactGenerator,
    ContactRules,
    Duration,
    Efort,
    Hindrance,
    Situation,
    StrongEfort,
    find_candidates,
)
from manikin.planning.contacts.contact_plan import footprint
from manikin.planning.guide import NO_MARGINS, Condition, ReachabilityChecker, abstraction_of
from manikin.scenarios import load_scenario
from manikin.scene import Box, Obstacle, Scene
from manikin.scene.surface_table import SurfaceTable

BODY = with_further_contacts(human(), ("pelvis",))
SAMPLES = sample_limbs(BODY, np.random.default_rng(0), 400)
UP = Task((0.0, 0.0, 1.0))
SEAT = 0.45


def bench(tilt=0.0):
    """A bench whose top is at the height of a seat at the origin, tilted about the y axis."""
    turn = rotation_from_rpy(0.0, tilt, 0.0)
    return Scene([Obstacle("bench", Box((0.6, 0.7, 0.4)), turn, [0.0, 0.0, SEAT] - 0.2 * turn[:, 2])])


def sitting(gap, at=(0.0, 0.0), pitch=0.0):
    """(nq,) a body whose buttocks are above the seat, thighs level."""
    bent = dict.fromkeys(("left_hip_flexion", "right_hip_flexion"), 1.57)
    q = BODY.posture({**BODY.standing_angles, **bent})
    q[3:7] = [0.0, np.sin(0.5 * pitch), 0.0, np.cos(0.5 * pitch)]
    place = Configuration(BODY, q).effector_placement("buttocks")[1]
    q[:3] += np.array([*at, SEAT + gap]) - place
    return q


@pytest.fixture(scope="module")
def generator():
    return ContactGenerator(BODY, bench(), SAMPLES)


@given(st.floats(-0.0015, 0.0295), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
def test_a_pelvis_that_the_root_brings_near_a_seat_touches_it(generator, gap, x, y):
    """The contact lies on the seat below the buttocks, has their patch, and nothing of the body has moved."""
    q = sitting(gap, (x, y))
    answer = generator.request(q, "pelvis", UP)
    assert answer.found, answer.message
    assert np.array_equal(answer.q, q)
    assert np.allclose(answer.contact.position, [x, y, SEAT], atol=1e-9)
    assert answer.contact.kind is ContactKind.SOLE
    assert answer.contact.effector == "buttocks"
    assert answer.gap == pytest.approx(abs(gap), abs=1e-9)
    corners = answer.contact.points[:, :2]
    assert np.ptp(corners, axis=0) == pytest.approx([SEAT_LENGTH * 1.75, SEAT_WIDTH * 1.75])


@pytest.mark.parametrize(
    ("q", "hindrance"),
    [
        (sitting(0.2), Hindrance.REACH),
        (sitting(0.02, (0.27, 0.0)), Hindrance.SURFACE),  # a part of the patch would hang over the edge
        (sitting(0.0, pitch=0.6), Hindrance.ALIGNMENT),  # no joint can lay it flat
        (sitting(-0.01), Hindrance.COLLISION),
    ],
)
def test_why_a_pelvis_has_no_contact(generator, q, hindrance):
    answer = generator.request(q, "pelvis", UP)
    assert not answer.found
    assert answer.failure is hindrance, answer.message


def test_a_pelvis_has_one_sample_and_a_limb_with_joints_as_many_as_asked_for():
    assert {name: len(item) for name, item in SAMPLES.items() if name != "pelvis"} == dict.fromkeys(
        ["left_arm", "right_arm", "left_leg", "right_leg"], 400
    )
    assert len(SAMPLES["pelvis"]) == 1
    assert SAMPLES["pelvis"].products.tolist() == np.zeros((1, 3, 3)).tolist()


def test_efort_of_what_needs_no_torque_orders_by_the_normal_alone_and_stays_finite():
    """With no joints J J^T is zero: more than any limb that works for it, and negative where it must pull."""
    normals = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    found = efort(np.zeros((4, 3, 3)), (0.0, 0.0, 1.0), normals)
    assert found == pytest.approx(MOST_RATIO * normals[:, 2])
    legs = efort(SAMPLES["left_leg"].products, (0.0, 0.0, 1.0), np.tile([0.0, 0.0, 1.0], (400, 1)))
    assert legs.max() < found[0]


def test_every_heuristic_scores_a_pelvis():
    """On a seat that leans, the sum of scores is a number; the duration ends where the root goes away."""
    scene = bench(tilt=0.1)
    limb = limb_named(BODY, "pelvis")
    q = sitting(0.0)
    situation = Situation.of(Configuration(BODY, q), limb, UP.direction)
    table = SurfaceTable(scene.surfaces)
    near = table.within_reach(situation.rotation, situation.origin, *SAMPLES["pelvis"].hull, 0.03)
    found = find_candidates(
        table, near, situation, SAMPLES["pelvis"], tolerance=0.03, max_tilt=0.5,
        footprint=footprint(BODY, limb, ContactKind.SOLE),
    )  # fmt: skip
    assert len(found) == 1
    assert Efort().score(situation, found) == pytest.approx(MOST_RATIO * np.cos(0.1))
    strong = StrongEfort.of(BODY, SAMPLES).score(situation, found)
    assert np.isfinite(strong).all()
    turn, place = situation.state.segment_placement("pelvis")
    ahead = [(turn, place), (turn, place + np.array([0.0, 0.0, 0.5]))]
    assert Duration(SAMPLES["pelvis"].reach, ahead).score(situation, found) == pytest.approx([0.5])


def test_the_front_of_a_sole_is_no_matter_of_the_pelvis():
    rules = ContactRules(patch=(0.0, 0.1, 0.08))
    pelvis, leg = limb_named(BODY, "pelvis"), limb_named(BODY, "left_leg")
    whole = footprint(BODY, pelvis, ContactKind.SOLE)
    assert np.array_equal(footprint(BODY, pelvis, ContactKind.SOLE, rules), whole)
    assert not np.array_equal(
        footprint(BODY, leg, ContactKind.SOLE, rules), footprint(BODY, leg, ContactKind.SOLE)
    )


def test_the_abstraction_brings_a_pelvis_to_a_seat_and_keeps_the_trunk():
    """A pose reaches with the pelvis exactly where the seat is within 3 cm of the buttocks."""
    volumes = [SAMPLES[name].reach for name in ("left_leg", "pelvis")]
    abstraction = abstraction_of(BODY, volumes)
    names = {shape.name.split("/")[0] for shape in abstraction.trunk}
    assert {"pelvis", "lumbar", "thorax"} <= names
    checker = ReachabilityChecker(abstraction, bench(), Condition.limbs("pelvis"), NO_MARGINS)
    assert checker.limbs_reach(sitting(0.029)[:7])
    assert not checker.limbs_reach(sitting(0.031)[:7])


def test_a_description_of_a_body_keeps_the_patch_and_those_without_stay_what_they_were():
    again = body_from(describe_body(BODY))
    assert again.limbs == BODY.limbs
    assert describe_body(again) == describe_body(BODY)
    assert all("patch_m" not in limb for limb in describe_body(human())["limbs"])


def test_a_scenario_names_the_further_contacts_of_its_person(tmp_path):
    chair = load_scenario("stand-up-chair", overrides=["body.further_contacts=[pelvis, knees]"])
    names = [limb.name for limb in chair.build_body().limbs]
    assert names[4:] == ["left_knee", "right_knee", "pelvis"]
    assert len(load_scenario("stand-up-chair").build_body().limbs) == 4
    with pytest.raises(ScenarioError, match="further_contacts"):
        load_scenario("stand-up-chair", overrides=["body.further_contacts=[nose]"])
    (tmp_path / "again.yaml").write_text(chair.to_yaml())
    again = load_scenario(tmp_path / "again.yaml").build_body()
    assert describe_body(again) == describe_body(chair.build_body())
