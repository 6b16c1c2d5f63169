"""Terms of a posture: every Jacobian is the derivative of its residual."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.body import human
from manikin.body.configuration import Configuration, random_configuration
from manikin.kinematics.posture_terms import (
    ClearanceTerm,
    ComTerm,
    EdgeTerm,
    LimitTerm,
    PositionTerm,
    ReferenceTerm,
    RotationTerm,
    UprightTerm,
)
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene import Box, Obstacle, Proximity, Scene
from manikin.scene.distance import NOTHING

BODY = human()
TERMS = {
    "position": PositionTerm("left_hand", np.array([0.3, -0.2, 1.1])),
    "rotation": RotationTerm("right_foot", rotation_from_rpy(0.3, -0.5, 2.0)),
    "com": ComTerm(np.array([0.1, 0.2, 0.9])),
    "com height": ComTerm(np.array([np.nan, np.nan, 0.9])),
    "upright": UprightTerm(("thorax", "head")),
    "edge": EdgeTerm(
        "left_foot",
        np.array([0.06, 0.0, 0.0]),
        np.array([0.1, 0.2, 0.3]),
        rotation_from_rpy(0.1, -0.2, 0.5),
        0.0,
        0.9,
        6 + BODY.joint_index("left_toe_extension"),
    ),
    "rolling edge": EdgeTerm(
        "buttocks",
        np.array([0.07, 0.0, 0.05]),
        np.array([0.1, 0.2, 0.3]),
        rotation_from_rpy(0.1, -0.2, 0.5),
        0.0,
        0.5,
        radius=0.05,
    ),
    "reference": ReferenceTerm(BODY.standing_posture()[7:]),
}
seeds = st.integers(0, 10_000)


def numerical_jacobian(residual, q, h=1e-6):
    columns = []
    for k in range(BODY.nv):
        step = np.zeros(BODY.nv)
        step[k] = h
        forward = residual(pin.integrate(BODY.pinocchio, q, step))
        backward = residual(pin.integrate(BODY.pinocchio, q, -step))
        columns.append((forward - backward) / (2 * h))
    return np.array(columns).T


@pytest.mark.parametrize("name", list(TERMS))
@given(seed=seeds)
@settings(max_examples=8)
def test_jacobian_is_the_derivative(name, seed):
    """Central differences with h = 1e-6 are good to about 1e-9 / h * eps: 1e-6 allows for turns near pi."""
    term, configuration = TERMS[name], Configuration(BODY)
    q = random_configuration(BODY, np.random.default_rng(seed))
    jacobian = term.evaluate(configuration.update(q)).jacobian
    if name == "rotation" and np.linalg.norm(term.evaluate(configuration).residual) > 3.0:
        return  # the logarithm is not differentiable at a half turn
    expected = numerical_jacobian(lambda p: term.evaluate(configuration.update(p)).residual, q)
    np.testing.assert_allclose(jacobian, expected, atol=2e-6)


@given(seed=seeds)
@settings(max_examples=6)
def test_clearance_gradient_is_the_derivative(seed):
    """Distances to a box and between limbs, near the standing posture where faces are smooth."""
    rng = np.random.default_rng(seed)
    scene = Scene([Obstacle("box", Box((0.3, 2.0, 0.4)), translation=(0.45, 0, 1.0))], floor_height=None)
    term = ClearanceTerm(Proximity(BODY, scene), 0.02, 0.005, 0.1, NOTHING)
    q = BODY.standing_posture()
    q[7:] = np.clip(q[7:] + rng.uniform(-0.05, 0.05, len(q) - 7), BODY.lower, BODY.upper)
    configuration = Configuration(BODY)
    found, pairs = term.evaluate(configuration.update(q))

    def distances(p):
        near, here = term.evaluate(configuration.update(p))
        table = dict(zip(here, near.residual, strict=True))
        return np.array([table.get(pair, np.nan) for pair in pairs])

    expected = numerical_jacobian(distances, q, 1e-5)
    smooth = np.all(np.isfinite(expected), axis=1)  # pairs at the edge of the activation come and go
    assert smooth.sum() >= 5
    # The nearest points slide over edges of boxes: a few entries differ by what they slid.
    error = np.abs(found.jacobian - expected)[smooth]
    assert np.quantile(error, 0.98) < 1e-4


def test_self_distances_have_their_own_safety_distance():
    """0.05 m to obstacles and 0.01 m between limbs are subtracted from the same distances."""
    proximity = Proximity(BODY, Scene())
    configuration = Configuration(BODY)
    plain, pairs = ClearanceTerm(proximity, 0.0, 0.0, 0.15, NOTHING).evaluate(configuration)
    kept, kept_pairs = ClearanceTerm(proximity, 0.05, 0.01, 0.10, NOTHING).evaluate(configuration)
    table = dict(zip(pairs, plain.residual, strict=True))
    for pair, value in zip(kept_pairs, kept.residual, strict=True):
        assert table[pair] - value == pytest.approx(0.01 if "/" in pair[1] else 0.05, abs=1e-9)


def test_limits_name_the_hinges_at_their_ends():
    """Only the hinge put at its end is named."""
    q = BODY.posture(dict(BODY.standing_angles))
    middle = 0.5 * (BODY.lower + BODY.upper)
    q[7:] = middle
    index = BODY.joint_index("left_knee_flexion")
    q[7 + index] = BODY.upper[index]
    assert LimitTerm(BODY).at_limit(Configuration(BODY, q)) == ("left_knee_flexion",)


def test_terms_describe_what_they_miss():
    """In metres and degrees, with the name."""
    assert TERMS["position"].describe(np.array([0.03, 0, 0.04])) == (
        "placement 'left_hand' misses its position by 0.0500 m"
    )
    assert "10.00 deg" in TERMS["rotation"].describe(np.array([np.deg2rad(10), 0, 0]))
    assert TERMS["com height"].describe(np.array([-0.02])) == (
        "centre of mass misses by 0.0200 m (z -0.0200)"
    )
