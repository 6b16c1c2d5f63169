import numpy as np
import pytest

from manikin.body.segments import HANDS
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence
from manikin.motion import Motion
from manikin.planning.push_pull import Timing, measure_act, plan_act


@pytest.fixture
def still(body, brace):
    """A motion that stands in the posture for half a second with its forces at nothing."""
    time = np.linspace(0.0, 0.5, 51)
    n, names = len(time), tuple(brace.contacts)
    return Motion(
        time=time, q=np.tile(brace.q, (n, 1)), v=np.zeros((n, body.nv)), a=np.zeros((n, body.nv)),
        tau=np.zeros((n, body.nv)), com=np.zeros((n, 3)), angular_momentum=np.zeros((n, 3)),
        margin=np.ones(n), support=np.ones((n, len(names)), dtype=bool),
        contact_force=np.zeros((n, len(names), 6)), contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip


@pytest.fixture
def schedule(brace):
    return ContactSchedule(StanceSequence([Phase(Stance(list(brace.contacts.values())))]), [0.0, 0.5])


def test_an_act_is_appended_at_rest_with_its_forces(brace, push, still, schedule):
    planned = plan_act(still, schedule, push, brace.forces, 0.5, 1.0)
    assert planned.timing == Timing(0.5, 0.5, 1.0)
    assert planned.motion.time[-1] == pytest.approx(2.0)
    assert planned.schedule.instants[-1] == pytest.approx(2.0)
    assert planned.schedule.sequence[-1].exerts.kind == "push"
    np.testing.assert_array_equal(planned.schedule.sequence[-1].exerts.direction, push.direction)
    np.testing.assert_array_equal(planned.motion.q[-1], brace.q)
    assert not planned.motion.v[51:].any()
    np.testing.assert_allclose(planned.motion.tau[-1, 6:], brace.forces.tau)
    np.testing.assert_allclose(sum(wish.force for wish in planned.wishes), push.reaction(), atol=1e-6)
    assert {wish.effector for wish in planned.wishes} == set(HANDS)


def test_what_was_planned_measures_as_what_was_wanted(body, brace, push, still, schedule):
    """The forces of the program, taken for measured ones, are the act's, inside friction and balanced."""
    planned = plan_act(still, schedule, push, brace.forces, 0.5, 1.0)
    found = measure_act(planned.motion, planned.schedule, push, planned.timing, body.mass, 0.7)
    assert found.mean_force == pytest.approx(push.force)
    assert found.least_force == pytest.approx(push.force)
    assert found.sideways == pytest.approx(0.0, abs=1e-6)
    assert found.palm_friction <= 1.0 + 1e-6
    assert found.hold == pytest.approx(1.0)


def test_an_act_that_was_not_reached_has_no_measures(body, brace, push, still, schedule):
    planned = plan_act(still, schedule, push, brace.forces, 0.5, 1.0)
    assert measure_act(still, planned.schedule, push, planned.timing, body.mass, 0.7) is None
