"""Contacts, stances and schedules are checked plain data."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.contact import (
    CarriedLoad,
    ContactSchedule,
    ExertedForce,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    point,
    sole,
    soles_overlap,
)
from manikin.errors import ContactError
from manikin.numerics.spatial import PlanarTransform

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}


def standing_at(x):
    """A phase on the left foot."""
    return Phase(Stance([sole("left_foot", (x, 0.0, 0.0), **SIZE)]))


def test_a_sole_has_its_corners_around_its_centre():
    foot = sole("left_foot", (1.0, 2.0, 0.5), np.pi / 2, **SIZE)
    np.testing.assert_allclose(foot.points_in_world.mean(axis=0), [1.0, 2.0, 0.5], atol=1e-15)
    # Toes to +y: 0.28 m along y, 0.12 m along x.
    np.testing.assert_allclose(np.ptp(foot.points_in_world, axis=0), [0.12, 0.28, 0.0], atol=1e-12)
    assert foot.length == pytest.approx(0.28)
    assert foot.width == pytest.approx(0.12)
    assert foot.yaw == pytest.approx(np.pi / 2)


@given(st.floats(-3.0, 3.0), st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1))
def test_a_tilted_sole_lies_in_the_plane_of_its_normal(yaw, normal):
    foot = sole("left_foot", (0.1, 0.2, 0.3), yaw, normal=normal, **SIZE)
    unit = np.array(normal) / np.linalg.norm(normal)
    np.testing.assert_allclose(foot.normal, unit, atol=1e-9)
    np.testing.assert_allclose((foot.points_in_world - foot.position) @ unit, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("shift", "yaw", "overlaps"),
    [
        ((0.0, 0.119, 0.0), 0.0, True),
        ((0.0, 0.121, 0.0), 0.0, False),
        ((0.281, 0.0, 0.0), 0.0, False),
        ((0.2, 0.0, 0.0), np.pi / 2, False),
        ((0.19, 0.0, 0.0), np.pi / 2, True),
        ((0.0, 0.0, 0.2), 0.0, False),
    ],
)
def test_soles_overlap_exactly_where_their_rectangles_do(shift, yaw, overlaps):
    """Rectangles of 0.28 x 0.12 m: side by side from 0.12 m, head on from 0.28 m, crossed from 0.20 m."""
    first, second = sole("left_foot", (0, 0, 0), **SIZE), sole("right_foot", shift, yaw, **SIZE)
    assert soles_overlap(first, second) is overlaps
    assert soles_overlap(second, first) is overlaps


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.0), "friction"),
        (lambda: sole("left_foot", (0, 0, float("nan")), **SIZE), "position"),
        (lambda: sole("left_foot", (0, 0), **SIZE), "shape"),
        (lambda: sole("left_foot", (0, 0, 0), length=-1.0, width=0.12, friction=0.7), "length"),
        (lambda: point("left_hand", (0, 0, 0), friction=0.5, rotation=2.0 * np.eye(3)), "rotation"),
        (lambda: grasp("right_hand", (0, 0, 0), max_force=0.0), "max_force"),
        (lambda: Stance([sole("left_foot", (0, 0, 0), **SIZE)] * 2), "twice"),
        (lambda: StanceSequence([]), "empty"),
        (lambda: Phase(Stance([]), min_duration=0.0), "min_duration"),
        (lambda: StanceSequence([standing_at(0.0), standing_at(0.1)]), "slides between phases 0 and 1"),
        (lambda: ContactSchedule(StanceSequence([Phase(Stance([]))]), [1.0, 1.0]), "increasing"),
    ],
)
def test_misuse_is_refused_in_one_line(make, message):
    with pytest.raises(ContactError, match=message) as caught:
        make()
    assert "valid" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_swings_and_their_intervals_follow_from_the_sequence():
    left = [sole("left_foot", (x, 0.1, 0.0), **SIZE) for x in (0.0, 0.3)]
    right = sole("right_foot", (0.0, -0.1, 0.0), **SIZE)
    stances = ([left[0], right], [right], [left[1], right], [left[1]])
    sequence = StanceSequence([Phase(Stance(contacts)) for contacts in stances])
    schedule = ContactSchedule(sequence, [0.0, 0.5, 1.0, 1.4, 2.0])
    first, last = sequence.swings()
    assert (first.effector, first.first_phase, first.last_phase) == ("left_foot", 1, 1)
    assert first.start is left[0]
    assert first.end is left[1]
    assert schedule.swing_interval(first) == (0.5, 1.0)
    assert (last.effector, last.end) == ("right_foot", None)
    # Half-open phases; the last one is closed.
    assert schedule.phase_at([0.0, 0.499, 0.5, 1.4, 2.0, 9.0]).tolist() == [0, 0, 1, 3, 3, 3]
    assert schedule.support(0.7, ("left_foot", "right_foot")).tolist() == [[False, True]]


def test_a_schedule_seen_from_another_frame_keeps_its_contacts_apart_or_one():
    """A foot that stands on in the next phase stays one contact; points, times, load and force follow."""
    left, right = sole("left_foot", (0.0, 0.1, 0.0), **SIZE), sole("right_foot", (0.4, -0.1, 0.0), **SIZE)
    load = CarriedLoad({"left_hand": 3.0}, np.array([0.3, 0.0, 0.1]))
    force = ExertedForce("push", np.array([1.0, 0.0, 0.0]))
    phases = [Phase(Stance([left])), Phase(Stance([left, right]), load=load, exerts=force)]
    schedule = ContactSchedule(StanceSequence(phases), [1.0, 1.5, 2.25])
    transform = PlanarTransform(10.0, -2.0, 90.0)
    moved = schedule.moved(transform)
    first, second = moved.sequence
    assert first.stance["left_foot"] is second.stance["left_foot"]
    for before, after in zip(phases[1].stance, second.stance, strict=True):
        np.testing.assert_allclose(
            after.points_in_world, transform.points(before.points_in_world), atol=1e-12
        )
    np.testing.assert_allclose(second.load.offset, [0.0, 0.3, 0.1], atol=1e-15)
    assert first.exerts is None
    assert second.exerts.kind == "push"
    np.testing.assert_allclose(second.exerts.direction, [0.0, 1.0, 0.0], atol=1e-15)
    assert moved.duration == schedule.duration == 1.25
    assert schedule.moved(PlanarTransform()) is schedule
