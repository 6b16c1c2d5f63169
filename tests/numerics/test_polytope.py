import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize

from manikin.errors import PolytopeError
from manikin.numerics.polytope import Polytope, convex_hull, vertices_around

CUBE = Polytope(np.vstack([np.eye(3), -np.eye(3)]), np.ones(6))
seeds = st.integers(0, 10_000)


def polytope_of(*generators):
    """Hull of points, plus segments where given."""
    return Polytope(*convex_hull(*generators))


def vertices_of(P):
    return vertices_around(P.H, P.h, P.inscribed_ball()[0])


def in_hull(points, x):
    """Say, independently, whether x is a convex combination of the points."""
    n = len(points)
    A = np.vstack([points.T, np.ones(n)])
    return linprog(np.zeros(n), A_eq=A, b_eq=np.append(x, 1.0), method="highs").status == 0


def test_rows_are_normalised_so_that_margins_are_distances():
    P = Polytope([[2.0, 0.0], [0.0, -3.0]], [4.0, 3.0])
    np.testing.assert_allclose(np.linalg.norm(P.H, axis=1), 1.0)
    np.testing.assert_allclose(P.h, [2.0, 1.0])
    assert P.margin([0.0, 0.0]) == pytest.approx(1.0)


def test_arrays_are_read_only_and_copied():
    H = np.eye(2)
    P = Polytope(H, np.ones(2))
    H[0, 0] = 5.0
    assert P.H[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        P.h[0] = 3.0


def test_margin_is_vectorised_over_any_leading_shape():
    points = np.random.default_rng(0).normal(size=(4, 5, 3))
    margins = CUBE.margin(points)
    assert margins.shape == (4, 5)
    np.testing.assert_allclose(margins, CUBE.distances(points).min(axis=-1), atol=1e-15)
    assert CUBE.margin(np.zeros((0, 3))).shape == (0,)


def test_margin_of_many_points_is_the_margin_of_each():
    """Blocks of the vectorised product do not mix up points."""
    rng = np.random.default_rng(1)
    P = polytope_of(rng.normal(size=(40, 6)))
    points = rng.normal(size=(7001, 6))
    np.testing.assert_allclose(P.margin(points), (P.h - points @ P.H.T).min(axis=1), atol=1e-12)


def test_inscribed_ball_of_a_right_triangle():
    """Legs 3 and 4, hypotenuse 5: the incircle has radius 1 about (1, 1)."""
    P = Polytope([[-1.0, 0.0], [0.0, -1.0], [4.0, 3.0]], [0.0, 0.0, 12.0])
    centre, radius = P.inscribed_ball()
    assert radius == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(centre, [1.0, 1.0], atol=1e-9)


def test_empty_and_unbounded_polytopes_say_so():
    empty = Polytope([[1.0], [-1.0]], [-1.0, -1.0])
    with pytest.raises(PolytopeError, match="empty"):
        empty.inscribed_ball()
    half = Polytope([[1.0, 0.0]], [1.0])
    with pytest.raises(PolytopeError, match="any size"):
        half.inscribed_ball()
    with pytest.raises(PolytopeError):
        vertices_of(Polytope([[1.0, 0.0], [-1.0, 0.0]], [1.0, 1.0]))


def test_a_violated_row_of_zeros_makes_a_polytope_empty():
    with pytest.raises(PolytopeError, match="empty"):
        Polytope([[0.0, 0.0], [1.0, 0.0]], [-1.0, 1.0]).inscribed_ball()
    assert len(Polytope([[0.0, 0.0], [1.0, 0.0]], [1.0, 1.0])) == 1


@pytest.mark.parametrize(
    ("H", "h"), [([[1.0, 0.0]], [1.0, 2.0]), ([1.0, 0.0], [1.0]), ([[np.nan]], [1.0]), ([[1.0]], [np.inf])]
)
def test_malformed_rows_are_refused(H, h):
    with pytest.raises(PolytopeError, match="valid"):
        Polytope(H, h)


def test_points_of_another_dimension_are_refused():
    with pytest.raises(PolytopeError, match=r"valid: \(\.\.\., 3\)"):
        CUBE.margin([0.0, 0.0])


@pytest.mark.parametrize("points", [np.zeros((0, 3)), [[np.nan, 0.0]], [1.0, 2.0]])
def test_hulls_of_nothing_or_of_nan_are_refused(points):
    with pytest.raises(PolytopeError):
        polytope_of(points)


def test_cube_has_six_facets_whatever_its_interior_points():
    """Coplanar simplices are merged: H is minimal."""
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 4)).reshape(4, -1).T
    P = polytope_of(np.vstack([corners, 0.5 * corners, np.zeros((3, 4))]))
    assert len(P) == 8
    np.testing.assert_allclose(P.h, 1.0, atol=1e-12)


def test_vertices_round_trip():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(12, 3))
    found = vertices_of(polytope_of(points))
    assert all(np.abs(points - v).max(axis=1).min() < 1e-9 for v in found)


@given(seeds, st.integers(2, 6))
def test_hull_agrees_with_convex_combinations(seed, dimension):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(dimension + 1 + int(rng.integers(0, 12)), dimension))
    P = polytope_of(points)
    assert P.margin(points).min() > -1e-12
    for x in rng.normal(size=(10, dimension)) * 0.5:
        margin = P.margin(x)
        if abs(margin) > 1e-7:  # the tolerance of the linear program
            assert in_hull(points, x) == (margin > 0)


@given(seeds, st.integers(2, 6), st.integers(0, 5))
def test_flat_hulls_hold_their_points_and_nothing_beside_them(seed, dimension, rank):
    """Margin 0 on the flat; off it, minus the largest component across it."""
    rank = min(rank, dimension - 1)
    rng = np.random.default_rng(seed)
    frame = np.linalg.qr(rng.normal(size=(dimension, dimension)))[0]
    points = 3.0 + rng.normal(size=(rank + 4, rank)) @ frame[:rank]
    P = polytope_of(points)
    mean = points.mean(axis=0)
    assert np.abs(P.margin(np.vstack([points, mean]))).max() < 1e-10
    assert P.margin(points).min() >= -1e-14
    off = frame[rank]
    least = 0.25 / np.sqrt(dimension - rank)
    for x in (mean + 0.25 * off, mean - 0.25 * off):
        assert -0.25 - 1e-10 <= P.margin(x) <= -least + 1e-10


@given(seeds)
def test_margin_inside_is_the_distance_to_the_complement(seed):
    """The ball of the margin's radius fits, a larger one does not."""
    rng = np.random.default_rng(seed)
    P = polytope_of(rng.normal(size=(15, 3)))
    centre, _ = P.inscribed_ball()
    x = centre + 0.1 * rng.normal(size=3)
    margin = float(P.margin(x))
    directions = rng.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    if margin > 0:
        assert P.margin(x + 0.999 * margin * directions).min() > 0
        nearest = P.H[np.argmin(P.distances(x))]
        assert P.margin(x + 1.001 * margin * nearest) < 0


@given(seeds)
def test_margin_outside_is_a_lower_bound_of_the_distance_and_exact_before_a_facet(seed):
    rng = np.random.default_rng(seed)
    P = polytope_of(rng.normal(size=(10, 3)))
    row = int(rng.integers(len(P)))
    vertices = vertices_of(P)
    foot = vertices[np.abs(P.H[row] @ vertices.T - P.h[row]) < 1e-9].mean(axis=0)
    x = foot + 0.3 * P.H[row]
    projection = minimize(
        lambda y: ((y - x) ** 2).sum(),
        foot,
        jac=lambda y: 2 * (y - x),
        constraints={"type": "ineq", "fun": lambda y: P.h - P.H @ y, "jac": lambda _: -P.H},
        method="SLSQP",
        options={"ftol": 1e-14},
    )
    # SLSQP stops at about 1e-6 of the distance.
    assert np.sqrt(projection.fun) == pytest.approx(0.3, abs=1e-5)
    assert P.margin(x) == pytest.approx(-0.3, abs=1e-9)


@given(seeds, st.integers(2, 5), st.integers(1, 5))
def test_sum_with_segments_equals_the_hull_of_all_corners(seed, dimension, count):
    """Refining the normal fan and brute force give the same facets, flat sums included."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(1, 8)), dimension))
    segments = rng.normal(size=(count, dimension))
    if count > 2:
        segments[-1] = 2.0 * segments[0] if rng.random() < 0.3 else segments[-1]
    P = polytope_of(points, segments)
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * count)).reshape(count, -1).T
    corners = (points[:, None] + signs @ segments).reshape(-1, dimension)
    Q = polytope_of(corners)
    assert len(P) == len(Q)
    weights = rng.normal(size=(50, len(corners)))  # points of the affine hull
    tests = weights / weights.sum(axis=1)[:, None] @ corners
    tests = tests[np.abs(tests).max(axis=1) < 100.0]
    np.testing.assert_allclose(P.margin(tests), Q.margin(tests), atol=1e-8)


def test_zonotope_facets_are_counted():
    """Five segments in general position in space have 5 * 4 facets."""
    segments = np.random.default_rng(3).normal(size=(5, 3))
    assert len(polytope_of(np.zeros((1, 3)), segments)) == 20


def test_intersection_holds_what_both_hold():
    shifted = Polytope(CUBE.H, CUBE.h + CUBE.H @ np.array([1.0, 0.0, 0.0]))
    both = CUBE.intersection(shifted)
    points = np.random.default_rng(4).uniform(-2, 2, size=(200, 3))
    np.testing.assert_allclose(both.margin(points), np.minimum(CUBE.margin(points), shifted.margin(points)))
    assert both.inscribed_ball()[1] == pytest.approx(0.5)


def test_preimage_is_a_slice():
    """The plane z = 0.5 of the cube is a square of half side 1."""
    matrix = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    square = CUBE.preimage(matrix, [0.0, 0.0, 0.5])
    assert len(square) == 4
    assert square.margin([0.0, 0.25]) == pytest.approx(0.75)
    with pytest.raises(PolytopeError, match="empty"):
        CUBE.preimage(matrix, [0.0, 0.0, 1.5]).inscribed_ball()
