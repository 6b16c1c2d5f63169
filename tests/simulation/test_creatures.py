"""Bodies that are no plain human: both engines hold the same one, and motion files bring it back."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import (
    Configuration,
    creature_from_urdf,
    human,
    insect,
    random_configuration,
    with_knees_and_elbows,
)
from manikin.motion import Motion
from manikin.motion.description import body_from, describe_body
from manikin.motion.file import MotionFile, read_motions, write_motions
from manikin.simulation import compile_model
from manikin.simulation.compile import root_rotation

NAMES = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
EXACT = 1e-9


@pytest.fixture(scope="module")
def creatures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dog")
    trimesh.creation.capsule(height=140.0, radius=15.0).export(folder / "shank.stl")
    file = shutil.copy(Path(__file__).parents[1] / "body/data/dog.urdf", folder)
    limbs = {name: {"tip": f"{name}_foot", "position": (0.02, 0.0, 0.0)} for name in NAMES}
    standing = {
        f"{name}_{joint}": angle for name in NAMES for joint, angle in (("pitch", 0.6), ("knee", 1.2))
    }
    return {
        "dog": creature_from_urdf(file, limbs, standing=standing),
        "insect": insect(),
        "person": with_knees_and_elbows(human()),
    }


@given(st.sampled_from(["dog", "insect"]), st.integers(0, 2**32 - 1))
def test_engines_agree_on_creatures(creatures, name, seed):
    """Mass, centre of mass, mass matrix and effectors agree to 1e-9 for random configurations."""
    body = creatures[name]
    model, rng = compile_model(body), np.random.default_rng(seed)
    q = random_configuration(body, rng)
    state, data = Configuration(body, q), mujoco.MjData(model.mujoco)
    model.set_state(data, q)
    assert model.mujoco.body_mass.sum() == pytest.approx(body.mass, rel=1e-12)
    np.testing.assert_allclose(data.subtree_com[1], state.com, atol=EXACT)
    for effector in body.effectors:
        rotation, position = state.effector_placement(effector)
        site = model.site_id(effector)
        np.testing.assert_allclose(data.site_xpos[site], position, atol=EXACT)
        np.testing.assert_allclose(data.site_xmat[site].reshape(3, 3), rotation, atol=EXACT)
    matrix, turn = np.zeros((body.nv, body.nv)), np.eye(body.nv)
    mujoco.mj_fullM(model.mujoco, data, matrix)
    turn[:3, :3] = root_rotation(q)
    np.testing.assert_allclose(turn.T @ matrix @ turn, state.mass_matrix, atol=EXACT)
    assert tuple(model.mujoco.actuator(k).name for k in range(model.mujoco.nu)) == body.joint_names


@pytest.mark.parametrize("name", ["dog", "insect", "person"])
def test_motion_files_bring_creatures_back(creatures, name, tmp_path):
    """Bit for bit: segments, limbs, effectors, what overlaps; and a body of another size is another one."""
    body = creatures[name]
    n, zero = 3, np.zeros((3, body.nv))
    motion = Motion(
        time=np.arange(n) * 0.01, q=np.tile(body.standing_posture(), (n, 1)), v=zero, a=zero, tau=zero,
        com=np.zeros((n, 3)), angular_momentum=np.zeros((n, 3)), margin=np.zeros(n),
        support=np.zeros((n, 1), dtype=bool), contact_force=np.zeros((n, 1, 6)),
        contact_names=(next(iter(body.effectors)),), joint_names=body.joint_names,
    )  # fmt: skip
    write_motions(tmp_path / "motion.h5", MotionFile(planned=motion, body=body))
    again = read_motions(tmp_path / "motion.h5").body
    assert describe_body(again) == describe_body(body)
    assert again.limbs == body.limbs
    assert again.soft_pairs == body.soft_pairs
    assert describe_body(again) == describe_body(body)
    np.testing.assert_array_equal(again.standing_posture(), body.standing_posture())
    assert describe_body(body) not in [describe_body(insect(0.41)), describe_body(human())]


def test_descriptions_without_limbs_are_read(creatures):
    """Files of earlier versions have none."""
    old = describe_body(creatures["insect"])
    del old["limbs"]
    assert body_from(old).limbs == ()
