"""Algorithm 3: poses near the scene, triangles in the wanted mixture."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.planning.guide import Condition, ReachabilityChecker
from manikin.planning.guide.sampler import PoseSampler, SamplingRegion
from manikin.scene import Box, Obstacle, Scene

SCENE = Scene(
    [
        Obstacle("block", Box((1.0, 1.0, 0.5)), translation=(0.0, 0.0, 0.25)),
        Obstacle("hold", Box((0.1, 0.1, 0.1)), translation=(1.0, 0.0, 1.0)),
    ]
)
REGION = SamplingRegion(
    (-1.5, -1.5, 0.0), (1.5, 1.5, 1.6), yaw=(-1.0, 1.0), pitch=(-0.1, 0.8), roll=(-0.2, 0.2)
)


@pytest.fixture(scope="module")
def checker(bug):
    return ReachabilityChecker(bug, SCENE, Condition.limbs(at_least=2))


def drawn(checker, seed, count=40):
    sampler, rng = PoseSampler(checker, REGION), np.random.default_rng(seed)
    return [sampler.draw(rng) for _ in range(count)]


def test_poses_satisfy_condition_and_bounds(checker):
    poses = [pose for pose in drawn(checker, 0) if pose is not None]
    assert len(poses) >= 35
    for pose in poses:
        assert checker.holds(pose)
        assert np.all(pose[:3] >= REGION.lower)
        assert np.all(pose[:3] <= REGION.upper)
        yaw, pitch, roll = Rotation.from_quat(pose[3:]).as_euler("ZYX")
        assert -1.0 <= yaw <= 1.0
        assert -0.1 <= pitch <= 0.8
        assert -0.2 <= roll <= 0.2


def test_same_seed_same_bits(checker):
    for one, two in zip(drawn(checker, 3), drawn(checker, 3), strict=True):
        assert one is None or np.array_equal(one, two)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_triangles_are_drawn_in_the_wanted_mixture(checker, share):
    """A share uniformly, the others by area; a thousand-fold draw leaves 5 standard errors."""
    sampler = PoseSampler(checker, REGION, share)
    edges = sampler.corners[:, 1:] - sampler.corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    count = 50_000
    found = np.bincount(sampler.pick(count, np.random.default_rng(1)), minlength=len(area)) / count
    wanted = share / len(area) + (1.0 - share) * area / area.sum()
    assert np.all(np.abs(found - wanted) <= 5.0 * np.sqrt(wanted * (1.0 - wanted) / count))


def test_turns_without_bounds_are_uniform():
    """Every axis of uniform turns points anywhere: the mean of each entry is 0, of its square 1/3."""
    region = SamplingRegion((0, 0, 0), (1, 1, 1))
    matrices = Rotation.from_quat(region.turns(20_000, np.random.default_rng(0))).as_matrix()
    # Entries have variance 1/3, their squares 4/45.
    assert np.abs(matrices.mean(axis=0)).max() < 5.0 * np.sqrt(1.0 / 3.0 / 20_000)
    assert np.abs((matrices**2).mean(axis=0) - 1.0 / 3.0).max() < 5.0 * np.sqrt(4.0 / 45.0 / 20_000)


def test_no_pose_where_nothing_satisfies_the_condition(bug):
    """A limb that may use no surface never reaches one; the search ends."""
    from manikin.planning.guide import LimbRule, UsableSurface

    none = Condition((LimbRule(("left",)),), {"left": UsableSurface(obstacles=())})
    assert set(drawn(ReachabilityChecker(bug, SCENE, none), 0, count=3)) == {None}


def test_misuse_is_told(checker):
    with pytest.raises(InputError, match="lower < upper"):
        SamplingRegion((0, 0, 0), (1, 0, 1))
    with pytest.raises(InputError, match="no surface within reach"):
        PoseSampler(ReachabilityChecker(checker.abstraction, Scene([SCENE["hold"]], None)),
                    SamplingRegion((50, 50, 50), (51, 51, 51)))  # fmt: skip
