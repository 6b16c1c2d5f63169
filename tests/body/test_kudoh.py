"""The body of Kudoh (2002): structure, masses, lengths, postures."""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import Configuration, are_mirrored, kudoh, random_configuration
from manikin.body.further_bodies import HIP_WIDTH, PARTS, SHOULDER_WIDTH
from manikin.body.human_parts import HUMAN_HINGES
from manikin.simulation import compile_model

PAIRED = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")


@pytest.fixture(scope="module")
def body():
    return kudoh()


@pytest.fixture(scope="module")
def printed():
    """What the thesis prints, where it is at hand."""
    file = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "kudoh.json"
    if not file.exists():
        pytest.skip(f"{file} is not here")
    return json.loads(file.read_text())["body_model"]


def test_fifteen_segments_and_34_joint_angles(body):
    """14 joints: neck, waist, shoulders, wrists, hips, ankles are balls, elbows and knees pins (2.2)."""
    assert len(body.segments) == 15
    assert len(body.hinges) == 34
    balls = [segment.name for segment in body.segments if len(segment.hinges) == 3]
    pins = [segment.name for segment in body.segments if len(segment.hinges) == 1]
    assert len(balls) + len(pins) == 14
    assert sorted(pins) == ["left_forearm", "left_shank", "right_forearm", "right_shank"]
    legs = sum(len(body.segment(name).hinges) for name in ("left_thigh", "left_shank", "left_foot"))
    assert legs == 7


def test_it_weighs_70_kg(body):
    """35 kg of trunk and 17.5 kg of limbs a side: Table 3.1 lists one side, and the sum is exact."""
    assert body.mass == 70.0
    sides = sum(PARTS[name].mass for name in PAIRED)
    assert sum(PARTS[name].mass for name in ("head", "chest", "loins")) == pytest.approx(35.0, abs=1e-12)
    assert sides == pytest.approx(17.5, abs=1e-12)
    assert pin.computeTotalMass(body.pinocchio) == pytest.approx(70.0, abs=1e-12)


def test_masses_lengths_and_widths_are_those_printed(body, printed):
    for row in (entry["value"] for entry in printed["segments"]):
        part = PARTS[row["segment"].replace(" ", "_")]
        assert (part.mass, part.length) == (row["mass_kg"], row["length_m"])
    radii = printed["cylinder_radius_if_density_1000_m"]["value"]
    for name, radius in radii.items():
        assert PARTS[name.replace(" ", "_")].radius == pytest.approx(radius, abs=5e-5)  # as rounded there
    assert body.mass == printed["total_mass_kg"]["value"]
    assert len(body.hinges) == printed["dof_open"]["value"]
    widths = printed["shoulder_width_m"]["value"], printed["hip_width_m"]["value"]
    assert widths == (SHOULDER_WIDTH, HIP_WIDTH)
    assert body.stature - 0.07 == pytest.approx(printed["stature_without_foot_height_m"]["value"])


def test_the_centre_of_mass_stands_878_mm_above_the_ankle(body):
    """Upright, every centre at mid-length; the thesis' feet have no height, ours lower it by 1.3 mm."""
    state = Configuration(body, body.zero_posture())
    height = state.com[2] - state.segment_placement("left_foot")[1][2]
    foot = 2 * PARTS["foot"].mass * 0.035 / body.mass
    assert height + foot == pytest.approx(0.878, abs=5e-4)


def test_joints_bend_as_those_of_the_human(body):
    """Every range is one of the human's, the waist's the sum of lumbar and thorax."""
    for hinge in body.hinges:
        name = hinge.name.removeprefix("left_").removeprefix("right_")
        name = {"wrist_rotation": "forearm_pronation", "ankle_rotation": "knee_rotation"}.get(name, name)
        entries = [
            entry
            for group in HUMAN_HINGES.values()
            for entry in group
            if entry.name in (name, name.replace("waist", "lumbar"), name.replace("waist", "thorax"))
        ]
        assert len(entries) == (2 if "waist" in name else 1)
        assert hinge.lower == pytest.approx(np.deg2rad(sum(entry.lower_deg for entry in entries)))
        assert hinge.upper == pytest.approx(np.deg2rad(sum(entry.upper_deg for entry in entries)))


def test_its_limbs_are_mirror_images(body):
    for first, second in (body.limbs[:2], body.limbs[2:]):
        assert are_mirrored(body, first, second)


def test_it_stands_on_its_soles_and_touches_nothing_of_itself(body):
    q = body.standing_posture()
    state = Configuration(body, q)
    for foot in ("left_foot", "right_foot"):
        rotation, position = state.effector_placement(foot)
        np.testing.assert_allclose(rotation[:, 2], [0, 0, 1], atol=1e-12)
        assert position[2] == pytest.approx(0.0, abs=1e-12)
    ahead = state.com[0] - state.effector_placement("left_foot")[1][0]
    assert abs(ahead) < 0.25 * body.sole_length
    geometry, data = body.geometry, body.pinocchio.createData()
    placed = geometry.createData()
    pin.updateGeometryPlacements(body.pinocchio, data, geometry, placed, q)
    pin.computeDistances(geometry, placed)
    assert min(result.min_distance for result in placed.distanceResults) > 0.01


def test_both_engines_see_the_same_body(body):
    """Mass matrix of Pinocchio and of MuJoCo at a random configuration."""
    import mujoco

    model = compile_model(body)
    q = random_configuration(body, np.random.default_rng(0))
    data = mujoco.MjData(model.mujoco)
    model.set_state(data, q)
    full = np.zeros((body.nv, body.nv))
    mujoco.mj_fullM(model.mujoco, data, full)
    turn = np.eye(body.nv)
    turn[:3, :3] = Configuration(body, q).segment_placement("loins")[0]
    np.testing.assert_allclose(turn.T @ full @ turn, Configuration(body, q).mass_matrix, atol=1e-9)
