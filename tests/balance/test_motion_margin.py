"""Margin along a motion."""

import numpy as np
import pytest

from manikin.balance import (
    motion_margin,
    pseudo_wrench,
    stability_margins,
    support_plane,
    wrench_polytope,
    wrench_polytopes,
)
from manikin.contact import Contact, Stance, grasp, point, sole
from manikin.errors import InputError
from manikin.numerics.spatial import rotation_from_yaw

MASS = 79.0


def _stances():
    left = sole("left_foot", (0.0, 0.1, 0.0), 0.1, length=0.26, width=0.1, friction=0.6)
    right = sole("right_foot", (0.3, -0.1, 0.0), length=0.26, width=0.1, friction=0.6)
    step = sole("right_foot", (0.3, -0.1, 0.2), length=0.26, width=0.1, friction=0.6)
    hand = grasp("left_hand", (0.4, 0.3, 1.1), max_force=120.0)
    knee = point("left_knee", (0.1, 0.1, 0.0), friction=0.5)
    cap = 3.0 * MASS * 9.81
    groups = ([left, right], [left], [left, step], [left, hand], [], [right, knee])
    return [Stance(group, cap) for group in groups]


def _samples(count=60):
    rng = np.random.default_rng(3)
    com = np.array([0.1, 0.05, 0.95]) + 0.08 * rng.normal(size=(count, 3))
    turning = 8.0 * rng.normal(size=(count, 3))
    wrench = pseudo_wrench(MASS, com, 0.8 * rng.normal(size=(count, 3)), turning)
    return rng.integers(0, len(_stances()), count), wrench, com


def _moved(stance, turn, shift):
    contacts = []
    for contact in stance:
        values = {name: getattr(contact, name) for name in Contact.__dataclass_fields__}
        values["position"] = turn @ contact.position + shift
        values["rotation_contact_to_world"] = turn @ contact.rotation_contact_to_world
        contacts.append(Contact(**values))
    return Stance(contacts, stance.normal_force_cap)


def test_each_sample_has_the_margins_of_its_own_stance():
    """The series is what :func:`stability_margins` and the support plane say sample by sample."""
    stances, (phases, wrench, com) = _stances(), _samples()
    found = motion_margin(stances, phases, wrench, com)
    for row, number in enumerate(phases):
        stance = stances[number]
        if not len(stance):
            continue
        alone = stability_margins(wrench_polytope(stance), wrench[row], com[row])
        assert found.margin[row] == pytest.approx(float(alone.wrench_about_com), rel=1e-9)
        assert found.force[row] == pytest.approx(float(alone.force), rel=1e-9)
        plane = support_plane(stance)
        wanted = np.nan if plane is None else float(plane.zmp_distance(wrench[row]))
        assert found.zmp_distance[row] == pytest.approx(wanted, rel=1e-9, nan_ok=True)


@pytest.mark.parametrize("yaw", [0.0, 37.0])
def test_nothing_depends_on_where_the_scene_stands_and_how_it_is_turned(yaw):
    """Moved by (10, -7, 0) m and turned by 37 degrees: the same to 1e-9 of the largest, rounding of 12 m.

    The box of a grasp has the world's axes, so that its stance is only moved.
    """
    stances, (phases, wrench, com) = _stances(), _samples()
    turn, shift = rotation_from_yaw(np.deg2rad(yaw)), np.array([10.0, -7.0, 0.0])
    phases = np.where(phases == 3, 2, phases) if yaw else phases
    force, moment = wrench[:, :3] @ turn.T, wrench[:, 3:] @ turn.T
    there = np.hstack([force, moment + np.cross(shift, force)])
    here = motion_margin(stances, phases, wrench, com)
    moved = motion_margin([_moved(s, turn, shift) for s in stances], phases, there, com @ turn.T + shift)
    for name in ("margin", "force", "zmp_distance"):
        wanted, got = getattr(here, name), getattr(moved, name)
        np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * np.nanmax(np.abs(wanted)))


def test_in_flight_the_missing_wrench_about_the_com_counts():
    """Free fall needs nothing; a body that is not falling lacks its weight."""
    com = np.array([[3.0, 1.0, 2.0]] * 2)
    wrench = pseudo_wrench(MASS, com, np.array([[0.0, 0.0, -9.81], [0.0, 0.0, 0.0]]))
    found = motion_margin([Stance([])], [0, 0], wrench, com)
    lengths = np.linalg.norm(wrench[:, :3], axis=1)
    assert lengths[1] == pytest.approx(MASS * 9.81, rel=1e-3)
    assert lengths[0] < 1.0
    np.testing.assert_allclose(found.margin, -lengths, atol=1e-9)
    np.testing.assert_allclose(found.force, -lengths, atol=1e-9)
    assert np.isnan(found.zmp_distance).all()
    assert found.min_zmp_distance is None


def test_polytopes_that_are_known_are_used_whatever_their_reference():
    stances, (phases, wrench, com) = _stances(), _samples()
    given = [wrench_polytope(s, reference=(1.0, -2.0, 0.5)) if len(s) else None for s in stances]
    known = motion_margin(stances, phases, wrench, com, polytopes=given)
    computed = motion_margin(stances, phases, wrench, com)
    np.testing.assert_allclose(known.margin, computed.margin, rtol=1e-8, atol=1e-8)


def test_a_stance_that_was_moved_has_the_polytope_of_the_first_one_moved_along():
    here = _stances()[3]
    there = _moved(here, np.eye(3), np.array([4.0, -3.0, 0.5]))
    first, second = wrench_polytopes([here, there])
    assert np.array_equal(first.H, second.H)
    assert second.stance is there
    np.testing.assert_allclose(second.reference - first.reference, [4.0, -3.0, 0.5], atol=1e-12)
    at_origin = wrench_polytopes([here, there], reference=(0.0, 0.0, 0.0))[1]
    direct = wrench_polytope(there)
    w = pseudo_wrench(MASS, (4.1, -3.0, 1.3), np.zeros(3))
    assert float(at_origin.margin(w)) == pytest.approx(float(direct.margin(w)), rel=1e-9)


def test_shapes_and_phases_that_do_not_fit_are_refused():
    stances, (phases, wrench, com) = _stances(), _samples()
    with pytest.raises(InputError, match="valid: \\(n, 6\\)"):
        motion_margin(stances, phases, wrench[:, :5], com)
    with pytest.raises(InputError, match="valid: 0 to 5"):
        motion_margin(stances, phases + 6, wrench, com)
