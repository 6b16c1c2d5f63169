import json

import numpy as np
import pytest

from manikin.balance import evaluate_balance
from manikin.contact import Stance, grasp, sole
from manikin.errors import ContactError, InputError


def test_standing_person_is_balanced_and_every_criterion_agrees(two_soles):
    report = evaluate_balance(two_soles, 79.0, (0.02, 0.01, 0.92))
    assert report.balanced
    assert report.margin > 0
    for at in (report.com_projection, report.zmp, report.cmp):
        np.testing.assert_allclose(at.position, [0.02, 0.01], atol=1e-12)
        assert at.distance == pytest.approx(0.12)
    assert report.fri is None
    np.testing.assert_allclose(report.com_polygon.max(axis=0), [0.14, 0.16], atol=1e-6)


def test_leaning_too_far_loses_balance_by_every_criterion(two_soles):
    report = evaluate_balance(two_soles, 79.0, (0.2, 0.0, 0.92))
    assert not report.balanced
    assert report.margin < 0
    assert report.force_margin < 0
    assert report.zmp.distance == pytest.approx(-0.06)
    assert "front edge" in report.limiting.description


def test_slipping_is_seen_by_the_polytope_alone(two_soles):
    """ZMP and CMP know no friction ([Qiu2012]_ 4.2.8, remark 3)."""
    report = evaluate_balance(two_soles, 79.0, (0.25, 0.0, 0.3), (8.0, 0.0, 0.0))
    assert report.zmp.distance > 0
    assert not report.balanced


def test_angular_momentum_moves_the_zmp_off_the_cmp(two_soles):
    report = evaluate_balance(two_soles, 79.0, (0.0, 0.0, 0.9), angular_momentum_rate=(0.0, 20.0, 0.0))
    assert report.cmp.position[0] == pytest.approx(0.0)
    assert report.zmp.position[0] == pytest.approx(-20.0 / (79.0 * 9.81))


def test_fri_is_given_in_single_support_only():
    foot = sole("left_foot", (0.0, 0.0, 0.1), length=0.28, width=0.12, friction=0.7)
    report = evaluate_balance(Stance([foot], 1500.0), 79.0, (0.0, 0.1, 0.9))
    assert report.plane_height == pytest.approx(0.1)
    assert report.fri is not None
    assert report.fri.distance == pytest.approx(-0.04)


@pytest.mark.parametrize("polytope", [False, True])
@pytest.mark.parametrize("contacts", [[], [grasp("hand", (0, 0, 1.5), max_force=100.0)], None])
def test_report_is_json_whatever_the_stance(two_soles, contacts, polytope):
    stance = two_soles if contacts is None else Stance(contacts)
    report = evaluate_balance(stance, 79.0, (0.0, 0.0, 0.9)).as_dict(polytope=polytope)
    again = json.loads(json.dumps(report, allow_nan=False))
    assert again["balanced"] == (contacts is None)
    assert ("H" in again) == polytope
    assert again["facets"]["wrench_polytope"] > 0


def test_the_margin_does_not_depend_on_the_reference_and_the_one_about_it_does(two_soles):
    near = evaluate_balance(two_soles, 79.0, (0.02, 0.01, 0.92))
    far = evaluate_balance(two_soles, 79.0, (0.02, 0.01, 0.92), reference=(5.0, 0.0, 0.0))
    assert abs(near.margin_about_reference - far.margin_about_reference) > 1.0
    assert near.margin == pytest.approx(far.margin, rel=1e-9)
    assert near.force_margin == pytest.approx(far.force_margin, rel=1e-9)


def test_bad_input_is_refused(two_soles):
    with pytest.raises(InputError, match="com"):
        evaluate_balance(two_soles, 79.0, (0, 0))
    with pytest.raises(InputError, match="mass"):
        evaluate_balance(two_soles, -1.0, (0, 0, 1))
    with pytest.raises(InputError, match="acceleration"):
        evaluate_balance(two_soles, 79.0, (0, 0, 1), (np.nan, 0, 0))
    with pytest.raises(ContactError, match="normal_force_cap"):
        evaluate_balance(Stance(two_soles.contacts), 79.0, (0, 0, 1))
