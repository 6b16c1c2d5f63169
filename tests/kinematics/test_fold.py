"""How low a body folds under a ceiling."""

import numpy as np
import pytest

from manikin.body import Configuration, human, insect
from manikin.errors import BodyError
from manikin.kinematics.fold import FEET_APART, HEAD_CLEARANCE, STEP, fold_under, level_feet, lowest_ceiling
from manikin.scene import Box, Obstacle, Proximity, Scene

BODY = human(1.75, 79.0)


@pytest.mark.parametrize("height", [1.45, 1.30, 1.10])
def test_the_folded_body_is_below_the_ceiling_with_room(height):
    """Every shape keeps the clearance, measured afresh, with the CoM at the stated height."""
    fold = fold_under(BODY, height)
    assert fold is not None
    ceiling = Obstacle("ceiling", Box((10.0, 10.0, 1.0)), translation=(0.0, 0.0, height + 0.5))
    distances = Proximity(BODY, Scene([ceiling], floor_height=None)).minimum(fold.q, frozenset())
    assert distances.distance >= min(HEAD_CLEARANCE - 1e-3, 0.005 - 1e-3)
    near = Proximity(BODY, Scene([ceiling], floor_height=None), self_collision=False)
    assert near.minimum(fold.q, frozenset()).distance >= HEAD_CLEARANCE - 1e-3
    configuration = Configuration(BODY, fold.q)
    assert configuration.com[2] == pytest.approx(fold.com_height, abs=1e-6)
    assert np.all(fold.q[7:] >= BODY.lower)
    assert np.all(fold.q[7:] <= BODY.upper)
    assert fold.squat <= fold.com_height <= fold.stoop


def test_lower_ceilings_mean_a_lower_centre_of_mass():
    """Strictly falling from standing to 0.8 m; above the head nothing changes."""
    heights = [2.2, 1.6, 1.45, 1.3, 1.1, 0.8]
    found = [fold_under(BODY, height).com_height for height in heights]
    assert np.all(np.diff(found) < -0.02)


@pytest.mark.parametrize(("height", "recorded"), [(1.45, 0.85), (1.30, 0.80), (1.10, 0.65)])
def test_heights_are_those_of_people(height, recorded):
    """[Qiu2012]_ 3.2.3 gives "about" 0.85, 0.80 and 0.65 m for a stature of 1.75 m; ours within 3 cm."""
    assert fold_under(BODY, height).com_height == pytest.approx(recorded, abs=0.03)


def test_nobody_folds_below_a_knee_high_ceiling():
    """Under 0.4 m there is no posture on both feet; the least ceiling found is one where there is one."""
    assert fold_under(BODY, 0.4) is None
    lowest = lowest_ceiling(BODY)
    assert 0.5 < lowest < 0.85
    assert fold_under(BODY, lowest) is not None
    assert fold_under(BODY, lowest - STEP) is None


def test_the_footprint_covers_trunk_and_head():
    """Bent under 1.1 m the head is in front of the CoM, the hips behind it, shoulders on both sides."""
    fold = fold_under(BODY, 1.1)
    head = Configuration(BODY, fold.q).effector_placement("head")[1] - Configuration(BODY, fold.q).com
    (front, left), (back, right) = fold.footprint[0], fold.footprint[2]
    assert back < -0.2 < head[0] < front
    assert right < -0.15 < 0.15 < left


@pytest.mark.parametrize("stature", [1.52, 1.75, 1.93])
def test_feet_of_a_person_stand_side_by_side_as_far_apart_as_the_stature_asks(stature):
    """Whole soles on the floor, mirrored in the plane y = 0; a body without soles is refused."""
    left, right = level_feet(human(stature, 24.0 * stature**2))
    assert (left.effector, right.effector) == ("left_foot", "right_foot")
    np.testing.assert_allclose(left.position, [0.0, 0.5 * FEET_APART * stature, 0.0])
    np.testing.assert_array_equal(left.position, right.position * [1.0, -1.0, 1.0])
    np.testing.assert_array_equal(left.points, right.points)
    with pytest.raises(BodyError, match="has no stature or soles"):
        level_feet(insect())
