"""Generators of contact forces, and the sharing of a wrench among them, against general solvers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from manikin.balance.contact_forces import ContactGenerators, friction_share, friction_use, share
from manikin.balance.friction import contact_to_world, edge_wrenches
from manikin.contact import (
    FRICTION_MODELS,
    ContactSchedule,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    point,
    sole,
)


def test_generators_are_the_edges_of_the_stances_friction_model_and_the_axes_of_its_grasps():
    foot = sole("left_foot", (0.1, 0.2, 0.3), 0.4, length=0.28, width=0.12, friction=0.7)
    tip = point("right_foot", (0.1, -0.2, 0.0), friction=0.5, normal=(0.3, 0.1, 1.0))
    hand = grasp("left_hand", (0.4, 0.2, 1.1), max_force=100.0, max_moment=8.0)
    about = np.array([0.3, -0.1, 0.5])
    for model in FRICTION_MODELS:
        found = ContactGenerators.of(Stance([foot, tip, hand], friction_model=model))
        wrenches = found.about(about).T
        for number, contact in enumerate((foot, tip)):
            expected = contact_to_world(contact, edge_wrenches(contact, model), about)
            np.testing.assert_allclose(wrenches[found.contact == number], expected, atol=1e-14)
        assert wrenches[found.contact == 2][:3, :3].tolist() == np.eye(3).tolist()
        assert found.upper[found.contact == 2].tolist() == [100.0] * 3 + [8.0] * 3 + [100.0] * 3 + [8.0] * 3
        assert found.normal.tolist() == [1.0] * int(np.sum(found.contact < 2)) + [0.0] * 12


@given(st.integers(0, 2**31), st.integers(6, 40), st.booleans(), st.booleans())
def test_wrenches_are_shared_as_a_bounded_least_squares_solver_shares_each(seed, count, reachable, bounded):
    """The optimum is unique; both are exact but for rounding, 1e-6 of the largest magnitude."""
    rng = np.random.default_rng(seed)
    matrix, soft = rng.normal(size=(6, count)), 1e-6
    gain = rng.uniform(1.0, 20.0, size=(5, count)) ** -2.0
    wrench = 100.0 * (rng.uniform(size=(5, count)) @ matrix.T if reachable else rng.normal(size=(5, 6)))
    prior = rng.normal(scale=30.0, size=(5, count)) * bounded
    upper = rng.uniform(20.0, 80.0, size=count) if bounded else np.full(count, np.inf)
    found = share(matrix, wrench, gain, soft, prior=prior, upper=upper)
    assert np.all((found.magnitude >= 0.0) & (found.magnitude <= upper))
    for k in range(5):
        stacked = np.vstack([matrix / np.sqrt(soft), np.diag(gain[k] ** -0.5)])
        wanted = np.concatenate([wrench[k] / np.sqrt(soft), prior[k] * gain[k] ** -0.5])
        expected = lsq_linear(stacked, wanted, bounds=(0.0, upper), method="bvls", tol=1e-13).x
        assert found.magnitude[k] == pytest.approx(expected, abs=1e-6 * max(1.0, expected.max()))
        missing = wrench[k] - matrix @ found.magnitude[k]
        np.testing.assert_allclose(soft * found.multiplier[k], missing, atol=1e-9 * np.abs(wrench[k]).max())


def test_the_share_of_the_friction_is_one_on_the_sides_of_the_model():
    """A force of mu f_n along x is too much for the inner pyramid alone; one along the diagonal is not."""
    foot = point("foot", (0.0, 0.0, 0.0), friction=0.5)
    along = np.array([[50.0, 0.0, 100.0]])
    diagonal = np.array([[50.0 * np.sqrt(0.5), 50.0 * np.sqrt(0.5), 100.0]])
    shares = {
        model: [float(friction_share(foot, force, model)[0]) for force in (along, diagonal)]
        for model in FRICTION_MODELS
    }
    assert shares["outer"] == pytest.approx([1.0, np.sqrt(0.5)])
    assert shares["inner"] == pytest.approx([np.sqrt(2.0), 1.0])
    assert shares["cone"] == pytest.approx([1.0, 1.0])


def test_the_use_of_friction_is_that_of_the_worst_sample_in_the_model_of_its_stance():
    """Two phases on one foot: the second force is half way to the side of the inner pyramid of both."""
    foot = point("foot", (0.0, 0.0, 0.0), friction=0.5)
    hand = grasp("hand", (0.3, 0.0, 1.0), max_force=100.0)
    stances = [Stance([foot], 1e3, "inner"), Stance([foot, hand], 1e3, "inner")]
    schedule = ContactSchedule(StanceSequence([Phase(stance) for stance in stances]), [0.0, 1.0, 2.0])
    forces = np.zeros((2, 2, 6))
    forces[:, 0, 2], forces[1, 0, 0], forces[1, 1, 0] = 200.0, 25.0 * np.sqrt(2.0), 90.0
    found = friction_use(schedule, np.array([0.5, 1.5]), ["foot", "hand"], forces)
    assert found.share == pytest.approx(0.5)
    assert (found.model, found.time, found.effector) == ("inner", 1.5, "foot")
