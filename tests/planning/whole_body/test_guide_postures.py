"""Guide postures: natural where they can be, beside what the feet stand at, and on one side of obstacles."""

import importlib

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.kinematics import PostureProblem, PostureResult, SolverSettings
from manikin.numerics.spatial import rotation_from_quaternion
from manikin.planning.whole_body.fit_targets import effector_targets, ignored_pairs
from manikin.planning.whole_body.posture_style import FAR, READY, plan_guide
from manikin.scene import Box, Obstacle, Proximity, Scene

posture_style = importlib.import_module("manikin.planning.whole_body.posture_style")
SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}


def guide(person, scene, references, exact=()):
    """Postures of somebody who stands for a second, 2 cm lower than preferred."""
    feet = [sole(f"{side}_foot", (0.0, y, 0.0), **SIZE) for side, y in (("left", 0.1), ("right", -0.1))]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(feet, 1500.0), 0.5, 1.2)]), [0.0, 1.0])
    time = np.linspace(0.0, 1.0, len(references))
    com = Configuration(person, READY.posture(person)).com - [0.0, 0.0, 0.02]
    return plan_guide(
        person, Proximity(person, scene), schedule, time, effector_targets(schedule, (), time),
        np.tile(com, (len(time), 1)), ignored_pairs(person, scene, schedule, time), np.array(references),
        0.028, READY, exact, False,
    )  # fmt: skip


def test_feet_close_to_a_riser_leave_the_body_upright(person):
    """Toes stand 18 mm from it; no posture makes that the 28 mm that guide postures keep."""
    riser = Obstacle("riser", Box((0.5, 2.0, 0.2)), translation=(0.14 + 0.018 + 0.25, 0.0, 0.1))
    found = guide(person, Scene([riser]), [READY.posture(person)] * 3)
    assert found.failures == ()
    upright = rotation_from_quaternion(found.configurations[:, 3:7])[:, 2, 2]
    assert upright.min() > np.cos(np.radians(10.0))


def test_an_arm_above_a_board_does_not_go_through_it(person):
    """The preferred arm hangs below; on the way there from above is the board."""
    hanging, raised = READY.posture(person), READY.posture(person)
    abduction = 7 + person.joint_index("left_shoulder_abduction")
    raised[abduction] = np.radians(85.0)
    shoulder = Configuration(person, hanging).segment_placement("left_upper_arm")[1]
    place = (0.0, shoulder[1] + 0.35, shoulder[2] - 0.1)
    board = Obstacle("board", Box((0.8, 0.5, 0.02)), translation=place)
    found = guide(person, Scene([board]), [raised, hanging, hanging])
    assert found.failures == ()
    for q in found.configurations:
        _, hand = Configuration(person, q).segment_placement("left_hand")
        assert hand[2] > place[2]


def test_toes_that_follow_their_roll_make_no_posture_far_from_the_one_before(person, monkeypatch):
    """Each posture is found at once, although toes turn by twenty of their scales from one to the next."""
    searches, generate = [], posture_style.generate_posture

    def counted(problem, start, **options):
        searches.append(start)
        return generate(problem, start, **options)

    monkeypatch.setattr(posture_style, "generate_posture", counted)
    toes = [person.joint_index("right_toe_extension")]
    references = [READY.posture(person) for _ in range(3)]
    for extension, reference in zip((0.0, 0.2, 0.4), references, strict=True):
        reference[7 + toes[0]] = extension
    found = guide(person, Scene(), references, toes)
    assert found.failures == ()
    assert len(searches) == len(references)


@pytest.fixture
def answers(monkeypatch):
    """Postures that the search finds, by the clearance that is asked for and the x that it starts with."""
    known = {}

    def answer(problem, start, **_):
        q, succeeded = known[problem.clearance, start[0]]
        return PostureResult(succeeded, q, 0.0, 0.0, (), 1)

    monkeypatch.setattr(posture_style, "generate_posture", answer)
    return known


def test_of_a_bent_and_an_upright_posture_the_upright_one_is_taken(person, answers):
    """From the posture before, the trunk stays bent; from the preferred one it is not."""
    upright = READY.posture(person)
    bent, preferred = np.array(upright), np.array(upright)
    bent[7 + person.joint_index("lumbar_flexion")] = 1.2 * FAR * 0.35
    preferred[0] = 1.0  # where a search starts is told by its x
    proximity = Proximity(person, Scene())
    ways = [
        PostureProblem(person, (), proximity=proximity, clearance=distance) for distance in (0.028, 0.014)
    ]
    before, at_first, from_preferred = np.array(upright), (0.028, 0.0), (0.028, 1.0)
    for found, expected in (
        ({at_first: (bent, True), from_preferred: (upright, True)}, upright),
        ({at_first: (upright, True)}, upright),  # is near: nothing else is tried
        ({at_first: (bent, False), from_preferred: (bent, False), (0.014, 0.0): (upright, True)}, upright),
        (dict.fromkeys([at_first, from_preferred, (0.014, 0.0)], (bent, False))
         | {(0.014, 1.0): (bent, True)}, bent),
    ):  # fmt: skip
        answers.clear()
        answers.update(found)
        result = posture_style._guide_posture(ways, before, SolverSettings(), preferred, READY)
        assert result.succeeded
        np.testing.assert_array_equal(result.q, expected)
