"""Hands that lean on their heels: the palm is not in what it lies on."""

import numpy as np
import pytest

from manikin.body import Configuration, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point, sole
from manikin.kinematics.posture_terms import SINKING
from manikin.planning.whole_body.certificate import deepest_point
from manikin.planning.whole_body.fit_targets import KeptDistances, ignored_pairs
from manikin.planning.whole_body.refine import RefineSettings, refine_motion
from manikin.planning.whole_body.refine_measures import RefineObstacles
from manikin.scene import Box, Obstacle, Proximity, Scene

BODY = human()
PALM = "left_hand/palm"
TIME = np.array([0.5, 1.2, 1.8, 2.5])  # [s]; the hand leans from 1 to 2 s
HELD = (TIME >= 1.0) & (TIME < 2.0)


def leaning(bend):
    """(nq,) a person whose forearms point ahead, wrists bent back by an angle [deg]."""
    angles = {"left_elbow_flexion": 90.0, "left_forearm_pronation": 80.0, "left_wrist_flexion": -bend}
    q = BODY.posture({name: np.radians(value) for name, value in angles.items()})
    q[2] -= Configuration(BODY, q).effector_placement("left_foot")[1][2]
    return q


def case(bend):
    """Distances along a motion that does not move, its schedule, and a scene with a table under the heel."""
    q = leaning(bend)
    heel = Configuration(BODY, q).effector_placement("left_wrist")[1].copy()
    table = Obstacle("table", Box((0.4, 0.4, 0.04)), translation=[heel[0] + 0.12, heel[1], heel[2] - 0.02])
    scene = Scene([table])
    feet = [
        sole(
            f"{side}_foot",
            Configuration(BODY, q).effector_placement(f"{side}_foot")[1],
            length=0.25,
            width=0.1,
            friction=0.7,
        )
        for side in ("left", "right")
    ]
    held = [feet, [*feet, point("left_wrist", heel, friction=0.7)], feet]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0)) for contacts in held])
    proximity = Proximity(BODY, scene)
    motion = proximity.along(np.tile(q, (len(TIME), 1)))
    return proximity, motion, ContactSchedule(sequence, np.arange(4.0)), scene


@pytest.mark.parametrize("bend", [0.0, -25.0])
def test_the_depth_of_a_palm_is_that_of_its_box(bend):
    """It counts while the heel carries alone; a palm bent into the table is in it by centimetres."""
    proximity, motion, schedule, scene = case(bend)
    points = KeptDistances.of_points(BODY, scene, schedule, TIME)
    depth, when, where = deepest_point(motion, points, TIME)["max_sinking_m"]
    found = proximity.evaluate(leaning(bend), 0.2)
    own = [
        float(one) for one, (shape, other) in zip(found.distance, found.pairs, strict=True)
        if shape in (PALM, "left_forearm/arm") and other == "table"
    ]  # fmt: skip
    assert depth == pytest.approx(max(0.0, -min(own)), abs=2e-5)
    if bend:
        assert depth > 0.02
        assert where == f"{PALM} and table"
        assert HELD[np.flatnonzero(when == TIME)].all()


def test_a_heel_that_carries_wants_the_palm_out_of_the_table():
    """In both kinds of fit; what may touch is the same, and nothing is wanted before and after."""
    proximity, _, schedule, scene = case(-25.0)
    q = np.tile(leaning(-25.0), (len(TIME), 1))
    refined = RefineObstacles(BODY, scene, schedule, TIME)
    for kept, ignored in (
        (KeptDistances.of(BODY, scene, schedule, TIME), ignored_pairs(BODY, scene, schedule, TIME)),
        (refined.points, refined.ignored),
    ):
        assert all(("left_hand", "table") in pairs for pairs, held in zip(ignored, HELD, strict=True) if held)
        counted = kept.without(ignored)
        assert not any(("left_hand", "table") in counted[row] for row in np.flatnonzero(HELD))
        found = proximity.evaluate_over(q, 0.1, counted)
        palm = np.array([pair == (PALM, "table") for pair in found.pairs]) & HELD[found.sample]
        assert np.count_nonzero(palm) == np.count_nonzero(HELD)
        np.testing.assert_allclose(kept.wanted(found, 0.02)[palm], SINKING)


def test_what_anything_may_lean_on_keeps_no_distance():
    _, motion, schedule, scene = case(-25.0)
    padded = frozenset((segment.name, "table") for segment in BODY.segments)
    points = KeptDistances.of_points(BODY, scene, schedule, TIME, padded)
    assert deepest_point(motion, points, TIME) == {}


def test_a_refined_motion_takes_the_palm_out_of_the_table():
    """The input has it 3 cm in; the wrist bends back, and no farther than it has to.

    A palm that had to keep the distance of everything else would be 2 cm above the table.
    """
    proximity, _, schedule, scene = case(-25.0)
    times = np.linspace(0.0, 3.0, 7)
    keys, held = np.tile(leaning(-25.0), (len(times), 1)), RefineSettings(contact_variables=False)
    result = refine_motion(BODY, scene, times, keys, schedule, settings=held)
    assert result.failure is None, result.failure
    assert result.certificate.value("max_sinking_m") <= 5e-3
    for q in result.motion.q[(result.motion.time > 1.2) & (result.motion.time < 1.8)][::20]:
        found = proximity.evaluate(q, 0.1)
        (palm,) = (d for d, pair in zip(found.distance, found.pairs, strict=True) if pair == (PALM, "table"))
        assert -5e-3 <= palm < 0.012


def test_the_deepest_of_several_counts_and_phases_join():
    """A heel that leans twice has one entry, held in both phases; of two hands the deeper one is told."""
    _, _, schedule, scene = case(-25.0)
    feet, leaning_too = (schedule.sequence[k].stance for k in (0, 1))
    heel = leaning_too["left_wrist"]
    place = Configuration(BODY, leaning(-25.0)).effector_placement("right_wrist")[1]
    right = point("right_wrist", place, friction=0.7)
    more = Scene(
        [scene["table"], Obstacle("desk", Box((0.1, 0.1, 0.04)), translation=[*place[:2], place[2] - 0.02])]
    )
    held = [[*feet, right], [*feet, right, heel], feet, [*feet, heel]]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0)) for contacts in held])
    twice, time = ContactSchedule(sequence, np.arange(5.0)), np.array([0.5, 1.5, 2.5, 3.5])
    points = KeptDistances.of_points(BODY, more, twice, time)
    rows = {next(iter(pairs))[1]: np.isfinite(wanted).tolist() for pairs, wanted in points.entries}
    assert rows == {"desk": [True, True, False, False], "table": [False, True, False, True]}
    along = Proximity(BODY, more).along(np.tile(leaning(-25.0), (4, 1)))
    depth, _, where = deepest_point(along, points, time)["max_sinking_m"]
    each = [deepest_point(along, KeptDistances((entry,)), time)["max_sinking_m"] for entry in points.entries]
    assert depth == max(row[0] for row in each) > min(row[0] for row in each) > 0.0
    assert where == max(each)[2]
