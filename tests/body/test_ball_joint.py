"""Rotations of a ball joint and the angles of its three hinges are the same thing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from manikin.body import Configuration, human
from manikin.body.joint_volume import ball_angles, ball_rotation
from manikin.errors import BodyError

JOINTS = ("left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm", "lumbar", "neck")


@pytest.mark.parametrize("name", JOINTS)
def test_rotation_is_that_of_the_body(name):
    body, rng = human(), np.random.default_rng(3)
    part = body.segment(name)
    angles = rng.uniform([h.lower for h in part.hinges], [h.upper for h in part.hinges])
    state = Configuration(body, body.posture({h.name: a for h, a in zip(part.hinges, angles, strict=True)}))
    wanted = state.segment_placement(part.parent)[0].T @ state.segment_placement(name)[0]
    np.testing.assert_allclose(ball_rotation([h.axis for h in part.hinges], angles), wanted, atol=1e-12)


@given(arrays(float, 4, elements=st.floats(-1.0, 1.0)), st.sampled_from(JOINTS), st.floats(-3.0, 3.0))
def test_angles_give_the_rotation_back(quaternion, name, middle):
    """Any rotation, the singular ones among them, to 1e-7; angles lie within half a turn of the middle."""
    if np.linalg.norm(quaternion) < 1e-3:
        return
    rotation = Rotation.from_quat(quaternion).as_matrix()
    axes = [hinge.axis for hinge in human().segment(name).hinges]
    angles = ball_angles(axes, rotation, (middle, 0.0, -middle))
    np.testing.assert_allclose(ball_rotation(axes, angles), rotation, atol=1e-7)
    assert np.all(np.abs(angles - [middle, 0.0, -middle]) <= np.pi + 1e-12)


def test_oblique_hinges_are_refused():
    with pytest.raises(BodyError, match="perpendicular"):
        ball_angles(np.array([[1, 0, 0], [0.6, 0.8, 0], [0, 0, 1]]), np.eye(3))
