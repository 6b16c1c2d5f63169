import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.balance import force_space, moment_space, pseudo_wrench, stability_margins, wrench_polytope
from manikin.contact import Stance, grasp
from manikin.errors import InputError
from manikin.numerics.spatial import skew

seeds = st.integers(0, 100_000)
few = settings(max_examples=12)
COM = np.array([0.03, 0.02, 0.9])


@pytest.fixture
def W(two_soles):
    hand = grasp("right_hand", (0.4, -0.2, 1.1), max_force=100.0)
    return wrench_polytope(Stance([*two_soles, hand], 1500.0), reference=(0.1, -0.2, 0.3))


def test_force_space_holds_the_forces_whose_wrench_is_admissible(W):
    """4.38: (H1 + H2 x^) f <= h, with the margin in newtons."""
    rng = np.random.default_rng(0)
    forces = rng.normal(size=(200, 3)) * [200, 200, 400] + [0, 0, 700]
    wrenches = np.hstack([forces, np.cross(COM - W.reference, forces)])
    assert np.array_equal(force_space(W, COM).margin(forces) > 0, W.margin(wrenches) > 0)


def test_moment_space_is_a_slice_at_fixed_force_not_a_projection(W):
    """DOUBTS: x^ F_p is flat and has no inner ball; the slice has one."""
    force = np.array([0.0, 0.0, 775.0])
    T = moment_space(W, force)
    moments = np.random.default_rng(0).normal(size=(200, 3)) * 100 + np.cross(COM - W.reference, force)
    wrenches = np.hstack([np.broadcast_to(force, moments.shape), moments])
    assert np.array_equal(T.margin(moments) > 0, W.margin(wrenches) > 0)
    assert T.inscribed_ball()[1] > 10.0


@few
@given(seeds)
def test_force_and_moment_margins_are_the_shortest_ways_out(random_stance, contact_program, seed):
    """Pushed along the nearest row the program gives up there, along other directions not before."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, kinds=("sole", "grasp"), most=2)
    W, program = wrench_polytope(stance), contact_program(stance)
    corners = [program.support(rng.normal(size=6) * [1, 1, 1, 5, 5, 5])[1] for _ in range(8)]
    w, com = np.mean(corners, axis=0), rng.normal(size=3) * 0.2 + np.array([0, 0, 0.9])
    margins = stability_margins(W, w, com)
    if margins.wrench < 1e-2:  # a lone grasp is flat
        return
    at_com = np.vstack([np.eye(3), skew(com)])
    only_moment = np.vstack([np.zeros((3, 3)), np.eye(3)])
    for margin, effect in ((margins.force, at_com), (margins.moment, only_moment)):
        ways = rng.normal(size=(6, 3))
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        reach = min(program.reach(w, effect @ way) for way in ways)
        assert reach >= margin - 2e-4
        levers = W.H @ effect
        row = np.argmin(W.distances(w) / np.maximum(np.linalg.norm(levers, axis=1), 1e-12))
        nearest = levers[row] / np.linalg.norm(levers[row])
        assert program.reach(w, effect @ nearest) == pytest.approx(float(margin), abs=2e-4)


def test_wrench_margin_is_the_distance_to_the_nearest_facet(W, contact_program):
    """The program over contact forces gives up at the margin along the nearest row, nowhere before."""
    w = pseudo_wrench(79.0, COM, (0.3, 0.2, 0.1), None, W.reference)
    margin = float(W.margin(w))
    program = contact_program(W.stance, reference=W.reference)
    ways = np.random.default_rng(0).normal(size=(60, 6))
    ways = np.vstack([W.H, ways / np.linalg.norm(ways, axis=1)[:, None]])
    reach = np.array([program.reach(w, way) for way in ways])
    assert reach.min() == pytest.approx(margin, abs=2e-4)
    assert np.argmin(reach) == np.argmin(W.distances(w))


def test_margin_about_the_com_is_that_of_the_polytope_moved_there(W):
    w = pseudo_wrench(79.0, COM, (0.3, 0.2, 0.1), (1.0, 2.0, 3.0), W.reference)
    at_com = W.at_reference(COM)
    expected = at_com.margin(pseudo_wrench(79.0, COM, (0.3, 0.2, 0.1), (1.0, 2.0, 3.0), COM))
    assert stability_margins(W, w, COM).wrench_about_com == pytest.approx(float(expected), rel=1e-9)


def test_margins_of_many_states_are_those_of_each(W):
    rng = np.random.default_rng(0)
    com, a = COM + 0.1 * rng.normal(size=(3000, 3)), rng.normal(size=(3000, 3))
    w = pseudo_wrench(79.0, com, a, None, W.reference)
    together = stability_margins(W, w, com)
    for i in (0, 1023, 1024, 2999):
        alone = stability_margins(W, w[i], com[i])
        for name in ("force", "moment", "wrench", "wrench_about_com"):
            assert getattr(together, name)[i] == pytest.approx(float(getattr(alone, name)), rel=1e-9)
    np.testing.assert_allclose(together.wrench, W.margin(w), atol=1e-9)
    F = force_space(W, com[5])
    assert together.force[5] == pytest.approx(float(F.margin(w[5, :3])), rel=1e-9)


def test_a_cap_that_moments_cannot_reach_is_no_limit_on_them():
    """Straight above one sole under its cap: the moment margin ignores the cap row while it holds."""
    from manikin.contact import sole

    stance = Stance([sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7)], 800.0)
    W = wrench_polytope(stance)
    high = stability_margins(W, pseudo_wrench(79.0, (0, 0, 0.9), (0, 0, 0)), (0, 0, 0.9))
    assert high.force == pytest.approx(800.0 - 79.0 * 9.81)
    assert high.moment == pytest.approx(79.0 * 9.81 * 0.06, rel=1e-6)
    broken = stability_margins(W, pseudo_wrench(79.0, (0, 0, 0.9), (0, 0, 1)), (0, 0, 0.9))
    assert broken.moment == -np.inf


def test_shapes_that_do_not_fit_are_refused(W):
    with pytest.raises(InputError, match="valid"):
        stability_margins(W, np.zeros(5), COM)
