"""Parts of a sole and the expansion of a stance sequence into heel, sole and toes."""

import numpy as np
import pytest

from manikin.balance import least_zmp_distance, pseudo_wrench, support_plane, wrench_polytope
from manikin.contact import (
    Phase,
    SolePart,
    Stance,
    StanceSequence,
    grasp,
    point,
    roll_feet,
    sole_part,
)
from manikin.contact import sole as make_sole
from manikin.contact.stance import ON_BALL, ON_TOES
from manikin.errors import ContactError
from manikin.numerics.polytope import signed_distance

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}
HINGE = 0.0644


def foot(name="left_foot", place=(0.0, 0.1, 0.0), yaw=0.3, **limits):
    return make_sole(name, place, yaw, **SIZE, **limits)


def step():
    left, right = foot(), foot("right_foot", (0.0, -0.1, 0.0))
    ahead = foot("right_foot", (0.4, -0.1, 0.0))
    stances = ([left, right], [left], [left, ahead])
    return StanceSequence([Phase(Stance(contacts, 1500.0), 0.3) for contacts in stances])


def random_wrenches(count=500):
    """Wrenches about the sizes that a person's contacts give, inside and outside of them."""
    rng = np.random.default_rng(3)
    return rng.normal(size=(count, 6)) * [60, 60, 300, 40, 40, 10] + [0, 0, 600, 0, 0, 0]


@pytest.mark.parametrize(("way", "parts"), [(0.4, {SolePart.HEEL, SolePart.TOES}), (-0.3, set())])
def test_a_foot_that_goes_back_leaves_and_lands_flat(way, parts):
    """One that goes on leaves over its toes and lands on its heel, as it heads."""
    left, right = foot(), foot("right_foot", (0.0, -0.1, 0.0))
    ahead = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    there = foot("right_foot", tuple(right.position + way * ahead))
    phases = [Phase(Stance(contacts, 1500.0), 0.3) for contacts in ([left, right], [left], [left, there])]
    held = [c.part for phase in roll_feet(StanceSequence(phases), HINGE) for c in phase.stance]
    assert set(held) - {SolePart.FULL} == parts


def test_phases_without_a_change_of_contact_keep_their_beginnings():
    """Parts that a rolling foot makes of a phase go on in it, wherever phases on the same contacts are."""
    left, right = foot(), foot("right_foot", (0.0, -0.1, 0.0))
    held = [[left, right], [left, right], [left], [left, foot("right_foot", (0.4, -0.1, 0.0))]]
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0), 0.3) for contacts in held])
    assert sequence.begins == (0, 1, 2, 3)
    rolled = roll_feet(sequence, HINGE)
    assert len(rolled) > len(sequence)
    names = [{contact.effector for contact in contacts} for contacts in held]
    assert [set(rolled[k].stance.effectors) for k in rolled.begins] == names
    assert rolled.begins[:2] == (0, 1)


def parts_of(*stances):
    """Part of each foot's contact in each phase, once its feet roll."""
    sequence = StanceSequence([Phase(Stance(contacts, 1500.0), 0.3, 0.8) for contacts in stances])
    rolled = roll_feet(sequence, HINGE)
    return rolled, [{c.effector: c.part for c in phase.stance} for phase in rolled]


def test_a_brief_phase_on_both_feet_has_no_flat_part():
    """The heel that leaves rises as the other foot has come down; bounds of the phase are kept."""
    right, ahead = foot("right_foot", (0.0, -0.1, 0.0), 0.0), foot(place=(0.4, 0.1, 0.0), yaw=0.0)
    phases = [
        Phase(Stance(held, 1500.0), *bounds)
        for held, bounds in (([right], (0.4, 0.8)), ([right, ahead], (0.18, 0.8)), ([ahead], (0.4, 0.8)))
    ]  # fmt: skip
    rolled = roll_feet(StanceSequence(phases), HINGE)
    held = [{c.effector: c.part for c in phase.stance} for phase in rolled]
    assert held[1:-1] == [
        {"right_foot": SolePart.FULL, "left_foot": SolePart.HEEL},
        {"right_foot": SolePart.TOES, "left_foot": SolePart.FULL},
    ]
    brief = rolled.phases[1:-1]
    assert sum(phase.min_duration for phase in brief) == pytest.approx(0.18)
    assert brief[1].max_duration == pytest.approx(0.8 - brief[0].min_duration)


def test_a_foot_above_the_other_rises_onto_its_toes_as_that_lands():
    """The phase on both feet keeps its bounds: on a flat upper foot no time is spent."""
    upper, lower = foot("right_foot", (0.0, -0.1, 0.2), 0.0), foot("left_foot", (0.4, 0.1, 0.0), 0.0)
    beside = foot("left_foot", (0.0, 0.1, 0.2), 0.0)
    rolled, parts = parts_of([beside, upper], [upper], [lower, upper], [lower])
    landed, left = rolled.begins[2:]
    assert left == landed + 1
    assert parts[landed] == {"left_foot": SolePart.FULL, "right_foot": SolePart.TOES}
    assert (rolled[landed].min_duration, rolled[landed].max_duration) == (0.3, 0.8)


def test_a_foot_deep_below_the_other_lands_on_its_ball():
    """Its heel comes down before the upper one rises; both take their time from the phase on both feet."""
    upper, lower = foot("right_foot", (0.0, -0.1, 0.3), 0.0), foot("left_foot", (0.3, 0.1, 0.0), 0.0)
    beside = foot("left_foot", (0.0, 0.1, 0.3), 0.0)
    rolled, parts = parts_of([beside, upper], [upper], [lower, upper], [lower])
    landed, left = rolled.begins[2:]
    assert parts[landed:left] == [
        {"left_foot": SolePart.TOES, "right_foot": SolePart.FULL},
        {"left_foot": SolePart.FULL, "right_foot": SolePart.TOES},
    ]
    assert rolled[landed].min_duration == ON_BALL
    assert rolled[landed + 1].min_duration == max(0.3 - ON_BALL, ON_TOES)


@pytest.mark.parametrize(("toes_end", "rises"), [(0.13, True), (0.08, False)])
def test_a_sole_over_an_edge_rises_where_its_toes_lie_on_the_surface(toes_end, rises):
    """Of toes 7.6 cm long before the hinge, 87 and 21 % lie on the surface; 60 % are asked for."""
    corners = [[-0.14, -0.06], [toes_end, -0.06], [toes_end, 0.06], [-0.14, 0.06]]
    upper = make_sole("right_foot", (0.0, -0.1, 0.3), 0.0, **SIZE, polygon=corners)
    assert upper.hangs_over
    assert upper.rises_on_toes(HINGE) is rises
    lower, beside = (foot("left_foot", (x, 0.1, z), 0.0) for x, z in ((0.4, 0.0), (0.0, 0.3)))
    _, parts = parts_of([beside, upper], [upper], [lower, upper], [lower])
    assert (SolePart.TOES in {held.get("right_foot") for held in parts}) is rises
    if rises:
        toes = sole_part(upper, SolePart.TOES, HINGE).points
        assert toes[:, 0].min() == pytest.approx(HINGE)
        assert toes[:, 0].max() == pytest.approx(toes_end)
        assert signed_distance(toes[:, :2], upper.outline).min() > -1e-12


@pytest.mark.parametrize("part", [SolePart.HEEL, SolePart.TOES])
def test_a_part_applies_what_its_points_apply(part):
    """The polytope of a part beside a full sole is that of frictional points at its corners."""
    other = foot("right_foot", (0.2, -0.1, 0.0))
    touching = sole_part(foot(), part, HINGE)
    points = [
        point(f"p{i}", place, friction=0.7, rotation=touching.rotation_contact_to_world)
        for i, place in enumerate(touching.points_in_world)
    ]
    first = wrench_polytope(Stance([touching, other], 1500.0))
    second = wrench_polytope(Stance([*points, other], 1500.0))
    wrench = random_wrenches()
    assert first.margin(wrench) == pytest.approx(second.margin(wrench), abs=1e-6)


@pytest.mark.parametrize("part", [SolePart.HEEL, SolePart.TOES])
def test_a_part_adds_to_the_other_sole_and_stays_within_the_full_one(part):
    """A wrench inside has no less margin in the larger set: sole, sole and part, both soles."""
    other = foot("right_foot", (0.2, -0.1, 0.0))
    single, rolling, full = (
        wrench_polytope(Stance(contacts, 1500.0))
        for contacts in ([other], [sole_part(foot(), part, HINGE), other], [foot(), other])
    )
    wrench = random_wrenches()
    assert np.any(single.margin(wrench) >= 0)
    for smaller, larger in ((single, rolling), (rolling, full)):
        inside = smaller.margin(wrench) >= 0
        assert np.all(larger.margin(wrench[inside]) >= smaller.margin(wrench[inside]) - 1e-6)


def test_the_zmp_of_an_edge_lies_on_its_line():
    """Two points that push have their centre of pressure between them."""
    heel = sole_part(foot(), SolePart.HEEL, HINGE)
    W = wrench_polytope(Stance([heel], 1500.0))
    first, second = heel.points_in_world
    for share in (0.1, 0.5, 0.9):
        place = (1.0 - share) * first + share * second
        wrench = pseudo_wrench(60.0, place + np.array([0.0, 0.0, 0.9]), np.zeros(3))
        assert W.margin(wrench) == pytest.approx(0.0, abs=1e-6)
        plane = support_plane(Stance([heel], 1500.0))
        assert signed_distance(plane.zero_moment_point(wrench), plane.polygon) == pytest.approx(0.0, abs=1e-9)
    beside = pseudo_wrench(60.0, first + 0.02 * heel.rotation_contact_to_world[:, 0], np.zeros(3))
    assert W.margin(beside) < -1.0


def test_an_edge_gives_way_by_rolling():
    """The limit of an edge beside nothing else is named after what the foot does."""
    heel = sole_part(foot(), SolePart.HEEL, HINGE)
    W = wrench_polytope(Stance([heel], 1500.0))
    middle = heel.points_in_world.mean(axis=0)
    ahead = middle + 0.1 * heel.rotation_contact_to_world[:, 0]
    assert "rolling forward" in W.limiting(pseudo_wrench(60.0, ahead, np.zeros(3))).description


def test_a_step_is_split_into_heel_sole_and_toes():
    """The foot that leaves goes over its toes, the one that lands over its heel; places stay."""
    rolled = roll_feet(step(), HINGE)
    parts = [{c.effector: str(c.part) for c in phase.stance} for phase in rolled]
    assert parts == [
        {"left_foot": "full", "right_foot": "full"},
        {"left_foot": "full", "right_foot": "toes"},
        {"left_foot": "full"},
        {"left_foot": "full", "right_foot": "heel"},
        {"left_foot": "full", "right_foot": "full"},
    ]
    assert [phase.min_duration for phase in rolled] == pytest.approx([0.08, 0.22, 0.3, 0.08, 0.22])
    assert len(rolled.swings()) == len(step().swings())
    assert rolled[1].stance["right_foot"].same_place(rolled[0].stance["right_foot"])


def test_rolling_never_has_less_than_single_support():
    """Every phase contains the wrenches of one full sole or more."""
    for phase in roll_feet(step(), HINGE):
        assert any(contact.part is SolePart.FULL for contact in phase.stance)


def test_a_foot_alone_does_not_roll():
    """A hop, and a foot beside a hand only, land and leave flat: an edge alone cannot hold a body."""
    hold = grasp("left_hand", (0.3, 0.2, 1.0), max_force=100.0)
    hop = StanceSequence([Phase(Stance(c, 1500.0)) for c in ([foot()], [], [foot(place=(0.4, 0.1, 0.0))])])
    held = StanceSequence([Phase(Stance(c, 1500.0)) for c in ([foot(), hold], [hold])])
    for sequence in (hop, held):
        assert len(roll_feet(sequence, HINGE)) == len(sequence)


def test_parts_are_taken_from_full_soles():
    with pytest.raises(ContactError, match="valid: a full sole"):
        sole_part(sole_part(foot(), SolePart.HEEL, HINGE), SolePart.TOES, HINGE)
    with pytest.raises(ContactError, match="hinge"):
        sole_part(foot(), SolePart.TOES, 0.2)


def test_parts_count_as_support_of_the_zmp():
    """The support polygon of a sole and a heel reaches back to the heel's edge."""
    heel = sole_part(foot(yaw=0.0, place=(0.5, 0.1, 0.0)), SolePart.HEEL, HINGE)
    stance = Stance([foot("right_foot", (0.0, -0.1, 0.0), yaw=0.0), heel], 1500.0)
    between = 0.5 * (heel.points_in_world.mean(axis=0) + np.array([0.0, -0.1, 0.0]))
    wrench = pseudo_wrench(60.0, between + np.array([0.0, 0.0, 0.9]), np.zeros(3))
    assert least_zmp_distance([(stance, wrench[None])]) > 0.0
