import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from manikin.balance import pseudo_wrench, stability_margins, wrench_polytope
from manikin.contact import Stance, grasp, point, sole
from manikin.errors import ContactError, InputError
from manikin.numerics.spatial import GRAVITY_VECTOR, rotation_from_rpy, skew

seeds = st.integers(0, 100_000)
# HiGHS satisfies constraints to 1e-7 of a kilonewton.
SOLVER = 2e-4


def assert_same_set(W, program, rng, rows=5, shots=4):
    """Facets are tight; extreme wrenches are inside; shots from inside leave both sets together."""
    for i in rng.choice(len(W), min(rows, len(W)), replace=False):
        assert program.support(W.H[i])[0] == pytest.approx(W.h[i], abs=SOLVER)
    for _ in range(shots):
        corners = [program.support(rng.normal(size=6) * [1, 1, 1, 5, 5, 5])[1] for _ in range(4)]
        assert W.margin(np.array(corners)).min() > -SOLVER
        inside = np.mean(corners, axis=0)
        direction = program.support(rng.normal(size=6))[1] - inside
        if np.linalg.norm(direction) > 1e-3:
            direction /= np.linalg.norm(direction)
            at_boundary = inside + program.reach(inside, direction) * direction
            assert W.margin(at_boundary) == pytest.approx(0.0, abs=SOLVER)


@given(seeds)
def test_stances_under_a_sum_cap_equal_the_program_over_contact_forces(random_stance, contact_program, seed):
    rng = np.random.default_rng(seed)
    stance = random_stance(rng)
    reference = rng.normal(size=3)
    W = wrench_polytope(stance, reference=reference)
    assert_same_set(W, contact_program(stance, reference=reference), rng)


@settings(max_examples=12)
@given(seeds)
def test_own_caps_and_a_sum_cap_together_equal_the_program(random_stance, contact_program, seed):
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, most=2, own_caps=True)
    assert_same_set(wrench_polytope(stance), contact_program(stance), rng)


@settings(max_examples=8)
@given(seeds)
def test_soles_with_a_torsion_limit_equal_the_program(random_stance, contact_program, seed):
    """CoP and the safe eight-row torsion form replace the corners' forces."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, kinds=("torsion", "grasp"), most=2)
    assert_same_set(wrench_polytope(stance), contact_program(stance), rng)


@settings(max_examples=10)
@given(seeds)
def test_the_inner_models_equal_their_program_and_lie_in_the_outer(random_stance, contact_program, seed):
    """The stance says which one; the octagon has the outer square's sides touched at its corners."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, most=2)
    for model in ("inner", "cone"):
        asked = Stance(stance.contacts, stance.normal_force_cap, model)
        program = contact_program(asked, model)
        assert_same_set(wrench_polytope(asked), program, rng)
        corners = [program.support(rng.normal(size=6))[1] for _ in range(5)]
        assert wrench_polytope(stance).margin(np.array(corners)).min() > -SOLVER


@given(seeds)
def test_membership_of_random_wrenches_agrees_with_the_program(random_stance, contact_program, seed):
    rng = np.random.default_rng(seed)
    stance = random_stance(rng)
    W, program = wrench_polytope(stance), contact_program(stance)
    extreme = np.array([program.support(rng.normal(size=6) * [1, 1, 1, 5, 5, 5])[1] for _ in range(5)])
    for w in rng.dirichlet(np.ones(5), 4) @ extreme * rng.uniform(0.8, 1.3, (4, 1)):
        # The sum of the missing components is at least the distance, which is at least -margin.
        gap, margin = program.gap(w), W.margin(w)
        assert gap >= -margin - SOLVER
        assert margin < 0 or gap < SOLVER


def test_a_facet_that_qhull_left_in_splinters_does_not_hide_others(contact_program):
    """Found by random search: a split facet of a thin sole made the sum with two grasps too large."""
    foot = sole(
        "foot", (0.27, -0.24, 0.0), 0.4, length=0.28, width=1e-3, friction=1.0, torsion_limit=10.0,
        normal=(-8e-5, -8e-5, 1.0), normal_force_cap=500.0,
    )  # fmt: skip
    hands = [
        grasp("right_hand", (-0.05, -0.1, 1.0), max_force=100.0),
        grasp("left_hand", (-0.5, -0.07, 1.0), max_force=100.0),
    ]
    stance = Stance([foot, *hands], 1000.0)
    assert_same_set(wrench_polytope(stance), contact_program(stance), np.random.default_rng(0), 40, 20)


def test_walls_hold_four_feet_with_own_caps(contact_program):
    """Quadruped between walls: each normal force up to 500 N, mu 1 ([Qiu2012]_ 5.4.4)."""
    feet = [
        sole(f"foot_{x:g}_{z:g}", (x, 0.0, z), length=0.1, width=0.4, friction=1.0, normal=(-x, 0.0, 0.0),
             normal_force_cap=500.0)
        for x in (1.0, -1.0) for z in (0.85, 1.15)
    ]  # fmt: skip
    weight = pseudo_wrench(120.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    two = Stance([feet[0], feet[3]])
    assert wrench_polytope(Stance(feet)).margin(weight) > 0
    assert wrench_polytope(two).margin(weight) < 0  # two feet carry 1000 N < 1177 N
    assert_same_set(wrench_polytope(two), contact_program(two), np.random.default_rng(0))


FLAT = {
    "one point": ([point("a", (0.3, 0.2, 0.1), friction=0.5)], 3),
    "two points": ([point("a", (0.0, 0.0, 0.0), friction=0.5), point("b", (1.0, 0.0, 0.2), friction=0.5)], 5),
    "four collinear points": ([point(f"p{i}", (0.1 * i, 0.0, 0.0), friction=0.5) for i in range(4)], 5),
    "one hand": ([grasp("hand", (0.4, 0.0, 1.0), max_force=100.0)], 3),
    "two hands": ([grasp(f"h{y}", (0.4, y, 1.0), max_force=100.0) for y in (0.0, 0.5)], 5),
    "a point and a hand": (
        [point("a", (0.0, 0.0, 0.0), friction=0.5), grasp("hand", (0.4, 0.0, 1.0), max_force=100.0)],
        5,
    ),
    "one sole": ([sole("foot", (0.0, 0.0, 0.0), length=0.28, width=0.12, friction=0.7)], 6),
    "a knife": ([sole("foot", (0.0, 0.0, 0.0), length=0.28, width=1e-10, friction=0.7)], 5),
    "a thin sole": ([sole("foot", (0.0, 0.0, 0.0), length=0.28, width=1e-4, friction=0.7)], 6),
}


@pytest.mark.parametrize("name", FLAT)
def test_flat_stances_hold_what_they_can_and_nothing_beside_it(name, contact_program):
    """W_p of a flat stance has pairs of opposite rows; its wrenches have margin 0, not less."""
    contacts, rank = FLAT[name]
    stance = Stance(contacts, 1000.0)
    W, program = wrench_polytope(stance), contact_program(stance)
    opposite = np.abs(W.H[:, None] + W.H[None]).max(axis=-1) < 1e-12
    pairs = (opposite & (np.abs(W.h[:, None] + W.h[None]) < 1e-5)).sum() // 2
    assert pairs == 6 - rank
    rng = np.random.default_rng(0)
    assert_same_set(W, program, rng)
    inside = np.mean([program.support(rng.normal(size=6))[1] for _ in range(12)], axis=0)
    assert -1e-5 < W.margin(inside) < (1e-5 if rank < 6 else np.inf)
    for row in W.H[len(W) - 2 * pairs :]:
        assert W.margin(inside + row) == pytest.approx(-1.0, abs=1e-5)


def test_flight_admits_only_the_zero_wrench():
    W = wrench_polytope(Stance([]))
    assert abs(W.margin(np.zeros(6))) < 1e-9
    assert W.margin(pseudo_wrench(79.0, (0, 0, 1), (0, 0, -9.81))) == pytest.approx(0.0, abs=1e-9)
    assert W.margin(pseudo_wrench(79.0, (0, 0, 1), (0, 0, 0))) == pytest.approx(-79 * 9.81)


def test_rows_are_of_unit_length_and_distinct(two_soles):
    W = wrench_polytope(two_soles)
    np.testing.assert_allclose(np.linalg.norm(W.H, axis=1), 1.0, atol=1e-12)
    apart = np.abs(W.H[:, None] - W.H[None]).max(axis=-1) + np.eye(len(W))
    assert apart.min() > 1e-6


def test_a_single_sole_has_sixteen_cone_rows_and_the_cap():
    stance = Stance([sole("left_foot", (0.2, 0.4, 0.1), 0.3, length=0.28, width=0.12, friction=0.7)], 800.0)
    W = wrench_polytope(stance)
    assert len(W) == 17
    assert np.sum(W.h > 1e-6) == 1


def test_equal_stances_give_equal_bits(two_soles):
    first, second = wrench_polytope(two_soles), wrench_polytope(two_soles)
    assert np.array_equal(first.H, second.H)
    assert np.array_equal(first.h, second.h)


def test_a_redundant_cap_changes_nothing(two_soles):
    generous = Stance(
        [
            sole(c.effector, c.position, length=0.28, width=0.12, friction=0.7, normal_force_cap=5000.0)
            for c in two_soles
        ],
        1500.0,
    )
    w = np.random.default_rng(0).normal(size=(50, 6)) * [300, 300, 900, 80, 80, 40]
    np.testing.assert_allclose(
        wrench_polytope(generous).margin(w), wrench_polytope(two_soles).margin(w), atol=1e-9
    )


def test_own_caps_that_sum_to_the_stance_cap_replace_it(contact_program):
    feet = [
        sole(f"foot_{i}", (0.0, 0.2 * i, 0.0), length=0.28, width=0.12, friction=0.7, normal_force_cap=500.0)
        for i in range(2)
    ]
    with_sum = wrench_polytope(Stance(feet, 1000.0))
    without = wrench_polytope(Stance(feet))
    assert len(with_sum) == len(without)
    three = Stance([*feet, point("hand", (0.5, 0.0, 1.0), friction=0.5, normal_force_cap=500.0)], 1000.0)
    assert_same_set(wrench_polytope(three), contact_program(three), np.random.default_rng(1))


@pytest.mark.parametrize(
    "contacts",
    [
        [sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7)],
        [
            sole("right_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7, normal_force_cap=500.0),
            point("left_foot", (0, 0, 0), friction=0.7),
        ],
    ],
)
def test_an_uncapped_stance_is_refused_with_the_remedy(contacts):
    with pytest.raises(ContactError, match=r"'left_foot'; valid: a normal_force_cap \[N\]"):
        wrench_polytope(Stance(contacts))


def test_unknown_friction_models_and_references_are_refused(two_soles):
    with pytest.raises(ContactError, match="'outer', 'inner', 'cone'"):
        Stance(two_soles.contacts, 1000.0, "circle")
    with pytest.raises(ContactError, match="reference"):
        wrench_polytope(two_soles, reference=(0, 0))


def test_pseudo_wrench_of_a_point_mass_and_of_a_body():
    x, a, rate = np.array([0.1, 0.2, 0.9]), np.array([1.0, -2.0, 0.5]), np.array([3.0, 4.0, 5.0])
    f = 79.0 * (a - GRAVITY_VECTOR)
    np.testing.assert_allclose(pseudo_wrench(79.0, x, a), [*f, *np.cross(x, f)])
    np.testing.assert_allclose(pseudo_wrench(79.0, x, a, rate), [*f, *(np.cross(x, f) + rate)])
    np.testing.assert_allclose(pseudo_wrench(79.0, x, a, rate, reference=x), [*f, *rate], atol=1e-12)


def test_pseudo_wrench_equals_the_rate_of_momentum_minus_gravity():
    """4.51 in its printed form: [m (a - g); d/dt (x ^ m v + L) - x ^ m g]."""
    rng = np.random.default_rng(0)
    x0, v0, a, L0, rate = rng.normal(size=(5, 3))
    m, dt = 60.0, 1e-5

    def momentum(t):
        x, v = x0 + v0 * t + a * t * t / 2, v0 + a * t
        return np.cross(x, m * v) + L0 + rate * t

    L_dot = (momentum(dt) - momentum(-dt)) / (2 * dt)
    g = np.array([0, 0, -9.81])
    # Central differences: rounding of 1e-16 * 100 / 1e-5.
    np.testing.assert_allclose(
        pseudo_wrench(m, x0, a, rate)[3:], L_dot - np.cross(x0, m * g), rtol=1e-8, atol=1e-6
    )


def test_pseudo_wrench_is_vectorised():
    rng = np.random.default_rng(0)
    x, a = rng.normal(size=(7, 4, 3)), rng.normal(size=(4, 3))
    w = pseudo_wrench(60.0, x, a)
    assert w.shape == (7, 4, 6)
    np.testing.assert_allclose(w[3, 2], pseudo_wrench(60.0, x[3, 2], a[2]))


@pytest.mark.parametrize("mass", [0.0, -3.0, np.nan])
def test_a_body_without_mass_is_refused(mass):
    with pytest.raises(InputError, match=r"mass \[kg\]"):
        pseudo_wrench(mass, (0, 0, 1), (0, 0, 0))


@given(seeds)
def test_moving_the_reference_is_exact(random_stance, seed):
    """A polytope moved to another reference is the one computed there."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, most=2)
    to = rng.normal(size=3)
    moved, direct = wrench_polytope(stance).at_reference(to), wrench_polytope(stance, reference=to)
    x, a = rng.normal(size=(2, 20, 3))
    w = pseudo_wrench(79.0, x, a, None, to)
    np.testing.assert_allclose(moved.margin(w), direct.margin(w), atol=1e-6)


@given(seeds)
def test_margins_about_the_com_do_not_feel_a_rigid_motion_of_the_world(random_stance, seed):
    """Stance and state turned and shifted together (gravity included) keep their margins."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng, kinds=("sole",), most=3)
    turn, shift = rotation_from_rpy(*rng.uniform(-3, 3, 3)), 2 * rng.normal(size=3)
    turned = Stance([_moved_contact(c, turn, shift) for c in stance], 1000.0)
    com, force, moment = (
        rng.normal(size=3) * 0.2 + [0, 0, 0.9],
        rng.normal(size=3) * 100 + [0, 0, 700],
        rng.normal(size=3) * 20,
    )
    w = np.concatenate([force, np.cross(com, force) + moment])
    new_com = turn @ com + shift
    new_w = np.concatenate([turn @ force, np.cross(new_com, turn @ force) + turn @ moment])
    before = stability_margins(wrench_polytope(stance), w, com)
    after = stability_margins(wrench_polytope(turned), new_w, new_com)
    for name in ("wrench_about_com", "force", "moment"):
        # Nearly level stances (heights 1e-9 apart) merge facets differently after rounding.
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-6, abs=1e-3)


def _moved_contact(contact, turn, shift):
    pose = {"position": turn @ contact.position + shift, "rotation": turn @ contact.rotation_contact_to_world}
    return sole(contact.effector, length=0.28, width=0.12, friction=contact.friction, **pose)


@given(seeds, st.integers(1, 2))
def test_margins_off_a_flat_polytope_do_not_depend_on_the_basis_of_its_equalities(seed, count):
    """Points on a turned and shifted ground; about the CoM the margin is the distance to the flat."""
    rng = np.random.default_rng(seed)
    turn, shift = rotation_from_rpy(*rng.uniform(-3, 3, 3)), 2 * rng.normal(size=3)
    places = rng.normal(size=(count, 3)) * 0.3
    com, w = (
        np.array([0.0, 0.0, 0.9]),
        rng.normal(size=6) * [100, 100, 100, 30, 30, 30] + [0, 0, 700, 0, 0, 0],
    )
    found = []
    for rotation, moved in ((np.eye(3), np.zeros(3)), (turn, shift)):
        contacts = [
            point(f"p{k}", rotation @ place + moved, friction=0.5, rotation=rotation)
            for k, place in enumerate(places)
        ]
        x, force = rotation @ com + moved, rotation @ w[:3]
        wrench = np.concatenate([force, np.cross(x, force) + rotation @ w[3:]])
        W = wrench_polytope(Stance(contacts, 1000.0))
        margins = stability_margins(W, wrench, x)
        found.append([margins.force, margins.moment, margins.wrench_about_com])
        assert W.limiting(wrench, x).margin == pytest.approx(float(margins.wrench_about_com), abs=1e-6)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5, atol=1e-5)
    span = np.hstack([np.vstack([np.eye(3), skew(place - com)]) for place in places])
    off = np.linalg.norm(w - span @ np.linalg.pinv(span) @ w)
    W = wrench_polytope(Stance([point(f"p{k}", p, friction=0.5) for k, p in enumerate(places)], 1000.0))
    facets = W.at_reference(com).distances(w)[: -2 * len(W.equalities[1])].min()
    assert found[0][2] == pytest.approx(min(facets, -off), abs=1e-6)


# [Qiu2012]_ Tables 5.3 and 5.4: feet look along world +y (soles are long along y).
PLATFORM_FEET = [
    {"left": (-0.1, 0.0, 0.0), "right": (0.1, 0.0, 0.0)},
    {"right": (0.1, 0.0, 0.0)},
    {"left": (0.2, 0.4, 0.0), "right": (0.1, 0.0, 0.0)},
    {"left": (0.2, 0.4, 0.0)},
    {"left": (0.2, 0.4, 0.0), "right": (0.7, 0.65, 0.2)},
    {"right": (0.7, 0.65, 0.2)},
    {"left": (0.5, 0.65, 0.2), "right": (0.7, 0.65, 0.2)},
]
PLATFORM_KEYS = np.array([0.0, 0.321, 0.721, 0.93, 1.73, 2.837, 3.637, 4.193])
PLATFORM_POINTS = [
    [0.0, 0.0, 0.92], [0.0, 0.0, 0.92], [0.024, 0.007, 0.972], [0.091, 0.027, 0.942],
    [0.118, 0.117, 0.752], [0.268, 0.643, 1.076], [0.132, 0.16, 0.64], [0.842, 0.761, 1.002],
    [0.658, 0.523, 0.66], [0.687, 0.656, 0.95], [0.6, 0.65, 0.86], [0.6, 0.65, 0.86],
]  # fmt: skip
PLATFORM_MARGINS = [27.1, 24.1, 60.9, 12.1, 42.6, 29.9, 30.5]


@pytest.mark.parametrize("phase", range(7))
def test_published_platform_spline_is_judged_as_before(phase):
    """Table 5.4's spline, 79 kg, sole 0.28 x 0.12, mu 0.7, cap 1500 N: minimum of each phase.

    The claim is more than 20 N.m everywhere; the printed digits give 12.1 in phase 4.
    """
    duration = PLATFORM_KEYS[-1]
    knots = np.concatenate([np.zeros(6), PLATFORM_KEYS[1:-1] / duration, np.ones(6)])
    spline = BSpline(knots, np.array(PLATFORM_POINTS), 5)
    s = np.linspace(*PLATFORM_KEYS[phase : phase + 2], 401) / duration
    feet = [
        sole(f"{name}_foot", p, np.pi / 2, length=0.28, width=0.12, friction=0.7)
        for name, p in PLATFORM_FEET[phase].items()
    ]
    W = wrench_polytope(Stance(feet, 1500.0))
    margins = W.margin(pseudo_wrench(79.0, spline(s), spline(s, 2) / duration**2))
    assert margins.min() == pytest.approx(PLATFORM_MARGINS[phase], abs=1.0)


CAR_FEET = {
    "LF1": ((0.191, -1.064, -0.485), 50),
    "LF2": ((-0.24, -0.737, -0.485), 90),
    "RF1": ((0.283, -0.937, -0.485), 50),
    "RF2": ((-0.624, -0.012, -0.232), 90),
}


def car_stance(supports, width):
    contacts = [
        sole(name, position, np.deg2rad(yaw + 90), length=0.24, width=width, friction=0.5)
        for name, (position, yaw) in CAR_FEET.items()
        if name in supports
    ]
    if "RH" in supports:
        contacts.append(grasp("RH", (-0.46, -0.056, 0.569), max_force=100.0))
    return Stance(contacts, 1000.0)


@pytest.mark.parametrize(
    ("width", "radii"), [(0.09, [35.17, 35.17, 32.63, 32.63]), (0.08, [None, None, 29.1, 29.1])]
)
def test_insphere_of_the_car_entry_is_the_published_one(width, radii):
    """Largest balls in consecutive intersections, moments about the H-point ([Qiu2012]_ 7.2.2: 32.63)."""
    phases = [("LF1", "RF1"), ("RF1",), ("LF2", "RF1"), ("LF2",), ("LF2", "RH")]
    polytopes = [wrench_polytope(car_stance(phase, width)) for phase in phases]
    for i, radius in enumerate(radii):
        if radius is not None:
            found = polytopes[i].intersection(polytopes[i + 1]).inscribed_ball()[1]
            assert found == pytest.approx(radius, abs=0.05)
