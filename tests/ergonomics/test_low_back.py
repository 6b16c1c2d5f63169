"""Load on L5/S1: equilibrium, the formula of the muscle model, and pressures measured in a disc."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human, kudoh
from manikin.body.strength import carrying
from manikin.ergonomics import low_back
from manikin.ergonomics.low_back import LEVER, compression_level, disc_load, l5s1_in_pelvis, low_back_load
from manikin.errors import BodyError, InputError
from manikin.numerics.spatial import GRAVITY

from .conftest import posture, still


def held(body, load=0.0, **angles):
    """Load on L5/S1 of a posture held with a load in both hands, upright pelvis."""
    carrier = carrying(body, load)
    motion = still(carrier, posture(carrier, **angles), duration=0.0, rate=1.0)
    return low_back_load(carrier, motion)


def test_the_formula_of_the_single_muscle():
    """A trunk of 350 N at 20 cm and a load of 450 N at 30 cm before a disc that is tilted by 55 degrees.

    With a lever of 5 cm the muscle pulls with (70 + 135) / 0.05 = 4100 N, the disc bears 4100 + 800 cos 55 =
    4559 N, and the shear is 800 sin 55 = 655 N: worked out by hand from the formula.
    """
    moment = 350.0 * 0.20 + 450.0 * 0.30
    tilt = np.deg2rad(55.0)
    muscle, compression, shear = disc_load(
        np.array([moment]), np.array([800.0 * np.cos(tilt)]), np.array([800.0 * np.sin(tilt)])
    )
    assert muscle == pytest.approx([4100.0])
    assert compression == pytest.approx([4559.0], abs=1.0)
    assert shear == pytest.approx([655.0], abs=1.0)


def test_levels_are_those_of_niosh():
    assert [compression_level(value) for value in (3400.0, 3401.0, 6400.0, 6401.0)] == [1, 2, 2, 3]


@pytest.mark.parametrize(("sex", "share"), [("male", 0.494), ("female", 0.451)])
def test_standing_bears_the_weight_above_the_lumbar_joint(sex, share):
    """Still and upright: the force is the weight of the segments above, its moment that of their centre.

    Their mass is, within 1 % of the body's, what Dumas et al. 2007 have above L5/S1.
    """
    body = human(sex=sex)
    q = posture(body, lumbar_flexion=15.0)
    found = low_back_load(body, still(body, q, duration=0.0, rate=1.0))
    above, com = _above(body, q)
    assert found.compression[0] - found.muscle[0] == pytest.approx(
        above * GRAVITY * np.cos(low_back.ENDPLATE_SLOPE)
    )
    assert found.shear[0] == pytest.approx(above * GRAVITY * np.sin(low_back.ENDPLATE_SLOPE))
    arm = com[0] - q[0] - l5s1_in_pelvis(body)[0]
    assert found.flexion_moment[0] == pytest.approx(above * GRAVITY * arm, rel=1e-9)
    assert found.side_moment[0] == pytest.approx(0.0, abs=1e-9)
    assert found.twist_moment[0] == pytest.approx(0.0, abs=1e-9)
    assert above / body.mass == pytest.approx(share, abs=0.01)


def _above(body, q):
    """Mass and centre (3,) of all segments above the lumbar joint [kg], [m]."""
    from manikin.kinematics.point_targets import SegmentPlacements

    names = [
        one.name for one in body.segments
        if one.name != "pelvis" and not any(part in one.name for part in ("thigh", "leg", "foot", "toes"))
    ]  # fmt: skip
    placed = SegmentPlacements(body, names).of(q[None])
    mass, moment = 0.0, np.zeros(3)
    for number, name in enumerate(names):
        segment = body.segment(name)
        place = q[:3] + placed.shifts[number, :, 0] + placed.turns[number, :, :, 0] @ segment.com
        mass, moment = mass + segment.mass, moment + segment.mass * place
    return mass, moment / mass


DISC, PRESSURE_TO_FORCE = 18.0e-4, 0.66
"""Area of the disc of the volunteer [m2], and force over pressure times area ([Wilke1999]_)."""


@pytest.mark.parametrize(
    ("load", "angles", "pressure"),
    [
        (0.0, {}, 0.50),  # relaxed standing
        (0.0, {"lumbar_flexion": 40.0, "thorax_flexion": 20.0}, 1.1),  # standing, flexed forward
        (20.0, {"left_elbow_flexion": 15.0, "right_elbow_flexion": 15.0}, 1.1),  # 20 kg close to the body
    ],
)
def test_pressures_measured_in_a_disc(load, angles, pressure):
    """Wilke et al. 1999, L4-L5 of a man of 70 kg: 594 N and 1307 N as forces.

    The postures are described in words only, so that a factor of 1.35 either way is what can be asked.
    """
    found = held(human(stature=1.74, mass=70.0), load, **angles)
    force = pressure * 1e6 * DISC * PRESSURE_TO_FORCE
    assert force / 1.35 < found.compression[0] < 1.35 * force


def test_a_load_adds_its_weight_and_its_moment():
    """Every kilogram adds as much: force by g, muscle by g times the lever of the hands."""
    body = human()
    angles = {"left_elbow_flexion": 90.0, "right_elbow_flexion": 90.0}
    none, ten, forty = (held(body, load, **angles) for load in (0.0, 10.0, 40.0))
    for name in ("flexion_moment", "compression", "shear"):
        plain, some, more = (getattr(one, name)[0] for one in (none, ten, forty))
        assert more - plain == pytest.approx(4.0 * (some - plain), rel=1e-9)
    assert ten.shear[0] - none.shear[0] == pytest.approx(10.0 * GRAVITY * np.sin(np.deg2rad(40.0)))
    assert forty.level == 2


def test_acceleration_counts():
    """A body that is accelerated upwards by g weighs double."""
    body = human()
    motion = still(body, posture(body, lumbar_flexion=30.0), duration=0.0, rate=1.0)
    lifted = np.zeros((1, body.nv))
    lifted[0, 2] = GRAVITY
    once, double = low_back_load(body, motion), low_back_load(body, replace(motion, a=lifted))
    for name in ("flexion_moment", "compression", "shear"):
        assert getattr(double, name) == pytest.approx(2.0 * getattr(once, name))


def test_a_hand_that_is_supported_relieves_the_back():
    """A force on the palm acts at the palm; where it is not known, neither is the load on the back."""
    body = human()
    q = posture(body, lumbar_flexion=40.0, left_shoulder_flexion=60.0, right_shoulder_flexion=60.0)
    names = ("left_foot", "right_foot", "left_hand", "right_hand")
    alone = low_back_load(body, still(body, q, duration=0.0, rate=1.0))
    pushed = still(
        body, q, duration=0.0, rate=1.0, contacts=names, forces={"left_hand": 50.0, "right_hand": 50.0}
    )
    supported = low_back_load(body, pushed)
    from manikin.motion.motion import effector_positions

    hands = effector_positions(body, pushed, names[2:])
    arm = np.mean([place[0, 0] for place in hands.values()]) - l5s1_in_pelvis(body)[0]
    assert alone.flexion_moment[0] - supported.flexion_moment[0] == pytest.approx(100.0 * arm)
    assert alone.shear[0] - supported.shear[0] == pytest.approx(100.0 * np.sin(np.deg2rad(40.0)))
    unknown = np.array(pushed.contact_force)
    unknown[:, 2] = np.nan
    assert not low_back_load(body, replace(pushed, contact_force=unknown)).known.any()


def test_a_moved_and_turned_body_has_the_same_loads():
    body = carrying(human(), 15.0, "left")
    q = posture(body, lumbar_flexion=30.0, left_shoulder_flexion=50.0)
    moved = np.array(q)
    moved[:3] += [10.0, -4.0, 1.0]
    moved[3:7] = [0.0, 0.0, np.sin(0.6), np.cos(0.6)]
    one, other = (low_back_load(body, still(body, place, duration=0.0, rate=1.0)) for place in (q, moved))
    for name in ("flexion_moment", "side_moment", "twist_moment", "compression", "shear"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-9, abs=1e-9)
    assert abs(one.side_moment[0]) > 10.0  # the load is on the left


def test_other_bodies_and_levers_are_refused():
    with pytest.raises(BodyError, match="has no L5/S1; valid: a human"):
        low_back_load(kudoh(), still(kudoh(), kudoh().standing_posture()))
    body = human()
    with pytest.raises(InputError, match="lever of the back's muscles"):
        low_back_load(body, still(body, body.standing_posture()), lever=0.5)
    thin, thick = (
        low_back_load(body, still(body, posture(body, lumbar_flexion=40.0)), lever=lever)
        for lever in (LEVER, 0.06)
    )
    assert thick.muscle[0] == pytest.approx(thin.muscle[0] * LEVER / 0.06)
