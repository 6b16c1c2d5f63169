"""Contact variables: what is not there and not needed is let go, what is needed stays."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point, sole
from manikin.errors import ContactError
from manikin.kinematics import PostureProblem, generate_posture
from manikin.kinematics.posture_problem import touching_pairs
from manikin.planning.whole_body import RefineScales, RefineSettings, refine_motion
from manikin.planning.whole_body.contact_variables import (
    LEAST,
    RELEASE,
    VariableChoice,
    VariableSamples,
    best_variables,
    mean_cost,
)
from manikin.planning.whole_body.refine_physics import RefinedForces
from manikin.scene import Box, Obstacle, Proximity, Scene

BODY = human(1.75, 79.0, "male")
SCALES = RefineScales()
TABLE = Scene([Obstacle("table", Box((0.5, 1.2, 0.04)), translation=(0.62, 0.0, 0.88))])
TOP = 0.9
FEET = [
    sole(f"{side}_foot", (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
    for side, y in (("left", 0.1), ("right", -0.1))
]
WEIGHT = BODY.mass * 9.81


def hand(x, height=TOP, side="right"):
    y = -0.25 if side == "right" else 0.25
    return point(f"{side}_hand", (x, y, height), friction=0.6)


def posture(contacts, com_x):
    ignore = touching_pairs(
        BODY, [(c.effector, "table" if "hand" in c.effector else "floor") for c in contacts]
    )
    problem = PostureProblem(
        BODY, tuple(contacts), com=np.array([com_x, 0.0, np.nan]), proximity=Proximity(BODY, TABLE),
        clearance=0.01, ignore=ignore,
    )  # fmt: skip
    found = generate_posture(problem)
    assert found.succeeded, found.failure
    return found.q


def refined(listed, shown, com_x, *, on=True):
    """A body that moves its centre of mass over three phases of the same stance.

    Args:
        listed: Contacts of the hands in the sequence.
        shown: Contacts of the hands in the key postures.
        com_x: Of the two keys [m].
        on: Whether contacts may be let go.
    """
    keys = [posture([*FEET, *shown], x) for x in com_x]
    phases = [Phase(Stance([*FEET, *listed], 1500.0))] * 2
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.6, 1.2])
    chosen = RefineSettings(scales=RefineScales.of(BODY), contact_variables=on)
    q = [keys[0], keys[1], keys[0]]
    return refine_motion(BODY, TABLE, [0.0, 0.6, 1.2], q, schedule, settings=chosen)


@pytest.mark.parametrize(
    ("listed", "shown"),
    [
        pytest.param(hand(0.5, TOP + 0.05), hand(0.5, TOP + 0.05), id="the contact is 5 cm above the table"),
        pytest.param(hand(0.5), hand(0.5, TOP + 0.05), id="the hand is 5 cm above its contact"),
    ],
)
def test_a_hand_that_is_not_where_its_contact_is_is_let_go(listed, shown):
    """Two feet carry a body that stands: the sequence's hand is dropped, and what is left is certified."""
    result = refined([listed], [shown], (0.02, 0.05))
    assert result.released == ((0, "right_hand"), (1, "right_hand"))
    assert all(phase["right_hand"] < RELEASE for phase in result.variables)
    assert all(phase[foot.effector] == 1.0 for phase in result.variables for foot in FEET)
    assert result.failure is None, result.failure
    assert result.certificate.held
    assert result.motion.contact_names == ("left_foot", "right_foot")


@pytest.mark.long
def test_a_contact_out_of_reach_is_let_go_when_the_motion_shows_it():
    """No key lies in the phase that lists it: the first fit misses it, the second goes on without."""
    far = Obstacle("shelf", Box((0.4, 0.4, 0.04)), translation=(1.4, -0.25, 1.18))
    scene, key = Scene([far]), posture(FEET, 0.04)
    reach = point("right_hand", (1.4, -0.25, 1.2), friction=0.6)
    phases = [Phase(Stance([*FEET, *extra], 1500.0)) for extra in ([], [reach], [])]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.5, 1.0, 1.5])
    result = refine_motion(BODY, scene, [0.0, 1.5], [key, key], schedule)
    assert result.released == ((1, "right_hand"),)
    assert result.failure is None, result.failure


def test_held_by_order_a_contact_in_the_air_is_refused():
    with pytest.raises(ContactError):
        refined([hand(0.5, TOP + 0.05)], [hand(0.5, TOP + 0.05)], (0.02, 0.05), on=False)


@pytest.mark.parametrize("off", [0.0, 0.05])
def test_a_hand_that_the_body_leans_on_is_kept(off):
    """The centre of mass is beyond the toes: only the hand balances it, 5 cm off in the keys or not."""
    result = refined([hand(0.45)], [hand(0.45, TOP + off)], (0.16, 0.17))
    assert result.released == ()
    assert result.variables == (dict.fromkeys(result.variables[0], 1.0),) * 2
    assert result.failure is None, result.failure
    assert result.certificate.value("max_support_error_m") < 1e-3
    column = result.motion.contact_names.index("right_hand")
    assert result.motion.contact_force[:, column, 2].min() > 10.0  # it carries, all the time


def choice():
    return VariableChoice(BODY, TABLE, SCALES, 1e-3, 0.8)


def standing_samples(schedule, com_x, shift):
    """A body at rest with the centre of mass at ``com_x``, hands ``shift`` above their contacts."""
    time = np.linspace(0.0, 1.2, 5)
    wrench = np.tile([0.0, 0.0, WEIGHT, 0.0, -com_x * WEIGHT, 0.0], (5, 1))
    contacts = schedule.sequence[0].stance
    names = contacts.effectors
    place = {name: np.tile(contacts[name].position, (5, 1)) for name in names}
    for name in names:
        place[name][:, 2] += shift if "hand" in name else 0.0
    com = np.tile([com_x, 0.0, 0.9], (5, 1))
    return VariableSamples(time, wrench, com, time, place, dict.fromkeys(names, np.zeros(5)))


def stand(*hands):
    return ContactSchedule(StanceSequence([Phase(Stance([*FEET, *hands], 1500.0))]), [0.0, 1.2])


def test_contacts_that_are_where_they_should_be_have_a_variable_of_one():
    """The corner of the problem: forces get cheaper, nothing else gets dearer."""
    schedule = stand(hand(0.45), hand(0.45, side="left"))
    variables, kept = choice().choose(schedule, standing_samples(schedule, 0.05, 0.0))
    assert kept is schedule
    assert set(variables[0].values()) == {1.0}


def test_of_two_hands_that_are_not_there_the_one_that_is_needed_stays():
    """Beyond the toes one hand is enough: one of the two is let go, the other keeps the body up."""
    schedule = stand(hand(0.6), hand(0.6, side="left"))
    samples = standing_samples(schedule, 0.16, 0.05)
    variables, kept = choice().choose(schedule, samples)
    hands = {name for name in kept.sequence[0].stance.effectors if "hand" in name}
    assert len(hands) == 1
    assert variables[0][hands.pop()] == 1.0


@given(st.lists(st.floats(0.05, 1.0), min_size=8, max_size=8), st.floats(0.0, 1.0), st.floats(-0.1, 0.2))
def test_the_problem_of_a_phase_is_convex_and_solved(ends, share, com_x):
    """Between two variables its value is below the chord, and nowhere below that of the solution."""
    schedule = stand(hand(0.45), hand(0.45, side="left"))
    stance, samples = schedule.sequence[0].stance, standing_samples(schedule, com_x, 0.0)
    names = stance.effectors
    forces = RefinedForces(stance, names)
    first, second = np.array(ends[:4]), np.array(ends[4:])
    errors = {"left_foot": 0.0, "right_foot": 0.02, "right_hand": 0.01, "left_hand": 1.0}
    penalty = np.array([errors[name] for name in names])

    def total(c):
        value, slope = mean_cost(forces, samples.wrench, SCALES.missing_wrench, WEIGHT, c)
        return value + penalty @ c, slope + penalty

    middle = share * first + (1.0 - share) * second
    chord = share * total(first)[0] + (1.0 - share) * total(second)[0]
    assert total(middle)[0] <= chord * (1.0 + 1e-9) + 1e-12
    step = 1e-6
    for column in range(4):
        moved = step * np.eye(4)[column]
        slope = (total(middle + moved)[0] - total(middle - moved)[0]) / (2.0 * step)
        assert total(middle)[1][column] == pytest.approx(slope, rel=1e-4, abs=1e-6)
    found = best_variables(stance, samples.wrench, errors, names, SCALES, BODY.mass)
    best = np.array([found[name] for name in names])
    assert ((best >= LEAST) & (best <= 1.0)).all()
    assert total(best)[0] <= min(total(first)[0], total(second)[0]) * (1.0 + 1e-5) + 1e-9


def test_the_farther_an_effector_is_off_the_smaller_its_variable():
    schedule = stand(hand(0.45))
    found = []
    for off in (0.0, 0.005, 0.02, 0.05):
        samples = standing_samples(schedule, 0.1, off)
        errors = choice().errors(schedule.sequence[0].stance, samples, (0.0, 1.2))
        assert errors["left_foot"] == 0.0
        free = ["right_hand"]
        found.append(
            best_variables(schedule.sequence[0].stance, samples.wrench, errors, free, SCALES, BODY.mass)
        )
    values = [item["right_hand"] for item in found]
    assert values[0] == 1.0
    assert all(a >= b for a, b in pairwise(values))
    assert values[-1] < RELEASE


def test_what_the_keys_say_is_read_at_the_keys(cases):
    """A crouch's feet slide in the interpolation between its keys, but not at the keys themselves."""
    case = cases.crouch(1)
    names = case.schedule.sequence.effectors
    still = np.zeros((len(case.time), case.body.nv))
    samples = VariableSamples.of(case.body, names, case.time, (case.q, still, still))
    own = VariableChoice(case.body, case.scene, SCALES, 1e-3, 0.8)
    for number, phase in enumerate(case.schedule.sequence):
        interval = tuple(case.schedule.instants[number : number + 2])
        assert set(own.errors(phase.stance, samples, interval).values()) == {0.0}
    state = Configuration(case.body, case.q[0])
    assert np.allclose(samples.place["left_foot"][0], state.effector_placement("left_foot")[1])
