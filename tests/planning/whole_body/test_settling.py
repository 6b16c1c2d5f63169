"""Contacts that are made at speed and slide to their place."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance.friction import edges_in_world
from manikin.contact import ContactSchedule, Stance, StanceSequence, grasp, sole
from manikin.contact.stance import Phase
from manikin.control.edge_forces import SLIDING_SPEED, sliding_edges
from manikin.planning.whole_body.fit_job import phase_knots, touch_downs_at_speed
from manikin.planning.whole_body.fit_targets import settled_share, settling_map

FOOT = sole("left_foot", (0.0, 0.1, 0.0), length=0.26, width=0.1, friction=0.7)
SEAT = sole("buttocks", (0.1, 0.0, 0.5), length=0.14, width=0.24, friction=0.4, settle=0.5)
HAND = grasp("right_hand", (0.5, -0.2, 0.9), max_force=100.0)
SCHEDULE = ContactSchedule(
    StanceSequence([Phase(Stance(held, 2000.0)) for held in ([FOOT], [FOOT, SEAT], [FOOT, SEAT, HAND])]),
    [0.0, 1.0, 1.2, 2.5],
)


def test_a_contact_settles_from_its_touch_down_also_over_the_next_phase():
    time = np.array([0.9, 1.0, 1.1, 1.3, 1.499, 1.5, 2.0])
    assert SCHEDULE.settling(time, "buttocks").tolist() == [False, True, True, True, True, False, False]
    assert not SCHEDULE.settling(time, "left_foot").any()
    share = settled_share(SCHEDULE, 2, SEAT, np.array([1.0, 1.25, 1.5, 2.0]))
    assert share == pytest.approx([0.0, 0.5, 1.0, 1.0])


@given(st.floats(0.0, 1.0))
def test_a_settling_contact_is_held_along_its_normal_first(share):
    error_map = settling_map(SEAT, np.array([share]))[0]
    down, along = error_map @ SEAT.normal, error_map @ [1.0, 0.0, 0.0]
    assert np.linalg.norm(down) >= np.linalg.norm(along) > 0.0
    assert settling_map(SEAT, np.array([1.0]))[0] == pytest.approx(np.eye(3))


def test_knots_lie_closer_around_a_touch_down_at_speed():
    sudden = touch_downs_at_speed(SCHEDULE)
    assert sudden == pytest.approx([1.0])
    plain, fine = (np.unique(phase_knots(SCHEDULE.instants, 0.05, s)) for s in ((), sudden))
    near = (fine > 0.95) & (fine < 1.05)
    assert near.sum() > ((plain > 0.95) & (plain < 1.05)).sum() + 2
    assert np.diff(fine).min() > 0.0
    assert set(np.round(SCHEDULE.instants, 12)) <= set(np.round(fine, 12))


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.0))
def test_kinetic_friction_opposes_the_sliding_and_is_mu_times_the_normal_force(x, y, z):
    velocity = np.array([x, y, z])
    edges = sliding_edges(SEAT, velocity, edges_in_world(SEAT, "inner"))
    if np.hypot(x, y) < SLIDING_SPEED:
        assert edges is edges_in_world(SEAT, "inner")
        return
    assert edges @ SEAT.normal == pytest.approx(np.ones(4))
    tangential = edges - SEAT.normal
    assert np.linalg.norm(tangential, axis=1) == pytest.approx(np.full(4, SEAT.friction))
    assert tangential[0] @ velocity == pytest.approx(-SEAT.friction * np.hypot(x, y))
