"""The lowest margin of a motion and the contact that limits it."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.balance import wrench_polytope
from manikin.balance.motion_forces import full_motion
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.ergonomics import lowest_margin
from manikin.ergonomics.report import rebuilt_stance

from .conftest import still


@pytest.fixture(scope="module")
def leaning(body):
    """A body that sways to its left over both feet, and the contacts it was planned with."""
    q0 = body.standing_posture()
    data = body.pinocchio.createData()
    import pinocchio as pin

    pin.framesForwardKinematics(body.pinocchio, data, q0)
    contacts = [
        sole(
            name, data.oMf[body.effector_frame(name)].translation, length=body.sole_length,
            width=body.sole_width, friction=0.8,
        )
        for name in ("left_foot", "right_foot")
    ]  # fmt: skip
    stance = Stance(contacts, 3.0 * body.mass * 9.81)
    schedule = ContactSchedule(StanceSequence([Phase(stance, 0.1, 10.0)]), [0.0, 1.0])
    time = np.linspace(0.0, 1.0, 21)
    q = np.tile(q0, (21, 1))
    q[:, 1] += 0.10 * time  # carried sideways as a stiff body: the soles are where they were planned
    zero = np.zeros((21, body.nv))
    return full_motion(body, schedule, [wrench_polytope(stance)], time, q, zero, zero)[0], schedule


def test_it_is_found_and_explained_with_the_planned_contacts(body, leaning):
    motion, schedule = leaning
    found = lowest_margin(body, motion, schedule)
    assert found.value == motion.margin.min()
    assert found.time == 1.0
    assert found.again == pytest.approx(found.value, abs=1e-6)
    assert found.reproduced
    assert found.stance == "planned contacts"
    assert str(found.limiting.description) == "left_foot: tipping over its outer edge"


def test_it_is_found_again_from_the_effectors(body, leaning):
    """At the first frame the soles are on their contacts, so the rebuilt stance is the planned one."""
    motion, schedule = leaning
    first = replace(motion, **{name: array[:1] for name, array in motion.arrays().items()})
    planned, rebuilt = lowest_margin(body, first, schedule), lowest_margin(body, first)
    assert rebuilt.stance == "effectors in contact"
    assert rebuilt.again == pytest.approx(planned.value, abs=1e-6)
    assert rebuilt.limiting.description == planned.limiting.description


def test_hands_and_seat_are_rebuilt_too(body):
    motion = still(body, body.standing_posture(), contacts=("left_foot", "right_hand", "buttocks"))
    stance = rebuilt_stance(body, motion, 0)
    assert stance.effectors == ("left_foot", "right_hand", "buttocks")
    assert [str(contact.kind) for contact in stance] == ["sole", "point", "sole"]


def test_unknown_margins(body):
    motion = still(body, body.standing_posture())
    assert lowest_margin(body, motion) is None
    margin = np.where(motion.time < 0.5, np.nan, 10.0 - motion.time)
    nothing = replace(motion, margin=margin, support=np.zeros_like(motion.support))
    found = lowest_margin(body, nothing)
    assert (found.value, found.time) == (9.0, 1.0)
    assert found.limiting is None
    assert found.unknown == "nothing is in contact at that instant"


def test_a_margin_of_another_stance_is_not_called_reproduced(body, leaning):
    motion, schedule = leaning
    found = lowest_margin(body, replace(motion, margin=motion.margin - 40.0), schedule)
    assert not found.reproduced
    assert found.again - found.value == pytest.approx(40.0, abs=1e-6)
