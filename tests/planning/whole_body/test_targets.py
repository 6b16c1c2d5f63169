"""What a motion has to do at each time, and what it may touch meanwhile."""

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point, sole
from manikin.planning.whole_body.fit_objective import LEAST_ROLL, _effector_rows
from manikin.planning.whole_body.fit_scales import FitScales
from manikin.planning.whole_body.fit_targets import (
    FLIGHT_POSITION_WEIGHT,
    FLIGHT_ROTATION_WEIGHT,
    LEAVING_RAMP,
    LOW,
    POINT_ROTATION_WEIGHT,
    POSITION_RAMP,
    ROTATION_RAMP,
    STRAIGHT,
    STRAIGHTENING,
    TOUCHING,
    EffectorTarget,
    KeptDistances,
    effector_targets,
    flat_share,
    ignored_pairs,
)
from manikin.planning.whole_body.sliding_touchdown import SITTING_DOWN
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import Pose
from manikin.planning.whole_body.swing_planner import PlannedSwing
from manikin.scene import Box, Obstacle, Scene
from manikin.scene.distance import ProximitySamples

BODY = human()
SIZE = {"length": 0.26, "width": 0.1, "friction": 0.7}
LEFT = sole("left_foot", (0.0, 0.1, 0.0), **SIZE)
RIGHT = sole("right_foot", (0.0, -0.1, 0.0), **SIZE)
ON_STEP = sole("right_foot", (0.5, -0.1, 0.2), **SIZE)
SEAT = sole("buttocks", (0.2, 0.4, 0.5), length=0.14, width=0.24, friction=0.4, settle=0.5)
SCENE = Scene(
    [
        Obstacle("step", Box((0.4, 0.4, 0.2)), translation=(0.5, -0.1, 0.1)),
        Obstacle("seat", Box((0.5, 0.4, 0.1)), translation=(0.2, 0.4, 0.45)),
        Obstacle("post", Box((0.1, 0.1, 2.0)), translation=(1.5, 0.0, 1.0)),
    ]
)
LIFT, LAND, SIT, END = 0.5, 2.0, 3.0, 4.0
SCHEDULE = ContactSchedule(
    StanceSequence(
        [
            Phase(Stance(held, 2000.0))
            for held in ([LEFT, RIGHT], [LEFT], [LEFT, ON_STEP], [LEFT, ON_STEP, SEAT])
        ]
    ),
    [0.0, LIFT, LAND, SIT, END],
)


def touchable(time):
    """Obstacle by segment that may touch it at one time."""
    (pairs,) = ignored_pairs(BODY, SCENE, SCHEDULE, np.array([time]))
    found = {}
    for segment, obstacle in pairs:
        found.setdefault(obstacle, set()).add(segment)
    return found


def flight_weights(duration, elapsed):
    """Importance of position and orientation at times after the lift-off of a flight."""
    start, end = LIFT, LIFT + duration
    schedule = ContactSchedule(StanceSequence(SCHEDULE.sequence.phases[:3]), [0.0, start, end, end + 1.0])
    (swing,) = [s for s in schedule.sequence.swings() if s.effector == "right_foot"]
    poses = [Pose(c.position, c.rotation_contact_to_world) for c in (RIGHT, ON_STEP)]
    curve = SwingCurve.lift(*poses, start, end)
    planned = PlannedSwing(swing, curve, "smooth")
    target = effector_targets(schedule, [planned], start + np.asarray(elapsed))["right_foot"]
    return target.weight, target.rotation_weight


@pytest.mark.parametrize("time", [LIFT, LIFT + 0.02, 1.2, LAND - 0.02])
def test_a_foot_may_touch_what_it_leaves_and_what_it_steps_on_during_its_whole_flight(time):
    """However long the flight is: a foot rolls off, drags or scuffs where its contacts are."""
    found = touchable(time)
    assert {"right_foot", "right_toes"} <= found["floor"]
    assert found["step"] == {"right_foot", "right_toes"}


def test_before_and_after_its_flight_a_foot_may_touch_its_support_alone():
    assert "step" not in touchable(LIFT - 1e-6)
    after = touchable(LAND)
    assert after["step"] == {"right_foot", "right_toes"}
    assert after["floor"] == {"left_foot", "left_toes"}


@pytest.mark.parametrize(
    ("time", "near"),
    [
        (0.0, False),
        (SIT - SITTING_DOWN - 1e-6, False),
        (SIT - SITTING_DOWN, True),
        (SIT - 1e-6, True),
        (END, True),
    ],
)
def test_the_trunk_may_come_close_to_the_seat_only_just_before_it_sits_down(time, near):
    """It is above the seat for most of its long flight and must not sink into it."""
    assert ("seat" in touchable(time)) is near


def test_nobody_may_touch_what_is_no_support():
    pairs = ignored_pairs(BODY, SCENE, SCHEDULE, np.linspace(0.0, END, 200))
    assert not any(obstacle == "post" for found in pairs for _, obstacle in found)
    limbs = {segment for found in pairs for segment, _ in found}
    assert not any("hand" in name or "leg" in name for name in limbs)


@pytest.mark.parametrize("duration", [1.5, 4.0])
def test_a_long_flight_is_bound_to_its_contacts_only_near_them(duration):
    """A fifth of a second, and for the orientation after the lift-off less: the foot may roll off at once."""
    elapsed = np.linspace(POSITION_RAMP, duration - POSITION_RAMP, 20)
    assert flight_weights(duration, elapsed)[0] == pytest.approx(np.full(20, FLIGHT_POSITION_WEIGHT))
    elapsed = np.linspace(LEAVING_RAMP, duration - ROTATION_RAMP, 20)
    assert flight_weights(duration, elapsed)[1] == pytest.approx(np.full(20, FLIGHT_ROTATION_WEIGHT))
    near = [0.25 * LEAVING_RAMP, duration - 0.25 * ROTATION_RAMP]
    assert all(np.all(weight > 0.8) for weight in flight_weights(duration, near))


def test_a_short_flight_is_bound_to_its_contacts_for_a_quarter_at_each_end():
    duration = 0.6
    position, rotation = flight_weights(
        duration, [0.1 * duration, 0.25 * duration, 0.75 * duration, 0.9 * duration]
    )
    assert position[1:3] == pytest.approx([FLIGHT_POSITION_WEIGHT] * 2)
    assert rotation[1:3] == pytest.approx([FLIGHT_ROTATION_WEIGHT] * 2)
    assert position[0] == pytest.approx(position[3])
    assert rotation[0] == pytest.approx(rotation[3])
    assert 0.5 < position[0] < 1.0


def test_toes_are_straight_while_their_sole_is_held_and_free_in_the_middle_of_a_flight():
    toe = BODY.joint_index("right_toe_extension")
    straight = LAND - STRAIGHT
    becoming = straight - 0.5 * STRAIGHTENING
    time = np.array([0.0, LIFT, LIFT + 0.5 * STRAIGHT, 0.5 * (LIFT + LAND), becoming, straight, LAND, END])
    share = flat_share(BODY, SCHEDULE, time)
    np.testing.assert_allclose(share[toe], [1.0, 1.0, 0.5, 0.0, 0.5, 1.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_array_equal(share[BODY.joint_index("left_toe_extension")], 1.0)


def test_a_contact_counts_to_its_last_instant():
    """A seat that is left for good holds until it is left: there is no flight that would say so."""
    sitting = StanceSequence(
        [Phase(Stance([LEFT, RIGHT, SEAT], 2000.0)), Phase(Stance([LEFT, RIGHT], 2000.0))]
    )
    schedule = ContactSchedule(sitting, [0.0, 1.0, 2.0])
    target = effector_targets(schedule, (), np.array([0.9, 1.0, 1.1]))["buttocks"]
    assert target.weight.tolist() == [1.0, 1.0, 0.0]
    np.testing.assert_array_equal(target.position[1], SEAT.position)


def test_a_seat_rolls_forward_freely_and_never_back():
    """The certificate counts a turn back from where a rolling contact lies; the fit has to see it."""
    pitch = np.array([-0.01, 0.0, 0.3])
    target = EffectorTarget.free(3)
    target.pivot[:] = 0.07, 0.0, 0.05
    target.weight[:] = 1.0
    place = np.tile(np.eye(4), (3, 1, 1))
    place[:, 0, 0] = place[:, 2, 2] = np.cos(pitch)
    place[:, 0, 2], place[:, 2, 0] = np.sin(pitch), -np.sin(pitch)
    turn_rate = np.tile(np.eye(6), (3, 1, 1))
    jacobian, residual = _effector_rows(target, place, turn_rate, FitScales())
    np.testing.assert_allclose(
        FitScales().rotation * residual[:, 4], [-0.01 - LEAST_ROLL, -LEAST_ROLL, 0.0], atol=1e-12
    )
    np.testing.assert_allclose(FitScales().rotation * jacobian[:, 4, 4], [1.0, 1.0, 0.0], atol=1e-9)


def test_what_touches_in_a_point_is_asked_for_no_more_than_a_hint_of_its_orientation():
    """A knee that carries turns about its point; held as it lay, shank and spine would leave their ranges."""
    held = {name: point(name, place, friction=0.6) for name, place in CREEPING.items()}
    after = held | {"right_knee": point("right_knee", (0.4, -0.1, 0.0), friction=0.6)}
    flying = {name: contact for name, contact in held.items() if name != "right_knee"}
    stances = [Stance(list(stage.values()), 2000.0) for stage in (held, flying, after)]
    schedule = ContactSchedule(StanceSequence([Phase(stance) for stance in stances]), [0.0, 0.5, 1.0, 1.5])
    (swing,) = schedule.sequence.swings()
    poses = [Pose(stage["right_knee"].position, np.eye(3)) for stage in (held, after)]
    planned = PlannedSwing(swing, SwingCurve.lift(*poses, 0.5, 1.0), "smooth")
    for target in effector_targets(schedule, [planned], np.linspace(0.0, 1.5, 16)).values():
        assert target.rotation_weight.max() <= POINT_ROTATION_WEIGHT
        assert (target.weight > 0.0).all()


def test_a_foot_lands_before_its_knee_from_above_and_a_hand_that_left_stays_off():
    """Only 0.1 s around a change within a limb, and 0.35 s after the last contact, may go into the ground."""
    wrist, knee = (point(name, CREEPING[name], friction=0.6) for name in ("left_wrist", "right_knee"))
    stances = [
        Stance(held, 2000.0)
        for held in ([LEFT, wrist, knee], [LEFT, wrist], [LEFT, wrist, RIGHT], [LEFT, RIGHT])
    ]
    schedule = ContactSchedule(
        StanceSequence([Phase(stance) for stance in stances]), [0.0, 1.0, 2.0, 3.0, 5.0]
    )
    times = {"foot": (1.85, 1.95), "leg": (1.05, 1.15), "hand": (3.3, 3.4)}
    for part, (first, second) in times.items():
        side = "left" if part == "hand" else "right"
        touching = ignored_pairs(BODY, Scene([]), schedule, np.array([first, second]))
        assert [(f"{side}_{part}", "floor") in pairs for pairs in touching] == [
            part != "foot",
            part == "foot",
        ]


CREEPING = {
    "left_wrist": (0.6, 0.15, 0.0), "right_wrist": (0.6, -0.15, 0.0),
    "left_knee": (0.0, 0.1, 0.0), "right_knee": (0.0, -0.1, 0.0),
}  # fmt: skip


def test_targets_of_a_part_are_those_of_the_whole_then():
    """Flights before and after the part's times place nothing."""
    whole, part = np.linspace(0.0, END, 81), slice(61, 81)
    swing = next(s for s in SCHEDULE.sequence.swings() if s.effector == "right_foot")
    poses = [Pose(c.position, c.rotation_contact_to_world) for c in (RIGHT, ON_STEP)]
    planned = PlannedSwing(swing, SwingCurve.lift(*poses, LIFT, LAND), "smooth")
    all_of_it, rest = (effector_targets(SCHEDULE, [planned], time) for time in (whole, whole[part]))
    for name, target in rest.items():
        np.testing.assert_array_equal(target.position, all_of_it[name].position[part])
        np.testing.assert_array_equal(target.weight, all_of_it[name].weight[part])


def test_a_foot_in_flight_keeps_off_what_it_leaves_and_reaches_in_the_middle_of_its_way():
    """It may be on both at their ends; the foot that stands stays on the ground, other pairs apart."""
    time = np.array([0.2, LIFT, 0.5 * (LIFT + LAND), LAND - 1e-9, 2.5])
    flights = KeptDistances.of(BODY, SCENE, SCHEDULE, time)
    ignored = ignored_pairs(BODY, SCENE, SCHEDULE, time)
    counted = flights.without(ignored)
    own = {("right_foot", "step"), ("right_toes", "step"), ("right_foot", "floor"), ("right_toes", "floor")}
    for number, flying in enumerate((False, True, True, True, False)):
        assert ignored[number] - counted[number] == (ignored[number] & own if flying else set())
    pairs = (("right_toes/box", "floor"), ("right_foot/box", "step"), ("left_foot/box", "post"))
    found = ProximitySamples(np.repeat(np.arange(5), 3), np.zeros(15), np.zeros((15, BODY.nv)), pairs * 5)
    wanted = flights.wanted(found, 0.028).reshape(5, 3)
    np.testing.assert_allclose(wanted[[0, 4]], 0.028)
    np.testing.assert_allclose(wanted[:, 2], 0.028)
    np.testing.assert_allclose(wanted[2, :2], LOW)
    np.testing.assert_allclose([wanted[1, 0], wanted[3, 1]], -TOUCHING, atol=1e-9)
    np.testing.assert_allclose([wanted[1, 1], wanted[3, 0]], LOW)


def test_a_foot_keeps_its_whole_distance_while_its_knee_carries():
    """It is in the air for a whole crawl; led by the middle of that flight, toes came 5 mm near the floor."""
    knee = point("right_knee", (0.3, -0.1, 0.0), friction=0.6)
    held = [[LEFT, RIGHT], [LEFT], [LEFT, knee], [LEFT], [LEFT, RIGHT]]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0)) for contacts in held])
    schedule = ContactSchedule(sequence, np.arange(6.0))
    kept = KeptDistances.of(BODY, SCENE, schedule, np.linspace(0.0, 5.0, 6))
    assert not any("foot" in segment for pairs, _ in kept.entries for segment, _ in pairs)
