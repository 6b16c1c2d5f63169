import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.balance import LimitKind, contact_limits, pseudo_wrench, wrench_polytope
from manikin.balance.friction import edge_wrenches
from manikin.balance.wrench import facet_shares
from manikin.contact import Stance, grasp, point, sole
from manikin.errors import ContactError
from manikin.numerics.polytope import convex_hull

CALM = (0.0, 0.0, 0.0)


def limiting(stance, com, acceleration=CALM):
    W = wrench_polytope(stance)
    return W.limiting(pseudo_wrench(79.0, com, acceleration))


@pytest.mark.parametrize(("model", "count"), [("outer", 16), ("inner", 16), ("cone", 132)])
def test_rows_of_a_sole_are_the_facets_of_its_corner_forces(model, count):
    foot = sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7)
    limits = contact_limits(foot, model)
    H, h = convex_hull(np.vstack([np.zeros(6), edge_wrenches(foot, model)]))
    cone = H[np.abs(h) < 1e-9]
    apart = np.abs(cone[:, None] - limits.A[None]).max(axis=-1)
    assert cone.shape == limits.A.shape == (count, 6)
    assert apart.min(axis=0).max() < 1e-12
    assert apart.min(axis=1).max() < 1e-12


def test_torsion_rows_are_the_safe_form():
    """Rows +-n +- mu s +- mu t imply the moment about the CoP stays below the limit (4.15)."""
    foot = sole("foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7, torsion_limit=10.0)
    limits = contact_limits(foot)
    rng = np.random.default_rng(0)
    w = rng.normal(size=(200_000, 6)) * [300, 300, 400, 10, 10, 10] + [0, 0, 500, 0, 0, 0]
    inside = w[(w @ limits.A.T <= limits.b).all(axis=1)]
    assert len(inside) > 1000
    about_cop = inside[:, 5] + (inside[:, 3] * inside[:, 0] + inside[:, 4] * inside[:, 1]) / inside[:, 2]
    assert np.abs(about_cop).max() <= 10.0 + 1e-9
    assert len([k for k in limits.kinds if k is LimitKind.TURNING]) == 8


@pytest.mark.parametrize(
    ("com", "effector", "phrase"),
    [
        ((0.0, 0.15, 0.9), "left_foot", "tipping over its outer edge"),
        ((0.0, -0.15, 0.9), "right_foot", "tipping over its outer edge"),
        ((0.13, 0.0, 0.9), "left_foot", "tipping over its front edge"),
        ((-0.13, 0.0, 0.9), "left_foot", "tipping over its rear edge"),
        ((0.0, 0.18, 0.9), "left_foot", "tipping over its outer edge"),
    ],
)
def test_standing_near_an_edge_tips_over_it(two_soles, com, effector, phrase):
    found = limiting(two_soles, com)
    assert found.effector == effector
    assert found.kind is LimitKind.TIPPING
    assert found.description == f"{effector}: {phrase}"
    assert (found.margin > 0) == (abs(com[1]) < 0.16)


def test_the_other_foot_lifts_off_when_tipping_sideways(two_soles):
    shares = limiting(two_soles, (0.0, 0.15, 0.9)).shares
    assert [str(s) for s in shares] == ["left_foot: tipping over its outer edge", "right_foot: lifting off"]


@pytest.mark.parametrize(
    ("acceleration", "phrase"), [((4.5, 0, 0), "slipping along -x"), ((0, -4.5, 0), "slipping along +y")]
)
def test_low_friction_slips_against_the_acceleration(acceleration, phrase):
    """A push of the ground along +x at its limit lets the feet slide along -x."""
    feet = [
        sole(f"{side}_foot", (0, y, 0), length=0.5, width=0.5, friction=0.5)
        for side, y in (("left", 0.3), ("right", -0.3))
    ]
    found = limiting(Stance(feet, 1500.0), (0, 0, 0.2), acceleration)
    assert found.kind is LimitKind.SLIPPING
    assert phrase in found.description
    assert {s.effector for s in found.shares} == {"left_foot", "right_foot"}


def test_accelerating_upwards_meets_the_cap(two_soles):
    found = limiting(two_soles, (0, 0, 0.9), (0, 0, 8.5))
    assert found.effector == "stance"
    assert found.kind is LimitKind.NORMAL_FORCE_CAP
    assert found.margin == pytest.approx(1500 - 79 * (9.81 + 8.5))
    np.testing.assert_allclose(found.direction, [0, 0, 1, 0, 0, 0], atol=1e-9)


def test_a_foots_own_cap_is_named():
    feet = [
        sole("left_foot", (0, 0.1, 0), length=0.28, width=0.12, friction=0.7, normal_force_cap=300.0),
        sole("right_foot", (0, -0.1, 0), length=0.28, width=0.12, friction=0.7, normal_force_cap=900.0),
    ]
    shares = limiting(Stance(feet), (0, 0.08, 0.9)).shares
    assert "left_foot: normal force cap of 300 N" in [str(s) for s in shares]


def test_hanging_meets_the_grasp_force():
    found = limiting(Stance([grasp("right_hand", (0, 0, 2), max_force=800.0)]), (0, 0, 1), (0, 0, 1))
    assert found.description == "right_hand: grasp force limit of 800 N along +z"
    assert found.kind is LimitKind.GRASP_FORCE


def test_a_moment_about_a_point_contact_has_no_support():
    W = wrench_polytope(Stance([point("toe", (0, 0, 0), friction=0.7)], 1000.0))
    found = W.limiting([0, 0, 500, 0, 0, 30.0])
    assert found.kind is LimitKind.UNSUPPORTED
    assert limiting(Stance([]), (0, 0, 1)).effector == "stance"


def test_turning_on_one_foot_is_named():
    W = wrench_polytope(Stance([sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7)], 1000.0))
    found = W.limiting([0, 0, 700, 0, 0, 97.0])
    assert found.description == "left_foot: turning clockwise on its sole"


def test_a_torsion_limit_and_the_stance_cap_are_told_apart():
    foot = sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7, torsion_limit=10.0)
    W = wrench_polytope(Stance([foot], 1000.0))
    turning = W.limiting([0, 0, 700, 0, 0, -9.0])
    assert turning.description == "left_foot: turning counter-clockwise on its sole"
    assert turning.margin == pytest.approx(1.0 / np.sqrt(1 + 2 * 0.7**2))
    assert W.limiting([0, 0, 999.9, 0, 0, 0]).kind is LimitKind.NORMAL_FORCE_CAP


def test_malformed_wrenches_are_refused(two_soles):
    with pytest.raises(ContactError, match="wrench"):
        wrench_polytope(two_soles).limiting([0, 0, 1])


@settings(max_examples=10)
@given(st.integers(0, 10_000))
def test_shares_predict_how_the_margin_grows_with_each_limit(random_stance, seed):
    """Raising the stance cap or a grasp limit moves each facet by its share (a dual multiplier)."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, most=2)
    W = wrench_polytope(stance)
    if W.h.max() < 1e-6:
        return
    bigger = wrench_polytope(Stance(stance.contacts, stance.normal_force_cap + 1.0))
    for i in rng.choice(len(W), 3):
        same = np.abs(bigger.H - W.H[i]).max(axis=1)
        if same.min() > 1e-9 or W.h[i] < 1e-6:
            continue
        cap = sum(
            s.share
            for s in facet_shares(W, int(i))
            if s.effector == "stance" and s.kind == "normal force cap"
        )
        assert bigger.h[np.argmin(same)] - W.h[i] == pytest.approx(cap, abs=1e-6)
