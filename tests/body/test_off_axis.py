"""Masses of a human off the lines between joints."""

import pickle

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.body.anthropometry import Anthropometry
from manikin.body.human import body_from_signature
from manikin.body.human_parts import off_axis
from manikin.errors import BodyError


def com(body):
    """(3,) centre of mass in the zero posture [m]."""
    return pin.centerOfMass(body.pinocchio, body.pinocchio.createData(), body.zero_posture())


@pytest.mark.parametrize("sex", ["male", "female"])
def test_the_body_moves_back_by_the_mean_of_its_parts(sex):
    size = Anthropometry(1.75, 79.0, sex)
    rows = ("head_and_neck", "upper_trunk", "middle_trunk", "thigh", "thigh", "shank", "shank")
    wanted = sum(size.segment_mass(row) * off_axis(size, row) for row in rows) / 79.0
    plain, moved = human(sex=sex), human(sex=sex, off_axis_masses=True)
    np.testing.assert_allclose(com(moved) - com(plain), wanted, atol=1e-12)
    # Dumas et al. (2007), Table 2, with the masses of de Leva: 12.6 mm (men), 13.5 mm (women).
    assert -0.016 < wanted[0] < -0.010
    assert moved.mass == plain.mass


def test_only_masses_move_and_both_sides_alike():
    plain, moved = human(), human(off_axis_masses=True)
    for before, after in zip(plain.segments, moved.segments, strict=True):
        np.testing.assert_array_equal(before.origin, after.origin)
        np.testing.assert_allclose(before.inertia, after.inertia, atol=1e-4)
        assert before.com[2] == pytest.approx(after.com[2], abs=1e-12)
    left, right = (moved.segment(f"{side}_thigh").com for side in ("left", "right"))
    np.testing.assert_allclose(left * [1.0, -1.0, 1.0], right)
    assert left[1] > 0.01


def test_a_body_is_made_again_with_its_masses():
    body = human(1.7, 65.0, "female", off_axis_masses=True, lengths={"thigh": 0.41})
    for again in (body_from_signature(body.signature()), pickle.loads(pickle.dumps(body))):
        assert again.off_axis_masses
        np.testing.assert_allclose(com(again), com(body), atol=1e-12)
    with pytest.raises(BodyError, match="valid: off axis, or none"):
        body_from_signature(body.signature() | {"masses": "anywhere"})
    plain = human()
    assert "masses" not in plain.signature()
    assert not body_from_signature(plain.signature()).off_axis_masses
