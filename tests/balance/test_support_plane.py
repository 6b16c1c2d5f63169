"""The ZMP of level and tilted stances in one plane."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.balance import least_zmp_distance, pseudo_wrench, support_plane, wrench_polytope
from manikin.contact import Stance, grasp, sole
from manikin.numerics.spatial import rotation_from_rpy

SOLE = {"length": 0.28, "width": 0.12, "friction": 0.7}


def feet(tilt):
    normal = rotation_from_rpy(tilt, 0.0, 0.0)[:, 2]
    turn = rotation_from_rpy(tilt, 0.0, 0.0)
    return Stance(
        [
            sole("left_foot", turn @ (-0.1, 0.0, 0.0), np.pi / 2, normal=normal, **SOLE),
            sole("right_foot", turn @ (0.1, 0.3, 0.0), np.pi / 2, normal=normal, **SOLE),
        ],
        2000.0,
    )


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.4, 0.8))
def test_a_body_at_rest_has_its_zmp_on_the_vertical_below_it(tilt, x, y):
    """Gravity acts along the vertical through the CoM, on a slope too; the ZMP lies on that line."""
    plane = support_plane(feet(tilt))
    com = np.array([x, y, 0.9])
    place = plane.zero_moment_point(pseudo_wrench(60.0, com, np.zeros(3)))
    world = plane.origin + plane.rotation_plane_to_world[:, :2] @ place
    assert world[:2] == pytest.approx(com[:2], abs=1e-9)


@given(st.floats(-0.25, 0.25), st.integers(0, 2**32 - 1))
def test_every_admissible_wrench_has_its_zmp_inside(tilt, seed):
    """Unilateral contacts in one plane cannot have their ZMP outside their hull."""
    stance = feet(tilt)
    W = wrench_polytope(stance)
    rng = np.random.default_rng(seed)
    com = rng.uniform((-0.3, -0.3, 0.6), (0.3, 0.6, 1.1), (200, 3))
    wrench = pseudo_wrench(60.0, com, rng.uniform(-3.0, 3.0, (200, 3)))
    inside = wrench[W.margin(wrench) >= 0]
    if len(inside):
        assert support_plane(stance).zmp_distance(inside).min() >= -1e-9


def test_stances_outside_one_plane_have_none():
    """Steps, slopes in two directions and grasps have no ZMP in a plane of support."""
    level = sole("left_foot", (0.0, 0.0, 0.0), **SOLE)
    higher = sole("right_foot", (0.0, 0.3, 0.1), **SOLE)
    tilted = sole("right_foot", (0.0, 0.3, 0.0), normal=(0.1, 0.0, 1.0), **SOLE)
    hold = grasp("left_hand", (0.0, 0.0, 1.0), max_force=100.0)
    for other in (higher, tilted, hold):
        assert support_plane(Stance([level, other], 1000.0)) is None
    assert support_plane(Stance([], None)) is None
    assert least_zmp_distance([(Stance([level, higher], 1000.0), np.zeros((1, 6)))]) is None
