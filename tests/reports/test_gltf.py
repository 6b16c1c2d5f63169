"""GLB files, read back by the standard's own rules and by another program."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manikin.body import human, quadruped
from manikin.body.segments import segment_triangles
from manikin.body.skin import segment_frames, skin_of
from manikin.motion import Motion
from manikin.reports.gltf import TO_GLTF, to_glb
from manikin.scene import Box, Obstacle, Scene

COUNT = 5


@pytest.fixture(scope="module")
def swinging():
    """A person who turns, moves and bends all joints."""
    body = human()
    rng = np.random.default_rng(3)
    q = np.tile(body.standing_posture(), (COUNT, 1))
    q[:, :3] += np.linspace(0.0, 1.0, COUNT)[:, None] * [1.0, 0.5, 0.1]
    q[:, 3:7] = Rotation.from_euler("zyx", rng.uniform(-0.5, 0.5, (COUNT, 3))).as_quat()
    q[:, 7:] += rng.uniform(-0.3, 0.3, (COUNT, body.nq - 7))
    rates, path = np.zeros((COUNT, body.nv)), np.zeros((COUNT, 3))
    touching, forces = np.zeros((COUNT, 1), dtype=bool), np.zeros((COUNT, 1, 6))
    return body, Motion(
        time=np.arange(COUNT) / 10.0, q=q, v=rates, a=rates, tau=rates, com=path, angular_momentum=path,
        margin=np.zeros(COUNT), support=touching, contact_force=forces, contact_names=("left_foot",),
        joint_names=body.joint_names,
    )  # fmt: skip


def parsed(data):
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    size = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + size])
    binary = data[28 + size :]
    assert (
        len(binary)
        == document["buffers"][0]["byteLength"]
        == int.from_bytes(data[20 + size : 24 + size], "little")
    )
    kinds, widths = {5126: "<f4", 5123: "<u2", 5125: "<u4"}, {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}

    def array(number):
        entry = document["accessors"][number]
        view = document["bufferViews"][entry["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        part = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.frombuffer(part, kinds[entry["componentType"]]).reshape(
            entry["count"], widths[entry["type"]]
        )

    return document, array


def test_skinned_vertices_are_those_of_the_motion(swinging):
    """Joint transforms from the file's nodes and animation, applied as the standard says: within 0.1 mm."""
    body, motion = swinging
    document, array = parsed(to_glb(body, motion))
    skin, nodes = document["skins"][0], document["nodes"]
    assert len(skin["joints"]) == len(body.segments) == 19
    mesh = next(node["mesh"] for node in nodes if "skin" in node)
    parts = document["meshes"][mesh]["primitives"]
    used = {primitive["material"] for item in document["meshes"] for primitive in item["primitives"]}
    assert used == set(range(len(document["materials"])))
    names = parts[0]["attributes"]
    places, bones, weights = (array(names[key]) for key in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
    assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-6
    assert bones[weights == 0.0].max(initial=0) == 0
    inverse = array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    animation = document["animations"][0]
    surface = skin_of(body)
    for k in range(COUNT):
        local = [np.eye(4) for _ in nodes]
        for number, node in enumerate(nodes):
            local[number][:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
            local[number][:3, :3] = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
        for channel in animation["channels"]:
            value = array(animation["samplers"][channel["sampler"]]["output"])[k]
            number = channel["target"]["node"]
            if channel["target"]["path"] == "rotation":
                local[number][:3, :3] = Rotation.from_quat(value).as_matrix()
            else:
                local[number][:3, 3] = value
        world = {}

        def walk(number, above, world=world, local=local):
            world[number] = above @ local[number]
            for child in nodes[number].get("children", ()):
                walk(child, world[number])

        walk(document["scenes"][0]["nodes"][0], np.eye(4))
        joints = np.array([world[number] for number in skin["joints"]]) @ inverse
        blend = np.einsum("nk,nkij->nij", weights, joints[bones])
        found = np.einsum("nij,nj->ni", blend[:, :3, :3], places) + blend[:, :3, 3]
        wanted, _ = surface.posed(*segment_frames(body, motion.q[k]))
        assert found == pytest.approx(wanted @ TO_GLTF.T, abs=1e-4)


def test_a_body_without_that_surface_has_the_shapes_of_its_segments(swinging):
    """Each vertex follows one segment; in the frame of that segment it is where the shape has it."""
    body = quadruped()
    q = np.tile(body.standing_posture(), (2, 1))
    still, nowhere = np.zeros((2, body.nv)), np.zeros((2, 3))
    motion = replace(
        swinging[1], time=np.array([0.0, 0.1]), q=q, v=still, a=still, tau=still, com=nowhere,
        angular_momentum=nowhere, margin=np.zeros(2), support=np.zeros((2, 1), dtype=bool),
        contact_force=np.zeros((2, 1, 6)), joint_names=body.joint_names,
    )  # fmt: skip
    document, array = parsed(to_glb(body, motion))
    names = document["meshes"][0]["primitives"][0]["attributes"]
    bones, places = array(names["JOINTS_0"])[:, 0], array(names["POSITION"])
    for number, segment in enumerate(body.segments):
        shape = segment_triangles(segment)
        assert places[bones == number] == pytest.approx(
            np.empty((0, 3)) if shape is None else shape[0], abs=1e-6
        )


def test_another_program_reads_body_and_scene(swinging, tmp_path):
    body, motion = swinging
    scene = Scene([Obstacle("step", Box([0.4, 0.6, 0.2]), translation=[0.5, 0.0, 0.1])])
    (tmp_path / "motion.glb").write_bytes(to_glb(body, motion, scene))
    found = trimesh.load(tmp_path / "motion.glb")
    names = set(found.geometry)
    assert any("step" in name for name in names)
    step = next(part for name, part in found.geometry.items() if "step" in name)
    assert step.bounds == pytest.approx(np.array([[0.3, -0.3, 0.0], [0.7, 0.3, 0.2]]), abs=1e-6)
    assert len((tmp_path / "motion.glb").read_bytes()) < 3e6
