"""The least shift that brings a motion back onto what its contacts can carry."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.body.configuration import Configuration
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.kinematics import PointTargets
from manikin.numerics.spatial import GRAVITY, cross
from manikin.recordings import Reconstruction, dynamics_of, least_shift, recorded_margins
from manikin.recordings.dynamics.shifted_motion import (
    ACCELERATION_ERROR,
    ASIDE,
    INSIDE,
    LARGEST_RMS,
    LARGEST_SHIFT,
    PLACE_ERROR,
)

RATE, FRAMES = 100.0, 201
TIME = np.arange(FRAMES) / RATE
BODY = human(off_axis_masses=True)
WEIGHT = GRAVITY * BODY.mass
LENGTH, WIDTH = 0.28, 0.12


def standing(sway):
    """Our human standing, moved along x by (n,) metres."""
    q = np.tile(BODY.standing_posture(), (FRAMES, 1))
    q[:, 0] += sway
    targets = PointTargets(("hips",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    return Reconstruction(BODY, TIME, q, targets, np.zeros((FRAMES, 1)), neutral=())


def on_one_foot(ahead, right=0.0):
    """A right sole below the centre of mass of standing, its front edge ``ahead``, its axis to the right."""
    com = Configuration(BODY, BODY.standing_posture()).com
    place = (com[0] + ahead - 0.5 * LENGTH, com[1] - right, 0.0)
    foot = sole("right_foot", place, 0.0, length=LENGTH, width=WIDTH, friction=0.8)
    return ContactSchedule(StanceSequence([Phase(Stance([foot], 4.0 * WEIGHT), 2.0)]), [0.0, 2.0])


def shifted(found, schedule, **options):
    dynamics = dynamics_of(found)
    margins = recorded_margins(dynamics, schedule)
    return margins, least_shift(found, dynamics, margins, **options)


def test_who_is_in_balance_is_left_alone():
    margins, moved = shifted(standing(0.01 * np.sin(TIME)), on_one_foot(0.1), aside=None)
    assert (margins.whole_body > INSIDE * WEIGHT).all()
    assert not moved.shift.any()
    assert moved.margins is margins
    assert moved.margins.balanced == 1.0
    assert moved.believable
    assert not replace(moved, shift=moved.shift + np.eye(1, 3) * 1.1 * LARGEST_RMS).believable
    # Nor does a foot alone draw whom it carries on its axis.
    _, moved = shifted(standing(0.01 * np.sin(TIME)), on_one_foot(0.1))
    np.testing.assert_allclose(moved.shift, 0.0, atol=1e-6)


def test_a_foot_alone_is_rather_loaded_along_its_axis():
    # At rest 3 cm beside the axis, within the sole.
    schedule = on_one_foot(0.1, right=0.03)
    margins, moved = shifted(standing(np.zeros(FRAMES)), schedule)
    assert (margins.whole_body > INSIDE * WEIGHT).all()
    axis = schedule.sequence[0].stance.contacts[0].position[1]
    motions = (dynamics_of(standing(np.zeros(FRAMES))), moved.dynamics)
    aside = [one.zero_moment_point(0.0)[:, 1] - axis for one in motions]
    np.testing.assert_allclose(aside[0], 0.03, atol=1e-4)
    assert np.sqrt(np.mean(aside[1] ** 2)) < 0.9 * 0.03
    np.testing.assert_allclose(moved.shift[:, 0], 0.0, atol=1e-3)
    # No other shift is cheaper: neither none, nor half or twice as much.
    costs = [
        cost(share * moved.shift) + np.sum((aside[0] + share * (aside[1] - aside[0])) ** 2) / ASIDE**2
        for share in (1.0, 0.0, 0.5, 2.0)
    ]
    assert np.argmin(costs) == 0


def test_who_stands_beyond_the_edge_is_put_back_by_what_is_missing():
    # At rest 1 cm before the front edge, the centre of mass has to go back by that and by what is kept.
    margins, moved = shifted(standing(np.zeros(FRAMES)), on_one_foot(-0.01), aside=None)
    assert (margins.whole_body < 0.0).all()
    # Imposed is the distance of the zero moment point to the edge, but for the facet's part in the forces.
    assert moved.margins.body.zmp_distance.min() > 0.95 * INSIDE
    np.testing.assert_allclose(moved.shift[:, 1], 0.0, atol=1e-6)
    # Standing still that far back would do as well, and costs more than leaning on accelerations.
    back = np.zeros_like(moved.shift)
    back[:, 0] = -0.01 - INSIDE
    assert cost(moved.shift) <= cost(back)


def cost(shift):
    bend = np.gradient(np.gradient(shift, 1 / RATE, axis=0, edge_order=2), 1 / RATE, axis=0, edge_order=2)
    return np.sum(shift**2) / PLACE_ERROR**2 + np.sum(bend**2) / ACCELERATION_ERROR**2


def test_a_tremble_of_a_millimetre_is_taken_out_by_less_than_one():
    # 1.2 mm at 4 Hz moves the zero moment point by 1.2e-3 (2 pi 4)^2 / g z, more than 6 cm.
    tremble = 1.2e-3 * np.sin(8.0 * np.pi * TIME)
    margins, moved = shifted(standing(tremble), on_one_foot(0.035))
    inner = slice(20, -20)
    assert np.mean(margins.whole_body[inner] > 0.0) < 0.9
    assert moved.margins.body.zmp_distance[inner].min() > 0.9 * INSIDE
    assert moved.rms < 1.2e-3


def test_the_floor_is_named_and_told_from_results():
    """Who stands beyond the edge is held by the floor, who stands well inside by nothing."""
    margins, moved = shifted(standing(np.zeros(FRAMES)), on_one_foot(-0.01), aside=None)
    assert moved.floor == pytest.approx(INSIDE * WEIGHT)
    assert moved.floor_length == pytest.approx(INSIDE)
    assert moved.at_floor.mean() > 0.3
    foot = margins.polytopes[0].stance.contacts[0]
    ahead = foot.position[0] + 0.5 * LENGTH - moved.dynamics.zero_moment_point(0.0)[:, 0]
    # There the centre of pressure is the floor from the edge, but for the facet's part in the forces.
    np.testing.assert_allclose(ahead[moved.at_floor], INSIDE, rtol=0.05)
    assert (ahead > 0.95 * INSIDE).all()
    assert not shifted(standing(np.zeros(FRAMES)), on_one_foot(0.1), aside=None)[1].at_floor.any()


def test_no_shift_makes_a_fall_a_stand():
    margins, moved = shifted(standing(np.zeros(FRAMES)), on_one_foot(-0.15))
    # Bounded per axis, so the body stays beyond the edge and its margin negative.
    assert np.abs(moved.shift).max() <= LARGEST_SHIFT + 1e-6
    assert (margins.whole_body < 0.0).all()
    # Only for an instant can 3 cm be gone through so fast that the zero moment point moves by 15.
    assert moved.margins.balanced < 0.3
    assert not moved.believable


def test_the_shifted_wrench_obeys_the_law_of_momentum():
    found = standing(1.2e-3 * np.sin(8.0 * np.pi * TIME))
    schedule = on_one_foot(0.035)
    dynamics = dynamics_of(found)
    moved = least_shift(found, dynamics, recorded_margins(dynamics, schedule))
    bend = np.gradient(np.gradient(moved.shift, 1 / RATE, axis=0), 1 / RATE, axis=0)
    force = BODY.mass * bend
    change = moved.dynamics.wrench - dynamics.wrench
    inner = slice(5, -5)
    np.testing.assert_allclose(change[inner, :3], force[inner], atol=2e-3 * np.abs(force).max())
    moment = cross(moved.shift, dynamics.wrench[:, :3]) + cross(dynamics.com + moved.shift, force)
    np.testing.assert_allclose(change[inner, 3:], moment[inner], atol=5e-3 * np.abs(moment).max())
    np.testing.assert_allclose(moved.dynamics.com, dynamics.com + moved.shift, atol=1e-9)


def test_in_flight_nothing_is_shifted_and_nonsense_is_refused():
    found = standing(np.zeros(FRAMES))
    flight = ContactSchedule(StanceSequence([Phase(Stance((), 4.0 * WEIGHT), 2.0)]), [0.0, 2.0])
    _, moved = shifted(found, flight)
    assert not moved.shift.any()
    assert moved.margins.balanced is None
    assert not moved.believable
    with pytest.raises(InputError, match="valid: at least 0 m"):
        shifted(found, flight, inside=-1.0)
    with pytest.raises(InputError, match="valid: at least 0 m"):
        shifted(replace(found, neutral=("neck",)), flight, inside=float("nan"))
    with pytest.raises(InputError, match="aside"):
        shifted(found, flight, aside=0.0)
