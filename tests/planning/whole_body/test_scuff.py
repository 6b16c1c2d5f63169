"""Feet in flight that go into the ground."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, StanceSequence
from manikin.planning.whole_body.certificate import deepest_penetration
from manikin.planning.whole_body.fit_targets import ignored_pairs
from manikin.scene import Proximity


@pytest.fixture(scope="module")
def measure(person, flat_ground):
    proximity = Proximity(person, flat_ground)

    def depth_and_time(motion, schedule, more=frozenset()):
        ignored = ignored_pairs(person, flat_ground, schedule, motion.time)
        return deepest_penetration(
            person, proximity.along(motion.q), schedule, motion.time, [pairs | more for pairs in ignored]
        )

    return depth_and_time


def lowered(motion, depth):
    q = motion.q.copy()
    q[:, 2] -= depth
    return replace(motion, q=q)


@pytest.mark.parametrize("depth", [0.004, 0.02])
def test_a_foot_that_leaves_the_ground_too_low_is_measured(measure, step_motion, step_com, depth):
    """It stands at zero when its flight begins and ends; lowered, it is as deep as it was lowered."""
    schedule = step_com.schedule
    before, _ = measure(step_motion.motion, schedule)
    assert 0.0 <= before < 1e-3
    found, time = measure(lowered(step_motion.motion, depth), schedule)
    assert found == pytest.approx(depth, abs=1e-3)
    assert schedule.instants[1] <= time <= schedule.instants[2]


def test_a_standing_foot_is_no_scuff(measure, step_motion, step_com):
    """What stands is measured as support error."""
    both = step_com.schedule.sequence.phases[0]
    schedule = ContactSchedule(StanceSequence([both]), step_com.schedule.instants[[0, 1]])
    assert measure(lowered(step_motion.motion, 0.02), schedule)[0] == 0.0


def test_what_everything_may_lean_on_is_not_measured(measure, step_motion, step_com, person):
    padded = frozenset((segment.name, "floor") for segment in person.segments)
    assert measure(lowered(step_motion.motion, 0.02), step_com.schedule, padded)[0] == 0.0


def test_the_certificate_tells_it(step_motion, measure, step_com):
    found, time = measure(step_motion.motion, step_com.schedule)
    assert step_motion.certificate.value("max_scuff_m") == pytest.approx(found, abs=1e-5)
    assert np.isfinite(time)
