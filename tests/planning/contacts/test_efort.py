"""EFORT against unit balls of torque, its signs, and what joint torques really allow."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import spearmanr

from manikin.body import human, limb_named, with_further_contacts
from manikin.body.limbs import moving_segments
from manikin.errors import InputError
from manikin.kinematics import LimbKinematics
from manikin.kinematics.efort import (
    MOST_RATIO,
    Task,
    efort,
    force_transmission_ratio,
    usable_efort,
)
from manikin.kinematics.limb_samples import sample_limb
from manikin.planning.contacts import StrongEfort

SEEDS = st.integers(0, 10_000)
SCRIPT = Path(__file__).parents[3] / "docs/heuristics.py"


@pytest.fixture(scope="module")
def limb_strength():
    """The yardstick of the comparison in the docs."""
    spec = importlib.util.spec_from_file_location("heuristics_script", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = script
    spec.loader.exec_module(script)
    return script.limb_strength


def jacobian_and_direction(seed, joints=7):
    rng = np.random.default_rng(seed)
    v = rng.standard_normal(3)
    return rng.standard_normal((3, joints)), v / np.linalg.norm(v)


@given(SEEDS)
def test_the_ratio_is_the_largest_force_along_the_task_with_torques_of_unit_norm(seed):
    """``f_T^-2 = v^T J J^T v = |J^T v|^2``: torques of a force ``f v`` have the norm ``f / f_T``."""
    jacobian, v = jacobian_and_direction(seed)
    (ratio,) = force_transmission_ratio((jacobian @ jacobian.T)[None], v)
    assert ratio**-2 == pytest.approx(v @ jacobian @ jacobian.T @ v)
    assert np.linalg.norm(jacobian.T @ (ratio * v)) == pytest.approx(1.0)
    assert np.linalg.norm(jacobian.T @ (1.01 * ratio * v)) > 1.0


@given(SEEDS)
def test_the_ellipsoids_are_images_of_unit_balls(seed):
    """Speeds of unit joint speeds fill one (5.4), forces of unit torques the other (5.10), its inverse."""
    jacobian, v = jacobian_and_direction(seed)
    product = jacobian @ jacobian.T
    squares, axes = np.linalg.eigh(product)
    rates = np.random.default_rng(seed).standard_normal((7, 200))
    rates /= np.linalg.norm(rates, axis=0)
    inside = (axes.T @ jacobian @ rates) / np.sqrt(squares)[:, None]
    assert (np.linalg.norm(inside, axis=0) <= 1.0 + 1e-9).all()
    for square, axis in zip(squares, axes.T, strict=True):
        (length,) = force_transmission_ratio(product[None], axis)
        assert length == pytest.approx(1.0 / np.sqrt(square))
        assert np.linalg.norm(jacobian.T @ (length * axis)) == pytest.approx(1.0)
    (ratio,) = force_transmission_ratio(product[None], v)
    assert np.linalg.norm((axes.T @ (ratio * v)) * np.sqrt(squares)) == pytest.approx(1.0)


@given(SEEDS)
def test_efort_does_not_depend_on_the_frame(seed):
    jacobian, v = jacobian_and_direction(seed)
    normal = np.roll(v, 1)
    turn = Rotation.random(random_state=seed).as_matrix()
    turned = turn @ jacobian
    (alpha,) = efort((jacobian @ jacobian.T)[None], v, normal[None])
    (same,) = efort((turned @ turned.T)[None], turn @ v, (turn @ normal)[None])
    assert same == pytest.approx(alpha)
    (opposite,) = efort((jacobian @ jacobian.T)[None], -v, normal[None])
    assert opposite == pytest.approx(-alpha)


def test_only_the_direction_of_the_task_counts():
    jacobian, v = jacobian_and_direction(1)
    product, normals = (jacobian @ jacobian.T)[None], np.roll(v, 1)[None]
    assert efort(product, 7.0 * v, normals) == pytest.approx(efort(product, v, normals))
    with pytest.raises(InputError, match="not zero"):
        efort(product, np.zeros(3), normals)


def test_a_stretched_limb_carries_its_own_direction_without_torque():
    jacobian = np.array([[0.0, 0.0], [1.0, 0.5], [0.0, 0.0]])
    assert force_transmission_ratio((jacobian @ jacobian.T)[None], np.array([1.0, 0.0, 0.0])) == np.inf


def test_signs_of_the_limbs_that_push_a_cupboard():
    """Towards +x: the cupboard's face looks at the person, an oblique floor pushes the feet forward."""
    task = Task((2.0, 0.0, 0.0), {"left_arm"})
    product = np.eye(3)[None]
    face, chock = np.array([[-1.0, 0.0, 0.0]]), np.array([[0.6, 0.0, 0.8]])
    assert efort(product, task.reaction_on("left_arm"), face) == pytest.approx(1.0)
    assert efort(product, task.reaction_on("left_leg"), chock) == pytest.approx(0.6)
    # With one direction for all, as printed, the hand would score below every other place.
    assert efort(product, task.direction, face) < 0.0


def test_signs_of_a_hand_that_pulls():
    """The object is drawn to -x, the hand is drawn to +x; its handle looks at the person."""
    task = Task((-1.0, 0.0, 0.0), {"right_arm"})
    handle = np.array([[-1.0, 0.0, 0.0]])
    v = task.reaction_on("right_arm")
    assert v == pytest.approx([1.0, 0.0, 0.0])
    assert efort(np.eye(3)[None], v, handle) == pytest.approx(-1.0)


@given(SEEDS, st.floats(0.1, 1.0))
def test_the_exertable_force_keeps_every_limit_and_is_the_largest(limb_strength, seed, friction):
    """Against random forces scaled to the limits; a grasp can do at least what friction can."""
    jacobian, v = jacobian_and_direction(seed)
    rng = np.random.default_rng(seed)
    lower, upper = -rng.uniform(1.0, 50.0, 7), rng.uniform(1.0, 50.0, 7)
    normal = v + 0.3 * rng.standard_normal(3)
    normal /= np.linalg.norm(normal)
    best = limb_strength(jacobian, lower, upper, v, normal, friction)
    held = limb_strength(jacobian, lower, upper, v, None)
    assert held >= best - 1e-6 >= -2e-6
    forces = rng.standard_normal((300, 3))
    # The pyramid with eight sides is inside the cone, and holds the cone of cos(pi / 8) of the friction.
    along = forces @ normal
    across = np.linalg.norm(forces - along[:, None] * normal, axis=1)
    inner = across <= friction * np.cos(np.pi / 8) * along
    torque = -forces @ jacobian
    scale = 1.0 / np.maximum(torque / upper, torque / lower).max(axis=1)
    assert (scale * (forces @ v) <= held + 1e-6).all()
    assert (scale * (forces @ v))[inner].max(initial=0.0) <= best + 1e-6


def test_the_exertable_force_of_a_lever_is_its_torque_over_its_arm(limb_strength):
    """One hinge about z, the effector 0.5 m along x: -20 N.m bear 40 N along y, 30 N.m 60 N against it."""
    jacobian, y = np.array([[0.0], [0.5], [0.0]]), np.array([0.0, 1.0, 0.0])
    limits = np.array([-20.0]), np.array([30.0])
    assert limb_strength(jacobian, *limits, y, y) == pytest.approx(40.0)
    assert limb_strength(jacobian, *limits, -y, -y) == pytest.approx(60.0)
    assert limb_strength(jacobian, *limits, -y, y) == pytest.approx(0.0)
    assert limb_strength(jacobian, *limits, np.array([1.0, 0.0, 0.0]), None) == np.inf


def test_efort_with_strengths_is_a_force_within_them(person, person_samples, limb_strength):
    """The force along ``v`` alone is between the ratio, where all shares have unit norm, and its sqrt(k)."""
    samples = person_samples["left_arm"]
    chain = LimbKinematics(person, samples.limb)
    v = np.array([-1.0, 0.0, 0.0])
    products = StrongEfort.of(person, {"left_arm": samples}).products["left_arm"][:100]
    ratio = force_transmission_ratio(products, v)
    jacobians = chain.place(samples.angles[:100]).jacobians
    weaker = np.minimum(-chain.torque_lower, chain.torque_upper)
    alone = (weaker / np.abs(v @ jacobians)).min(axis=1)
    assert (alone >= ratio * (1 - 1e-9)).all()
    assert (alone <= ratio * np.sqrt(len(chain)) * (1 + 1e-9)).all()
    best = np.array(
        [limb_strength(each, chain.torque_lower, chain.torque_upper, v, None) for each in jacobians]
    )
    assert (best >= alone * (1 - 1e-9)).all()


@pytest.mark.parametrize("name", ["left_arm", "left_leg"])
def test_efort_orders_postures_like_the_force_they_can_exert(person, person_samples, limb_strength, name):
    """Under joint torque limits and friction, against a face square to the task.

    EFORT weighs all joints alike and bounds the norm of the torques, so the order is not the same but
    close: rank correlation above one half, and its best tenth is far ahead of the average.
    """
    samples = person_samples[name]
    chain = LimbKinematics(person, samples.limb)
    v = np.array([1.0, 0.0, 0.0]) if name == "left_leg" else np.array([-1.0, 0.0, 0.0])
    rows = np.arange(300)
    jacobians = chain.place(samples.angles[rows]).jacobians
    force = np.array(
        [limb_strength(each, chain.torque_lower, chain.torque_upper, v, v, 0.7) for each in jacobians]
    )
    alpha = efort(samples.products[rows], v, np.tile(v, (300, 1)))
    assert spearmanr(alpha, force).statistic > 0.5
    best = np.argsort(-alpha)[:30]
    assert force[best].mean() > 1.5 * force.mean()


def test_efort_prefers_the_face_that_can_carry_the_force(person, person_samples, limb_strength):
    """One posture, faces turned away from the task step by step: less EFORT, and less force."""
    samples = person_samples["left_arm"]
    chain = LimbKinematics(person, samples.limb)
    v = np.array([-1.0, 0.0, 0.0])
    angles = np.deg2rad([0.0, 40.0, 80.0, 120.0])
    normals = np.column_stack([-np.cos(angles), np.zeros(4), np.sin(angles)])
    jacobian = chain.place(samples.angles[:1]).jacobians[0]
    alpha = efort(np.repeat(samples.products[:1], 4, axis=0), v, normals)
    assert (np.diff(alpha) < 0.0).all()
    force = [
        limb_strength(jacobian, chain.torque_lower, chain.torque_upper, v, normal, 0.3) for normal in normals
    ]
    assert force[0] > force[2] > force[3] - 1e-9
    assert force[3] <= 1e-6


@pytest.mark.parametrize("name", ["left_arm", "left_leg", "left_knee", "pelvis"])
def test_a_contact_that_carries_its_limb_at_the_joints_strength_has_a_usable_efort(name):
    """The force ``f v``, every joint within its own strength, times the cosine, against the weight."""
    body = with_further_contacts(human(1.6, 60.0, "female"))
    limb = limb_named(body, name)
    samples = sample_limb(body, limb, np.random.default_rng(0), 2000)
    if not samples.angles.shape[1]:
        assert usable_efort(body, limb) == pytest.approx(
            MOST_RATIO * body.segment(limb.segments[0]).mass / body.mass
        )
        return
    chain, v = LimbKinematics(body, limb), np.array([0.6, 0.0, 0.8])
    torque = np.einsum("nik,i->nk", chain.place(samples.angles).jacobians, v)
    limit = np.where(torque > 0.0, -chain.torque_lower, chain.torque_upper)
    force = np.min(limit / np.maximum(np.abs(torque), 1e-9), axis=1)
    normals = np.random.default_rng(1).standard_normal((2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weight = 9.81 * sum(body.segment(name).mass for name in moving_segments(body, limb))
    alpha, carries = efort(samples.products, v, normals), force * (normals @ v) >= 1.01 * weight
    assert carries.any()
    assert (alpha[carries] >= usable_efort(body, limb)).all()
