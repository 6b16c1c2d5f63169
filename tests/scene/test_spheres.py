import numpy as np
import pinocchio as pin
import pytest

from manikin.errors import SceneError
from manikin.scene import Box, Capsule, Obstacle, Plane, Proximity, Scene, SphereProximity

SCENE = Scene(
    [
        Obstacle("platform", Box((1.0, 1.0, 0.2)), translation=(1.0, 0.0, 0.1)),
        Obstacle("pillar", Capsule(0.05, 1.2), translation=(0.4, 0.5, 0.8)),
        Obstacle("wall", Plane((0.0, 1.0, 0.0), -0.6)),
    ]
)
FAR = 100.0


@pytest.fixture(scope="module")
def spheres(person):
    return SphereProximity(person, SCENE)


def wander(person, rng):
    step = rng.normal(size=person.nv) * 0.4
    return pin.integrate(person.pinocchio, person.standing_posture(), step)


def test_sphere_distances_never_exceed_the_clearance(person, spheres):
    """They are what touches when the shapes touch, and less than the clearance when they do not."""
    exact = Proximity(person, SCENE)
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = wander(person, rng)
        rough, true = spheres.evaluate(q, FAR), exact.evaluate(q, FAR)
        assert rough.pairs == true.pairs
        assert np.all(rough.distance <= np.maximum(true.distance, 0.0) + 1e-9)


def test_more_spheres_come_closer_to_the_truth(person):
    q = wander(person, np.random.default_rng(1))
    exact = Proximity(person, SCENE).evaluate(q, FAR).distance
    clear = exact > 0.0
    errors = [
        np.mean((exact - SphereProximity(person, SCENE, count=count).evaluate(q, FAR).distance)[clear])
        for count in (2, 8, 64)
    ]
    assert errors[0] > errors[1] > errors[2] > 0.0


def test_gradients_are_the_central_differences(person, spheres):
    """Spheres are smooth: a step of 1e-6 leaves 1e-10 of rounding; 1e-6 is far above both."""
    rng = np.random.default_rng(2)
    for _ in range(2):
        q = wander(person, rng)
        gradient = spheres.evaluate(q, FAR).gradient
        for direction in range(person.nv):
            step = 1e-6 * np.eye(person.nv)[direction]
            ahead = spheres.evaluate(pin.integrate(person.pinocchio, q, step), FAR).distance
            behind = spheres.evaluate(pin.integrate(person.pinocchio, q, -step), FAR).distance
            error = np.abs((ahead - behind) / 2e-6 - gradient[:, direction])
            assert np.quantile(error, 0.99) < 1e-6  # a pair may switch spheres within the step


def test_nearest_points_and_normals_agree_with_the_distance(person, spheres):
    result = spheres.evaluate(wander(person, np.random.default_rng(3)), FAR)
    gap = np.einsum("ki,ki->k", result.normal, result.on_other - result.on_body)
    assert np.allclose(gap, result.distance, atol=1e-9)
    assert np.allclose(np.linalg.norm(result.normal, axis=1), 1.0)


def test_activation_ignore_and_minimum_work_as_for_exact_distances(person, spheres):
    q = person.standing_posture()
    everything = spheres.evaluate(q, FAR)
    close = spheres.evaluate(q, 0.05)
    assert np.array_equal(close.distance, everything.distance[everything.distance < 0.05])
    assert spheres.minimum(q).distance == everything.distance.min()
    pair = spheres.minimum(q).pair
    assert pair not in spheres.evaluate(q, FAR, frozenset({pair})).pairs
    alone = SphereProximity(person, Scene([], None), self_collision=False)
    assert alone.minimum(q).pair is None
    assert alone.evaluate(q).gradient.shape == (0, person.nv)


def test_counts_can_be_given_by_name(person):
    """The published counts: pillar 20, sill 10 ([Qiu2012]_ Table 7.2)."""
    given = SphereProximity(person, SCENE, count={"pillar": 20, "platform": 10, "head/skull": 1})
    assert len(given.obstacle_covers["pillar"]) == 20
    assert len(given.obstacle_covers["platform"]) <= 10
    assert len(given.body_covers["head/skull"]) == 1
    assert "floor" not in given.obstacle_covers
    with pytest.raises(SceneError, match="count is 0"):
        SphereProximity(person, SCENE, count=0)
    with pytest.raises(SceneError, match="nan"):
        given.evaluate(np.full(person.nq, np.nan))
