"""The round front of a sole, on which a pelvis rolls."""

import numpy as np
import pytest

from manikin.contact import SolePart, rolling_front, sole
from manikin.errors import ContactError
from manikin.numerics.spatial import rotation_from_rpy

SEAT = sole("buttocks", (0.3, -0.2, 0.45), 0.7, length=0.14, width=0.24, friction=0.3)
RADIUS = 0.05


@pytest.mark.parametrize("pitch", [0.0, 0.3, 0.7])
def test_a_wheel_that_rolls_stays_on_its_contact(pitch):
    """The axis goes forward by radius times pitch at its height; what has rolled so misses nothing."""
    contact = rolling_front(SEAT, RADIUS)
    frame = contact.rotation_contact_to_world
    turn = frame @ rotation_from_rpy(0.0, pitch, 0.0)
    axis = contact.position + frame @ [0.07 + RADIUS * pitch, 0.0, RADIUS]
    place = axis - turn @ [0.07, 0.0, RADIUS]
    assert contact.rolled_away(turn, place) == pytest.approx((0.0, 0.0), abs=1e-7)
    moved, _ = contact.rolled_away(turn, place + frame @ [0.01, 0.0, 0.0])
    assert moved == pytest.approx(0.01)


def test_only_the_front_line_carries():
    contact = rolling_front(SEAT, RADIUS)
    assert contact.part is SolePart.FRONT
    assert contact.points == pytest.approx(np.array([[0.07, 0.12, 0.0], [0.07, -0.12, 0.0]]))


def test_a_front_is_taken_from_a_whole_sole_only():
    with pytest.raises(ContactError, match="no whole sole"):
        rolling_front(rolling_front(SEAT, RADIUS), RADIUS)
