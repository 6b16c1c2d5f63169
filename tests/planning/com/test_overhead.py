"""The bound of the CoM's height below an overhead obstacle."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.planning.com import CeilingHeight, Zone, height_below, keep_out

OUTLINE = np.array([[0.3, -1.0], [0.4, -1.0], [0.4, 1.0], [0.3, 1.0]])
FOOTPRINT = np.array([[0.2, 0.18], [-0.3, 0.18], [-0.3, -0.18], [0.2, -0.18]])
ZONE = Zone.below(OUTLINE, [FOOTPRINT], 0.15)
SURFACE = CeilingHeight(ZONE, free=1.08, low=0.64)
coordinates = st.floats(-3.0, 3.0)


def test_the_zone_is_where_the_footprint_meets_the_outline():
    """A footprint that reaches 0.2 m forward and 0.3 m back meets [0.3, 0.4] for x in [0.1, 0.7]."""
    inside, outside = [(0.101, 0.0), (0.699, 0.0), (0.4, 1.179)], [(0.099, 0.0), (0.701, 0.0), (0.4, 1.181)]
    for point in inside:
        assert np.all(ZONE.normals @ point <= ZONE.offsets)
        assert float(ZONE.share(*point)) == 1.0
    for point in outside:
        assert not np.all(ZONE.normals @ point <= ZONE.offsets)


def test_the_widest_of_several_headings_counts():
    """Turned by 90 degrees, the footprint of 0.2 m forward reaches 0.3 m instead of 0.18 m along y."""
    turned = FOOTPRINT @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    both = Zone.below(OUTLINE, [FOOTPRINT, turned], 0.15)
    assert float(both.share(0.35, 1.29)) == 1.0
    assert float(ZONE.share(0.35, 1.29)) < 1.0
    assert float(both.share(0.699, 0.0)) == 1.0


@given(x=coordinates, y=coordinates)
def test_the_surface_lies_between_its_heights_and_falls_towards_the_obstacle(x, y):
    """Half the way to the obstacle's middle the bound is never higher."""
    middle = OUTLINE.mean(axis=0)
    here = float(SURFACE(x, y))
    nearer = float(SURFACE(*(0.5 * (np.array([x, y]) + middle))))
    assert SURFACE.low - 1e-12 <= nearer <= here + 1e-12 <= SURFACE.free + 2e-12


@pytest.mark.filterwarnings("ignore::FutureWarning")  # CasADi announces a change of its numpy support
@given(x=st.floats(-0.3, 1.1), y=st.floats(-1.6, 1.6))
def test_the_surface_is_smooth_and_the_same_for_casadi(x, y):
    """Its symbolic gradient is the finite difference of the numbers; second derivatives are bounded."""
    symbols = ca.SX.sym("x"), ca.SX.sym("y")
    value = SURFACE(*symbols)
    function = ca.Function("f", symbols, [value, ca.gradient(value, ca.vertcat(*symbols))])
    symbolic, gradient = (np.asarray(item).ravel() for item in function(x, y))
    assert symbolic[0] == pytest.approx(float(SURFACE(x, y)), abs=1e-12)
    step = 1e-5
    numeric = [
        (float(SURFACE(x + step, y)) - float(SURFACE(x - step, y))) / (2 * step),
        (float(SURFACE(x, y + step)) - float(SURFACE(x, y - step))) / (2 * step),
    ]
    # The third derivative of the smootherstep is at most 60 / onset^3 of the drop.
    assert gradient == pytest.approx(numeric, abs=60 * 0.44 / 0.15**3 * step**2 + 1e-9)


def test_arrays_and_violations():
    """The constraint is the height above the surface, element-wise."""
    constraint = height_below("beam", SURFACE)
    points = np.array([[0.35, 0.0, 0.7], [0.35, 0.0, 0.6], [-2.0, 0.0, 1.0]])
    assert constraint.violation(points) == pytest.approx([0.06, -0.04, -0.08])
    assert constraint.name == "height below 'beam'"


def test_nothing_passes_through_a_zone_that_is_kept_out_of():
    """At any height; outside the onset there is room to spare."""
    constraint = keep_out("beam", ZONE, "nobody folds that low")
    points = np.array([[0.35, 0.0, -5.0], [0.35, 0.0, 5.0], [-0.1, 0.0, 0.9]])
    assert constraint.violation(points) == pytest.approx([0.075, 0.075, -0.075])
    assert constraint.impassable == "nobody folds that low"


def test_crossing():
    """Lines through the zone, into it and past it."""
    assert ZONE.crosses((-1.0, 0.0), (2.0, 0.0))
    assert ZONE.crosses((-1.0, 0.0), (0.3, 0.0))
    assert not ZONE.crosses((-1.0, 0.0), (0.0, 0.0))
    assert not ZONE.crosses((-1.0, 1.5), (2.0, 1.5))
    assert not ZONE.crosses((0.0, -3.0), (0.0, 3.0))


def test_a_bound_that_rises_towards_the_obstacle_is_refused():
    """One line with both heights."""
    with pytest.raises(InputError, match=r"height below an obstacle is 1\.2 m and 1\.0 m away"):
        CeilingHeight(ZONE, free=1.0, low=1.2)
