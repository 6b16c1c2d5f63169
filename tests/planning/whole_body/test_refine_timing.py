"""Phases of a refined motion get shorter as far as everything else is kept."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.planning.whole_body import RefineScales, RefineSettings, refine_motion
from manikin.planning.whole_body.refine_input import SHORTER, SHORTEST, KeyPath, around, shortening, stretched


@pytest.fixture(scope="module")
def results(cases):
    """One step under a slab, each phase 0.9 s, and its motion with shorter phases."""
    case = cases.crouch(1, duration=0.9)
    settings = RefineSettings(scales=RefineScales.of(case.body), speed_share=0.5)
    return case, refine_motion(*case, settings=settings)


def test_a_shortened_motion_keeps_every_requirement_and_its_contacts(results):
    case, hurried = results
    assert hurried.failure is None, hurried.failure
    assert hurried.certificate.held
    assert hurried.contact_slack >= 0.0
    assert hurried.after.duration_s < 0.95 * 4.5
    assert hurried.stretch == pytest.approx(hurried.after.duration_s / 4.5)
    assert hurried.certificate.value("max_torque_share") <= 1.0 + 1e-9
    assert (hurried.schedule.durations >= SHORTEST - 1e-9).all()
    assert (hurried.schedule.durations <= 0.9 + 1e-9).all()
    stances = [phase.stance.effectors for phase in hurried.schedule.sequence]
    assert stances == [phase.stance.effectors for phase in case.schedule.sequence]


def test_only_slow_phases_are_shortened(results):
    """A phase at the wanted speed, one that is settled and one that is short already stay as they are."""
    case, result = results
    motion, schedule = result.motion, result.schedule
    speed = (np.abs(motion.v[:, 6:]) / case.body.velocity_limit).max(axis=1)
    phases = schedule.phase_at(motion.time)
    peaks = np.array([speed[phases == number].max() for number in range(5)])
    share = float(np.median(peaks))
    factors = shortening(case.body, motion, schedule, share, frozenset({int(np.argmin(peaks))}))
    assert factors[np.argmin(peaks)] == 1.0
    assert (factors[peaks >= share] == 1.0).all()
    assert ((factors >= SHORTER) & (factors <= 1.0)).all()
    assert (shortening(case.body, motion, schedule, 1.0, frozenset()) < 1.0).all()


@given(st.lists(st.floats(0.5, 1.0), min_size=5, max_size=5))
def test_keys_move_with_their_phases(results, factors):
    case = results[0]
    path, schedule = stretched(KeyPath(case.time, case.q), case.schedule, np.array(factors))
    np.testing.assert_allclose(schedule.durations, 0.9 * np.array(factors))
    np.testing.assert_allclose(np.interp(case.schedule.instants, case.time, path.time), schedule.instants)
    assert np.array_equal(path.q, KeyPath(case.time, case.q).q)


def test_what_breaks_settles_its_phase_and_those_beside_it(results):
    schedule = results[0].schedule
    assert around(schedule, 0.1) == {0, 1}
    assert around(schedule, 2.0) == {1, 2, 3}
    assert around(schedule, 4.4) == {3, 4}


@pytest.mark.parametrize("share", [0.0, -0.5, 1.5, float("nan")])
def test_shares_without_meaning_are_refused(share):
    with pytest.raises(InputError, match="speed_share"):
        RefineSettings(speed_share=share)
