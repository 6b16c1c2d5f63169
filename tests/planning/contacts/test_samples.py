"""Samples of limbs: what they hold, their mirror images, their index."""

import numpy as np
import pytest

from manikin.body import Configuration, NaturalRange, limb_named, limb_placement
from manikin.body.limbs import limb_slots
from manikin.errors import BodyError
from manikin.kinematics.limb_samples import manipulability, mirrored_samples, sample_limb, sample_limbs


@pytest.mark.parametrize("name", ["left_arm", "right_leg", "left_knee"])
def test_samples_are_configurations_of_the_body_within_the_joint_ranges(person, person_samples, name):
    """Effector, rotation and ``J J^T`` against Pinocchio; manipulability is the ellipsoid's volume."""
    samples, limb = person_samples[name], limb_named(person, name)
    slots = limb_slots(person, limb)
    lower, upper = person.lower[slots - 7], person.upper[slots - 7]
    assert ((samples.angles >= lower) & (samples.angles <= upper)).all()
    for row in (0, 7, 2999):
        q = person.standing_posture()
        q[slots] = samples.angles[row]
        state = Configuration(person, q)
        rotation, origin = limb_placement(state, limb)
        turn, place = state.effector_placement(limb.effector)
        assert np.allclose(origin + rotation @ samples.positions[row], place, atol=1e-9)
        assert np.allclose(rotation @ samples.rotations[row], turn, atol=1e-9)
        jacobian = rotation.T @ state.effector_jacobian(limb.effector)[:3, slots - 1]
        assert np.allclose(samples.products[row], jacobian @ jacobian.T, atol=1e-9)
        lengths = np.linalg.svd(jacobian, compute_uv=False)
        assert samples.manipulability[row] == pytest.approx(np.prod(lengths), abs=1e-9)


def test_no_sample_is_nearly_singular(person, person_samples):
    samples = person_samples["left_arm"]
    assert samples.manipulability.min() >= samples.threshold > 0.0
    free = sample_limb(person, samples.limb, np.random.default_rng(0), 10_000, threshold=0.0)
    assert free.manipulability.min() < samples.threshold
    assert samples.threshold == pytest.approx(0.05 * free.manipulability.max())


def test_the_same_seed_gives_the_same_samples(person):
    limb = limb_named(person, "left_leg")
    first, second = (sample_limb(person, limb, np.random.default_rng(3), 200) for _ in range(2))
    assert np.array_equal(first.angles, second.angles)


def test_mirrored_samples_are_those_that_the_other_side_would_have(person, person_samples):
    """By reflection, against the forward kinematics of the other side."""
    left, right = person_samples["left_arm"], person_samples["right_arm"]
    assert left.angles is right.angles
    slots = limb_slots(person, right.limb)
    for row in range(5):
        q = person.standing_posture()
        q[slots] = right.angles[row]
        state = Configuration(person, q)
        rotation, origin = limb_placement(state, right.limb)
        turn, place = state.effector_placement("right_hand")
        assert np.allclose(origin + rotation @ right.positions[row], place, atol=1e-9)
        assert np.allclose(rotation @ right.rotations[row], turn, atol=1e-9)
        jacobian = rotation.T @ state.effector_jacobian("right_hand")[:3, slots - 1]
        assert np.allclose(right.products[row], jacobian @ jacobian.T, atol=1e-9)
    assert np.allclose(right.reach.vertices.min(axis=0)[1], -left.reach.vertices.max(axis=0)[1])


def test_samples_are_not_mirrored_onto_another_limb(person, person_samples):
    with pytest.raises(BodyError, match="no reflection of 'left_arm'; valid: right_arm"):
        mirrored_samples(person, person_samples["left_arm"], limb_named(person, "right_leg"))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"count": 1}, "count is 1"),
        ({"threshold": -1.0}, "threshold"),
        ({"threshold": 2.0}, "smaller threshold"),
    ],
)
def test_misuse_is_refused(person, values, message):
    with pytest.raises(BodyError, match=message):
        sample_limb(
            person, limb_named(person, "left_arm"), np.random.default_rng(0), **{"count": 100, **values}
        )


def test_manipulability_is_the_root_of_the_determinant():
    jacobians = np.random.default_rng(1).standard_normal((50, 3, 6))
    products = jacobians @ jacobians.transpose(0, 2, 1)
    assert np.allclose(manipulability(products) ** 2, np.linalg.det(products))


def test_natural_samples_keep_to_the_learnt_ranges(person, creature):
    """About a quarter of the box of an arm's intervals is left; limbs without volumes are as before."""
    arm, leg = limb_named(person, "left_arm"), limb_named(creature, "left_front_leg")
    reach = NaturalRange(person, arm)
    plain, natural = (
        sample_limb(person, arm, np.random.default_rng(1), 3000, natural=flag) for flag in (False, True)
    )
    assert natural.natural
    assert not plain.natural
    assert reach.normalised(natural.angles).min() >= 0.0
    assert 0.15 < (reach.normalised(plain.angles) >= 0.0).mean() < 0.45
    for name in ("left_knee", "left_leg"):
        limb = limb_named(person, name)
        samples = sample_limb(person, limb, np.random.default_rng(1), 500, natural=True)
        assert NaturalRange(person, limb).normalised(samples.angles).min() >= 0.0
    same = [
        sample_limb(creature, leg, np.random.default_rng(1), 300, natural=f).angles for f in (False, True)
    ]
    np.testing.assert_array_equal(*same)


def test_mirrored_natural_samples_are_natural(person):
    samples = sample_limbs(person, np.random.default_rng(0), 500, natural=True)
    right = samples["right_leg"]
    assert right.natural
    assert NaturalRange(person, right.limb).normalised(right.angles).min() >= 0.0
