"""Published strengths of the human body, in the right direction of every joint."""

import numpy as np
import pytest

from manikin.body import BodyModel, Configuration, human, kudoh
from manikin.body.strength import GROUP_AGES, HUMAN_STRENGTH, LegStrength, Women, age_factor, hinge_strength
from manikin.errors import BodyError
from manikin.numerics.spatial import GRAVITY

MAN, WOMAN = (85.52, 1.756, "male"), (67.76, 1.628, "female")
"""Mean man and woman of ANSUR II: mass [kg], stature [m], sex."""


def limits(body: BodyModel, name: str) -> tuple[float, float]:
    number = body.joint_index(name)
    return float(body.torque_lower[number]), float(body.torque_upper[number])


def at_rest(
    body: BodyModel, angles: dict[str, float], loads: dict[str, tuple[float, float]]
) -> dict[str, float]:
    """Joint torques that hold a posture.

    Args:
        body: The body.
        angles: Hinge angles [deg].
        loads: For a foot, the share of the weight on it and how far before the ankle it presses [m].
    """
    state = Configuration(body, body.posture({name: float(np.deg2rad(a)) for name, a in angles.items()}))
    torque = np.array(state.nonlinear_effects)
    for foot, (share, ahead) in loads.items():
        jacobian = state.point_jacobian(foot, np.array([ahead, 0.0, 0.0]))
        torque -= jacobian.T @ np.array([0.0, 0.0, share * body.mass * GRAVITY])
    return dict(zip(body.joint_names, torque[6:], strict=True))


@pytest.mark.parametrize(
    ("name", "coefficients"),
    [  # Anderson, Madigan and Nussbaum 2007, Table 3, C1: against and along the hinge, men and women of 18-25
        ("hip_flexion", ((0.161, 0.113), (0.181, 0.127))),
        ("knee_flexion", ((0.163, 0.087), (0.159, 0.080))),
        ("ankle_dorsiflexion", ((0.095, 0.033), (0.104, 0.027))),
    ],
)
def test_legs_have_the_published_torque_per_weight_and_stature(name, coefficients):
    for sex, wanted in zip(("male", "female"), coefficients, strict=True):
        body = human(1.70, 65.0, sex, age=21.5)
        unit = 65.0 * GRAVITY * 1.70
        found = np.array(limits(body, f"left_{name}")) / unit
        np.testing.assert_allclose(found, [-wanted[0], wanted[1]], rtol=1e-12)


def test_reference_people_have_the_published_strength():
    """80 kg and 1.80 m, 62 kg and 1.65 m, in N.m as computed from the paper's table."""
    wanted = {
        "hip_flexion": ((227, 160), (182, 128)), "knee_flexion": ((230, 123), (160, 80)),
        "ankle_dorsiflexion": ((134, 47), (104, 27)),
    }  # fmt: skip
    for name, (man, woman) in wanted.items():
        np.testing.assert_allclose(hinge_strength(name, 80.0, 1.80, "male", 20.0), man, atol=0.7)
        np.testing.assert_allclose(hinge_strength(name, 62.0, 1.65, "female", 20.0), woman, atol=0.7)


def test_a_man_of_thirty_lifts_his_foot_with_45_newton_metres():
    """And pushes it down with three times as much: the old symmetric limit was 200 N.m."""
    down, up = limits(human(), "left_ankle_dorsiflexion")
    assert 40.0 < up < 50.0
    assert 2.5 < -down / up < 3.5


def test_tables_of_groups_are_met_at_their_ages():
    for against, along in HUMAN_STRENGTH.values():
        for entry in (against, along):
            if isinstance(entry, LegStrength):
                for sex, groups in (("male", entry.male), ("female", entry.female)):
                    found = [entry.torque(70.0, 1.7, sex, age) / (70.0 * GRAVITY * 1.7) for age in GROUP_AGES]
                    np.testing.assert_allclose(found, groups, rtol=1e-12)


def test_age_takes_strength_as_published():
    """Men of 75 have 54 to 89 % of those of 25, women 48 to 92 % of those of 40, falling all the way."""
    assert age_factor("male", 25.0) == age_factor("female", 40.0) == 1.0
    assert 0.54 < age_factor("male", 75.0) < 0.89
    assert 0.48 < age_factor("female", 75.0) < 0.92
    for sex, first in (("male", 25), ("female", 40)):
        values = [age_factor(sex, age) for age in range(first, 91)]
        assert np.all(np.diff(values) < 0.0)
    for name, (against, along) in HUMAN_STRENGTH.items():
        young, old = hinge_strength(name, *MAN, age=25.0), hinge_strength(name, *MAN, age=80.0)
        if not isinstance(against, LegStrength):
            np.testing.assert_allclose(np.divide(old, young), age_factor("male", 80.0), rtol=1e-12)
        assert isinstance(against, LegStrength) == isinstance(along, LegStrength)


def test_men_are_as_much_stronger_than_women_as_published():
    """1.5 to 2 times (Danneskiold-Samsoe 2009); wrists 1.56, shoulders 2; legs as in Anderson's groups.

    Abductors of the hip have 1.29 and 1.13 N.m/kg (Sugimoto 2014).
    """
    for name, entries in HUMAN_STRENGTH.items():
        ratio = np.divide(hinge_strength(name, *MAN, age=22.0), hinge_strength(name, *WOMAN, age=22.0))
        for entry, found in zip(entries, ratio, strict=True):
            if isinstance(entry, LegStrength):
                assert 1.1 < found < 1.8
            elif entry.women is Women.WRIST:
                assert found == pytest.approx(1.0 / 0.641, rel=0.05)
            elif entry.women is Women.ABDUCTION:
                assert found == pytest.approx(1.29 * MAN[0] / (1.13 * WOMAN[0]))
            else:
                assert 1.5 - 1e-9 <= found <= 2.0 + 1e-9


def test_strength_scales_every_limit_and_nothing_else():
    plain, strong = human(), human(strength=1.3)
    np.testing.assert_allclose(strong.torque_lower, 1.3 * plain.torque_lower, rtol=1e-12)
    np.testing.assert_allclose(strong.torque_upper, 1.3 * plain.torque_upper, rtol=1e-12)
    np.testing.assert_array_equal(strong.velocity_limit, plain.velocity_limit)
    assert strong.mass == plain.mass


def test_both_sides_are_equally_strong():
    body = human()
    for name in body.joint_names:
        if name.startswith("left_"):
            assert limits(body, name) == limits(body, name.replace("left_", "right_"))


def test_torque_share_is_of_the_limit_in_its_direction():
    body = human()
    np.testing.assert_allclose(body.torque_share(body.torque_lower), 1.0)
    np.testing.assert_allclose(body.torque_share(0.5 * body.torque_upper), 0.5)
    assert body.torque_share(np.stack([body.torque_upper, body.torque_lower])).shape == (2, 39)


# --- signs: what holds a posture is the muscle that holds it in people --------------------------------


def test_tiptoe_needs_plantar_flexion_and_the_heels_dorsiflexion():
    """The weight at the balls, 0.13 m before the ankle: mg x 0.065 on each, less the feet's own moment."""
    body = human()
    feet = ("left_foot", "right_foot")
    tiptoe = at_rest(body, {}, dict.fromkeys(feet, (0.5, 0.13)))["left_ankle_dorsiflexion"]
    heels = at_rest(body, {}, dict.fromkeys(feet, (0.5, -0.04)))["left_ankle_dorsiflexion"]
    assert tiptoe == pytest.approx(-0.065 * body.mass * GRAVITY, abs=1.0)
    assert heels > 0.0
    lower, upper = limits(body, "left_ankle_dorsiflexion")
    assert -lower > 2.5 * upper


def test_getting_up_from_a_squat_needs_extension_of_knee_and_hip():
    body = human()
    angles = {"lumbar_flexion": 30.0} | {
        f"{side}_{name}": angle
        for side in ("left", "right")
        for name, angle in (("hip_flexion", 100), ("knee_flexion", 110), ("ankle_dorsiflexion", 30))
    }
    state = Configuration(body, body.posture({k: float(np.deg2rad(a)) for k, a in angles.items()}))
    rotation, ankle = state.segment_placement("left_foot")
    ahead = float(rotation[:, 0] @ (state.com - ankle))
    torque = at_rest(body, angles, {f"{side}_foot": (0.5, ahead) for side in ("left", "right")})
    assert torque["left_knee_flexion"] < -20.0
    assert torque["left_hip_flexion"] < -10.0
    for name in ("left_knee_flexion", "left_hip_flexion"):
        lower, upper = limits(body, name)
        assert -lower > upper


def test_leaning_forward_needs_extension_of_trunk_and_neck():
    body = human()
    torque = at_rest(body, {"lumbar_flexion": 60.0, "thorax_flexion": 20.0}, {})
    for name in ("lumbar_flexion", "thorax_flexion", "neck_flexion"):
        assert torque[name] < 0.0
        lower, upper = limits(body, name)
        assert -lower > 1.5 * upper


def test_one_leg_is_held_by_the_abductors_of_the_hip():
    """The foot is below the middle of the pelvis: the weight less the leg's, 0.0875 m beside the hip."""
    body = human()
    torque = at_rest(body, {"left_hip_abduction": -6.0}, {"left_foot": (1.0, 0.0)})
    assert torque["left_hip_abduction"] == pytest.approx(0.92 * body.mass * GRAVITY * 0.0875, rel=0.05)


@pytest.mark.parametrize(
    ("angles", "name", "sign"),
    [
        ({"left_shoulder_flexion": 80.0}, "left_shoulder_flexion", 1),
        ({"left_shoulder_abduction": 70.0}, "left_shoulder_abduction", 1),
        ({"left_elbow_flexion": 90.0}, "left_elbow_flexion", 1),
        ({"left_hip_flexion": 90.0}, "left_hip_flexion", 1),
        # Palm down on a forearm that is held forward: the hand hangs down, the extensors hold it.
        ({"left_elbow_flexion": 90.0, "left_forearm_pronation": 80.0}, "left_wrist_flexion", -1),
        ({"left_elbow_flexion": 90.0, "left_forearm_pronation": -80.0}, "left_wrist_flexion", 1),
        # Thumb up: the hand hangs down to the little finger, the radial muscles hold it.
        ({"left_elbow_flexion": 90.0}, "left_wrist_radial_deviation", 1),
    ],
)
def test_parts_are_held_up_by_the_muscles_above_them(angles, name, sign):
    assert sign * at_rest(human(), angles, {})[name] > 0.0


def test_the_forearm_across_the_chest_is_turned_in():
    """Positive rotation of the shoulder carries the hand of a bent elbow inward, to the other side."""
    body = human()
    angles = {"left_elbow_flexion": 0.5 * np.pi}
    still = Configuration(body, body.posture(angles)).effector_placement("left_hand")[1]
    turned = Configuration(body, body.posture(angles | {"left_shoulder_rotation": 0.5}))
    assert turned.effector_placement("left_hand")[1][1] < still[1] - 0.05
    lower, upper = limits(body, "left_shoulder_rotation")
    assert upper == pytest.approx(-lower * 52.0 / 33.0)


# --- other bodies and wrong values ----------------------------------------------------------------------


def test_the_body_of_kudoh_keeps_its_symmetric_limits():
    body = kudoh()
    np.testing.assert_array_equal(body.torque_lower, -body.torque_upper)
    assert limits(body, "left_knee_flexion")[1] == pytest.approx(260.0 * 70.0 * 1.72 / (79.0 * 1.75))


@pytest.mark.parametrize(
    "wrong", [{"age": 12.0}, {"age": float("nan")}, {"strength": 0.0}, {"strength": -1.0}]
)
def test_an_age_or_strength_of_nobody_is_refused(wrong):
    with pytest.raises(BodyError, match=next(iter(wrong))):
        human(**wrong)
