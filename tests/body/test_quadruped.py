"""The built-in quadruped: it stands on four points, its legs mirrored, its mass as asked for."""

import numpy as np
import pytest

from manikin.body import Configuration, are_mirrored, quadruped
from manikin.errors import BodyError


@pytest.mark.parametrize(("length", "mass"), [(0.8, 32.0), (0.5, 9.0)])
def test_it_stands_on_four_points_with_normals_up(length, mass):
    """Feet level below their hips to 1e-12 m, centre of mass inside them."""
    body = quadruped(length, mass)
    assert body.mass == pytest.approx(mass)
    state = Configuration(body, body.standing_posture())
    feet = [state.effector_placement(limb.effector) for limb in body.limbs]
    heights = [place[2] for _, place in feet]
    np.testing.assert_allclose(heights, 0.0, atol=1e-12)
    for rotation, _ in feet:
        np.testing.assert_allclose(rotation[:, 2], [0.0, 0.0, 1.0], atol=1e-12)
    places = np.array([place for _, place in feet])
    assert places[:, 0].min() < state.com[0] < places[:, 0].max()
    for limb in body.limbs:
        assert are_mirrored(body, limb, next(other for other in body.limbs if other.name == limb.mirror))


def test_sizes_that_are_not_positive_are_refused():
    with pytest.raises(BodyError, match="quadruped length"):
        quadruped(0.0)


def test_it_touches_with_its_tips():
    """Where a foot's shapes meet level ground is within 3 mm of its tip, up to a lean of 45 deg."""
    body = quadruped(0.8, 32.0)
    for limb in body.limbs:
        tip = body.effector(limb.effector)
        for lean in np.deg2rad([0.0, 38.0, 45.0]):
            up = np.array([np.sin(lean), 0.0, np.cos(lean)])  # of the ground, seen from the foot
            for shape in body.segment(tip.segment).shapes:
                end = shape.translation - 0.5 * shape.size[1] * np.array([0.0, 0.0, 1.0]) - shape.size[0] * up
                assert np.linalg.norm(end - tip.translation) < 0.003
                assert abs((end - tip.translation) @ up) < 0.001
