"""The CoM trajectory: published splines, time scaling, dictionaries."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule
from manikin.errors import InputError, SplineError
from manikin.numerics.spatial import GRAVITY_VECTOR
from manikin.numerics.spline import BSpline
from manikin.planning.com import CentroidalTrajectory

# Position, velocity, acceleration at the key instants of Tables 5.4 and 7.6, an independent
# evaluation of the printed control points. Knots and points are rounded to 3-4 digits.
TABLE_5_4_VALUES = (
    ((0.0, 0.0, 0.92), (0.0, 0.0, 0.0), (2.0722, 0.6044, 4.4898)),
    ((0.0586, 0.0259, 0.9365), (0.2365, 0.168, -0.1715), (-0.2558, 0.6896, -1.3913)),
    ((0.1311, 0.1653, 0.8559), (0.1608, 0.5366, -0.0269), (0.0842, 0.6964, 1.4123)),
    ((0.1654, 0.2833, 0.8743), (0.1576, 0.5444, 0.1566), (-0.1656, -0.6499, 0.1687)),
    ((0.2651, 0.4157, 0.857), (0.213, -0.0313, -0.1455), (0.5387, 0.2634, 0.1722)),
    ((0.649, 0.5725, 0.819), (0.2118, 0.1227, -0.0369), (-0.6314, -0.3886, -0.1174)),
    ((0.6738, 0.6193, 0.8542), (-0.0731, 0.0906, 0.1729), (-0.2289, 0.1371, -0.0541)),
    ((0.6, 0.65, 0.86), (0.0, 0.0, 0.0), (2.3038, 0.1589, 2.3832)),
)
TABLE_7_6_VALUES = (
    ((0.235, -1.0112, 0.4659), (0.0, 0.0, 0.0), (0.3542, 0.6285, -0.0599)),
    ((0.2445, -0.9413, 0.4506), (-0.0724, 0.1314, -0.0393), (-0.459, 0.0458, -0.0382)),
    ((0.1744, -0.8839, 0.4321), (-0.2819, 0.1575, -0.053), (-0.5115, 0.0683, -0.0313)),
    ((-0.1746, -0.7515, 0.3738), (-0.2754, 0.074, -0.063), (0.4803, -0.1605, 0.0047)),
    ((-0.2566, -0.722, 0.3423), (-0.0742, 0.0724, -0.0648), (0.2408, 0.1573, -0.0138)),
    ((-0.3002, -0.4777, 0.2427), (0.0768, 0.2878, -0.0663), (0.6175, 0.424, 0.0332)),
    ((-0.0454, -0.1463, 0.2104), (0.99, 0.9983, -0.0408), (2.8307, 2.2452, 0.0341)),
)


@pytest.mark.parametrize(
    ("name", "values"), [("table_5_4", TABLE_5_4_VALUES), ("table_7_6", TABLE_7_6_VALUES)]
)
def test_published_splines_have_their_published_values(name, values, request):
    trajectory = request.getfixturevalue(name)
    times = trajectory.schedule.instants
    position, velocity, acceleration = np.array(values).transpose(1, 0, 2)
    # Instants given to 1e-3 s and 1e-4 s: 0.5e-3 s times 0.5 m/s, times 2 m/s^2, times jerk.
    assert np.allclose(trajectory.position(times), position, atol=1e-3)
    assert np.allclose(trajectory.velocity(times), velocity, atol=2e-3)
    assert np.allclose(trajectory.acceleration(times), acceleration, atol=2e-2)


def test_derivatives_are_limits_of_differences_in_seconds(table_5_4: CentroidalTrajectory):
    t, step = np.linspace(0.1, 4.1, 30), 1e-5
    chain = (table_5_4.position, table_5_4.velocity, table_5_4.acceleration, table_5_4.jerk)
    for function, derivative in itertools.pairwise(chain):
        differences = (function(t + step) - function(t - step)) / (2 * step)
        # Truncation step^2/6 times a third derivative of up to 1e3, rounding 1e-15/1e-5.
        assert np.allclose(differences, derivative(t), atol=1e-6)


def test_pseudo_wrench_of_rest_is_the_weight_at_the_com(table_5_4: CentroidalTrajectory):
    """Force m (a - g) and its moment about the world origin."""
    wrench, acceleration = table_5_4.pseudo_wrench(2.0), table_5_4.acceleration(2.0)
    force = 79.0 * (acceleration - GRAVITY_VECTOR)
    assert np.allclose(wrench, [*force, *np.cross(table_5_4.position(2.0), force)])


def test_the_body_rests_before_the_start_and_after_the_end(table_5_4: CentroidalTrajectory):
    assert np.array_equal(table_5_4.position(9.0), table_5_4.position(4.193))
    assert np.array_equal(table_5_4.acceleration([-1.0, 9.0]), np.zeros((2, 3)))


def test_scalar_and_array_times_give_the_same_values(table_5_4: CentroidalTrajectory):
    times = np.array([[0.1, 0.2], [1.0, 4.0]])
    assert table_5_4.jerk(times).shape == (2, 2, 3)
    assert np.array_equal(table_5_4.jerk(times)[1, 0], table_5_4.jerk(1.0))


def test_dictionary_gives_the_same_trajectory_back(table_5_4: CentroidalTrajectory):
    data = table_5_4.to_dict()
    again = CentroidalTrajectory.from_dict(data, table_5_4.schedule.sequence)
    t = np.linspace(0.0, table_5_4.duration, 50)
    assert np.array_equal(again.jerk(t), table_5_4.jerk(t))
    assert again.to_dict() == data


def test_dictionary_without_a_key_is_refused(table_5_4: CentroidalTrajectory):
    data = table_5_4.to_dict()
    del data["knots"]
    with pytest.raises(InputError, match="lacks 'knots'"):
        CentroidalTrajectory.from_dict(data, table_5_4.schedule.sequence)


def test_spline_must_be_over_normalised_time(table_5_4: CentroidalTrajectory):
    spline = table_5_4.spline
    stretched = BSpline(spline.degree, 2 * spline.knots, spline.control_points)
    with pytest.raises(SplineError, match=r"\[0, 1\]"):
        CentroidalTrajectory(79.0, stretched, table_5_4.schedule)


def test_motion_must_start_at_zero(table_5_4: CentroidalTrajectory):
    schedule = ContactSchedule(table_5_4.schedule.sequence, table_5_4.schedule.instants + 1.0)
    with pytest.raises(InputError, match="starts at 1 s"):
        CentroidalTrajectory(79.0, table_5_4.spline, schedule)


def turning(table_5_4: CentroidalTrajectory) -> CentroidalTrajectory:
    """The published CoM of a body that turns, too."""
    spline, rng = table_5_4.spline, np.random.default_rng(0)
    rate = BSpline(spline.degree, spline.knots, 20.0 * rng.normal(size=spline.control_points.shape))
    return replace(table_5_4, turning=rate)


def test_a_body_that_turns_needs_its_rate_of_angular_momentum_as_a_moment(table_5_4: CentroidalTrajectory):
    """[Qiu2012]_ 4.51 less 4.6 is the rate of the angular momentum, at any time."""
    time, found = np.linspace(0.0, table_5_4.duration, 7), turning(table_5_4)
    more = found.pseudo_wrench(time) - table_5_4.pseudo_wrench(time)
    np.testing.assert_allclose(more[:, :3], 0.0, atol=1e-9)
    np.testing.assert_allclose(more[:, 3:], found.angular_momentum_rate(time), atol=1e-9)
    assert not np.any(table_5_4.angular_momentum_rate(time))


def test_turning_survives_the_dictionary_and_forbids_joining(table_5_4: CentroidalTrajectory):
    found = turning(table_5_4)
    again = CentroidalTrajectory.from_dict(found.to_dict(), found.schedule.sequence)
    assert again.to_dict() == found.to_dict()
    with pytest.raises(SplineError, match="valid: those of point masses"):
        found.followed_by(table_5_4)
    with pytest.raises(SplineError, match="turning"):
        replace(found, turning=BSpline(1, [0.0, 0.0, 2.0, 2.0], np.zeros((2, 3))))
