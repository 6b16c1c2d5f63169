import numpy as np
import pytest
from scipy.optimize import linprog

from manikin.balance import (
    admissible_com_polygon,
    admissible_zmp_polygon,
    centroidal_moment_pivot,
    foot_rotation_indicator,
    pseudo_wrench,
    support_height,
    support_polygon,
    wrench_polytope,
    zero_moment_point,
)
from manikin.contact import Stance, grasp, point, sole
from manikin.errors import InputError
from manikin.numerics.polytope import convex_polygon, polygon_of_halfplanes, signed_distance

MASS = 60.0
# [Qiu2012]_ 4.2.8, Fig. 4.4 and Fig. 4.5.
STATIC_POINTS = np.array([[0.06, 0.14], [0.06, -0.14], [-0.06, -0.1], [-0.06, 0.18]])
ZMP_POINTS = np.array([[0.06, 0.18], [0.06, -0.1], [-0.06, -0.06], [-0.06, 0.22]])
DIRECTIONS = np.column_stack([np.cos(a := np.linspace(0, 2 * np.pi, 721)), np.sin(a)])


def four_points(points, mu):
    return Stance([point(f"p{i}", (*p, 0.0), friction=mu) for i, p in enumerate(points)], 1000.0)


def reach(polygon):
    return (DIRECTIONS @ polygon.T).max(axis=1)


def exact_zmp_reach(points, mu, height):
    """Support function of ``hull(points)`` cut by ``|x|, |y| <= mu z``, by linear programs.

    The force through CoM and ZMP has the tangential part ``-zmp f_z / z``. Forces parallel
    to it at the points, shared like the pressure, give no moment about the ZMP: friction
    asks for ``|zmp| <= mu z`` in each axis and for nothing else.
    """
    n = len(points)
    A = np.vstack([points.T, -points.T])
    answers = []
    for d in DIRECTIONS[::20]:
        answer = linprog(
            -(points @ d), A_ub=A, b_ub=np.full(4, mu * height), A_eq=np.ones((1, n)), b_eq=[1.0]
        )
        answers.append(-answer.fun)
    return np.array(answers)


def test_static_polygon_is_the_support_polygon():
    """4.41 for 60 kg, mu 0.7: equal to the hull of the four points, corner by corner."""
    W = wrench_polytope(four_points(STATIC_POINTS, 0.7))
    polygon = admissible_com_polygon(W, MASS)
    expected = convex_polygon(STATIC_POINTS)
    assert len(polygon) == 4
    for corner in expected:
        assert np.abs(polygon - corner).max(axis=1).min() < 1e-6
    np.testing.assert_allclose(reach(polygon), reach(expected), atol=1e-6)


@pytest.mark.parametrize("height", [0.8, 0.3])
@pytest.mark.parametrize("mu", [0.05, 0.1, 0.15, 0.2, 0.274, 0.276, 0.5, 0.732, 0.734, 1.0])
def test_zmp_polygon_is_the_support_polygon_cut_by_friction(mu, height):
    W = wrench_polytope(four_points(ZMP_POINTS, mu))
    polygon = admissible_zmp_polygon(W, MASS, (0.0, 0.0, height))
    np.testing.assert_allclose(reach(polygon)[::20], exact_zmp_reach(ZMP_POINTS, mu, height), atol=1e-6)


@pytest.mark.parametrize(("height", "threshold"), [(0.8, 0.275), (0.3, 0.22 / 0.3)])
def test_zmp_polygon_is_whole_from_a_friction_threshold_on(height, threshold):
    """Threshold max |y| / z: 0.275 at 0.8 m and 0.733 at 0.3 m."""
    whole = reach(convex_polygon(ZMP_POINTS))
    for mu, equal in ((threshold + 1e-3, True), (threshold - 1e-3, False)):
        W = wrench_polytope(four_points(ZMP_POINTS, mu))
        found = reach(admissible_zmp_polygon(W, MASS, (0.0, 0.0, height)))
        assert (np.abs(found - whole).max() < 1e-6) == equal


def test_polygons_do_not_depend_on_the_reference_of_the_moments():
    stance = four_points(ZMP_POINTS, 0.2)
    for reference in ((0.0, 0.0, 0.0), (0.7, -0.4, 1.2)):
        W = wrench_polytope(stance, reference=reference)
        zmp = admissible_zmp_polygon(W, MASS, (0.01, 0.02, 0.8), 1.0, 0.1)
        com = admissible_com_polygon(W, MASS, (0.3, 0.1, 0.0), 0.8)
        if reference == (0.0, 0.0, 0.0):
            first = reach(zmp), reach(com)
    np.testing.assert_allclose(reach(zmp), first[0], atol=1e-6)
    np.testing.assert_allclose(reach(com), first[1], atol=1e-6)


def test_zmp_polygon_holds_the_zmps_of_admissible_accelerations():
    """4.45 carried over by 4.43-4.44, also with a vertical acceleration and a raised plane."""
    W = wrench_polytope(four_points(ZMP_POINTS, 0.25))
    com, lift, plane = np.array([0.01, 0.05, 0.8]), 1.5, 0.1
    polygon = admissible_zmp_polygon(W, MASS, com, lift, plane)
    rng = np.random.default_rng(0)
    a = np.column_stack([rng.uniform(-5, 5, (400, 2)), np.full(400, lift)])
    w = pseudo_wrench(MASS, com, a)
    inside = signed_distance(zero_moment_point(w, plane), polygon)
    clear = np.abs(inside) > 1e-6
    assert np.array_equal((inside > 0)[clear], (W.margin(w) > 0)[clear])


def test_com_polygon_on_a_wall_and_a_floor_is_the_exact_one(contact_program):
    """Non-coplanar contacts: the polygon's corners are the last admissible ones."""
    stance = Stance(
        [
            sole("left_foot", (0.0, 0.1, 0.0), length=0.28, width=0.12, friction=0.5),
            point("right_hand", (0.4, -0.2, 1.2), friction=0.5, normal=(-1, 0, 0.2)),
        ],
        1000.0,
    )
    W, program = wrench_polytope(stance), contact_program(stance)
    polygon = admissible_com_polygon(W, MASS)
    middle = polygon.mean(axis=0)
    for corner in polygon:
        for scale, admissible in ((0.999, True), (1.001, False)):
            x, y = middle + scale * (corner - middle)
            gap = program.gap(pseudo_wrench(MASS, (x, y, 0.9), (0, 0, 0)))
            assert (gap < 1e-4) == admissible


def test_a_stance_too_weak_for_the_weight_has_no_polygon():
    W = wrench_polytope(four_points(STATIC_POINTS, 0.7))
    assert admissible_com_polygon(W, 120.0).shape == (0, 2)


def test_a_com_in_the_zmp_plane_or_in_free_fall_is_refused():
    W = wrench_polytope(four_points(ZMP_POINTS, 0.7))
    with pytest.raises(InputError, match="ZMP plane"):
        admissible_zmp_polygon(W, MASS, (0, 0, 0.1), plane_height=0.1)
    with pytest.raises(InputError, match="vertical_acceleration"):
        admissible_zmp_polygon(W, MASS, (0, 0, 0.8), -9.81)
    with pytest.raises(InputError, match="unbounded"):
        admissible_com_polygon(W, MASS, (0, 0, -9.81))


def test_zmp_is_the_printed_formula_on_the_ground():
    x, a = np.array([0.1, 0.2, 0.8]), np.array([1.0, -2.0, 0.5])
    zmp = zero_moment_point(pseudo_wrench(MASS, x, a))
    np.testing.assert_allclose(zmp, x[:2] - x[2] * a[:2] / (a[2] + 9.81), atol=1e-14)


def test_moment_about_the_zmp_is_vertical():
    """Defining property (4.42), with angular momentum, a raised plane and any reference."""
    rng = np.random.default_rng(0)
    x, a, rate, reference = rng.normal(size=(4, 50, 3))
    w = pseudo_wrench(MASS, x, a, rate, reference)
    zmp = np.column_stack([zero_moment_point(w, 0.3, reference), np.full(50, 0.3)])
    about_zmp = pseudo_wrench(MASS, x, a, rate, zmp)
    np.testing.assert_allclose(about_zmp[:, 3:5], 0.0, atol=1e-8)


def test_zmp_is_the_centre_of_pressure_of_any_forces_in_the_plane():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.normal(size=(6, 2)), np.full(6, 0.2)])
    forces = rng.normal(size=(6, 3)) * 50 + [0, 0, 200]
    w = np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])
    pressure = forces[:, 2] @ points[:, :2] / forces[:, 2].sum()
    np.testing.assert_allclose(zero_moment_point(w, 0.2), pressure, atol=1e-12)


def test_without_vertical_force_there_is_no_zmp():
    assert np.isnan(zero_moment_point(np.array([1.0, 0, 0, 0, 0, 0]))).all()


def test_cmp_and_zmp_differ_by_the_rate_of_angular_momentum():
    """|CMP - ZMP| = |horizontal Ldot| / f_z, and they agree for a point mass."""
    x, a, rate = np.array([0.1, 0.2, 0.8]), np.array([1.0, -2.0, 0.5]), np.array([6.0, -8.0, 3.0])
    w = pseudo_wrench(MASS, x, a, rate)
    cmp = centroidal_moment_pivot(w[:3], x, 0.1)
    assert np.linalg.norm(cmp - zero_moment_point(w, 0.1)) == pytest.approx(10.0 / w[2])
    np.testing.assert_allclose(cmp, zero_moment_point(pseudo_wrench(MASS, x, a), 0.1), atol=1e-12)


def test_force_at_the_zram_point_leaves_the_angular_momentum_alone():
    x, f = np.array([0.1, 0.2, 0.8]), np.array([50.0, -30.0, 600.0])
    at = np.array([*centroidal_moment_pivot(f, x), 0.0])
    np.testing.assert_allclose(np.cross(at - x, f), 0.0, atol=1e-10)


def test_fri_is_the_zmp_without_the_foots_own_momentum():
    w = pseudo_wrench(MASS, (0.1, 0.2, 0.8), (1.0, -2.0, 0.5))
    foot = np.array([3.0, 1.0, 5.0, 0.4, 0.2, 0.1])
    np.testing.assert_allclose(foot_rotation_indicator(w), zero_moment_point(w))
    np.testing.assert_allclose(foot_rotation_indicator(w, 0.1, foot), zero_moment_point(w - foot, 0.1))


def test_support_polygon_counts_soles_and_points_not_grasps(two_soles):
    hand = grasp("hand", (3.0, 0.0, 1.0), max_force=10.0)
    polygon = support_polygon(Stance([*two_soles, hand], 1000.0))
    np.testing.assert_allclose(
        np.sort(polygon, axis=0),
        np.sort(np.array([[0.14, 0.16], [-0.14, 0.16], [-0.14, -0.16], [0.14, -0.16]]), axis=0),
    )
    assert support_polygon(Stance([hand])).shape == (0, 2)
    assert support_height(Stance([*two_soles, hand], 1000.0)) == 0.0


@pytest.mark.parametrize(
    ("where", "distance"),
    [((0.0, 0.0), 1.0), ((0.9, 0.0), 0.1), ((2.0, 0.0), -1.0), ((2.0, 2.0), -np.sqrt(2)), ((1.0, 0.3), 0.0)],
)
def test_signed_distance_to_a_square(where, distance):
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    assert signed_distance(where, square) == pytest.approx(distance)


def test_flat_polygons_have_no_inside():
    segment = convex_polygon([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]])
    assert len(segment) == 2
    np.testing.assert_allclose(
        signed_distance([[0.5, 0.0], [0.5, 0.2], [2.0, 0.0]], segment), [0.0, -0.2, -1.0]
    )
    assert len(convex_polygon([[1.0, 2.0], [1.0, 2.0]])) == 1
    assert signed_distance((0.0, 0.0), np.zeros((0, 2))) == -np.inf


def test_halfplanes_of_a_hull_give_the_hull():
    rng = np.random.default_rng(0)
    hull = convex_polygon(rng.normal(size=(30, 2)))
    edges = np.roll(hull, -1, axis=0) - hull
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    found = polygon_of_halfplanes(normals, (normals * hull).sum(axis=1))
    np.testing.assert_allclose(reach(found), reach(hull), atol=1e-9)
    assert len(found) == len(hull)
    assert polygon_of_halfplanes([[1, 0], [-1, 0], [0, 1], [0, -1]], [0, -1, 1, 1]).shape == (0, 2)
