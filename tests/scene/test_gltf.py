"""glTF files as obstacles: places by their nodes, z up, and one line for what is broken or hostile."""

import base64
import json

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from tests.reports.export.test_bvh import make_motion
from trimesh.transformations import compose_matrix

from manikin.body import quadruped
from manikin.errors import SceneError
from manikin.reports.gltf import to_glb
from manikin.scene import Box, Obstacle, Scene, load_mesh

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def placed_scene():
    """Two boxes, one of them placed twice, under nodes that turn, scale and mirror."""
    scene, graph = trimesh.Scene(), np.random.default_rng(3)
    table, leg = trimesh.creation.box((1.0, 0.1, 2.0)), trimesh.creation.box((0.1, 0.8, 0.2))
    group = compose_matrix(angles=graph.uniform(-1, 1, 3), translate=(2.0, 0.5, -1.0), scale=(1.0, 2.0, 1.0))
    scene.graph.update("group", matrix=group)
    scene.add_geometry(table, "table", parent_node_name="group", geom_name="table")
    mirror = compose_matrix(scale=(-1.0, 1.0, 1.0), translate=(0.4, -0.4, 0.0))
    scene.add_geometry(
        leg, "left", parent_node_name="group", geom_name="leg", transform=compose_matrix(angles=(0, 0.3, 0))
    )
    scene.graph.update("right", "group", geometry="leg", matrix=mirror)
    return scene


def minimal(**changes):
    """A glTF of one triangle with its buffer inside; keys of the whole file may be replaced."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]], dtype="<f4")
    index = np.array([0, 1, 2, 3], dtype="<u2")
    data = points.tobytes() + index.tobytes()
    whole = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 8},
        ],
        "buffers": [
            {"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()},
        ],
    }
    return {**whole, **changes}


def write(folder, content):
    path = folder / "scene.gltf"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("extension", ["glb", "gltf"])
def test_every_mesh_is_where_its_nodes_place_it(tmp_path, extension):
    """Against the transforms of the scene that was written; files have single precision (1e-6)."""
    scene = placed_scene()
    if extension == "glb":
        (tmp_path / "scene.glb").write_bytes(scene.export(file_type="glb"))
    else:
        for name, data in scene.export(file_type="gltf").items():
            (tmp_path / ("scene.gltf" if name == "model.gltf" else name)).write_bytes(data)
    mesh = load_mesh(tmp_path / f"scene.{extension}")
    wanted = scene.to_mesh().vertices @ Z_UP.T
    distance = np.linalg.norm(mesh.vertices[:, None] - wanted[None], axis=2)
    assert len(mesh.pieces) == 3
    assert max(distance.min(axis=1).max(), distance.min(axis=0).max()) < 1e-6
    # Closed and outward, the mirrored leg, too: the volume is the sum of the boxes, twice as high.
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert whole.volume == pytest.approx(2.0 * (1.0 * 0.1 * 2.0 + 2 * 0.1 * 0.8 * 0.2), rel=1e-5)


def test_axis_and_unit_may_be_said_otherwise(tmp_path):
    path = tmp_path / "box.glb"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(str(path))
    assert np.allclose(np.ptp(load_mesh(path).vertices, axis=0), (1.0, 3.0, 2.0))
    assert np.allclose(np.ptp(load_mesh(path, up="z", unit="cm").vertices, axis=0), (0.01, 0.02, 0.03))


@pytest.mark.parametrize(("mode", "turned"), [(5, [[0, 1, 2], [2, 1, 3]]), (6, [[0, 1, 2], [0, 2, 3]])])
def test_strips_and_fans_are_triangles(tmp_path, mode, turned):
    """As the specification numbers them: a strip's second triangle is (2, 1, 3), a fan's (0, 2, 3)."""
    content = minimal(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}])
    content["accessors"][1]["count"] = 4
    mesh = load_mesh(write(tmp_path, content), up="z")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])

    def loops(triangles):  # each begins with its least corner; the way round stays
        return {
            min(tuple(t[k:]) + tuple(t[:k]) for k in range(3))
            for t in np.asarray(triangles).astype(float).tolist()
        }

    number = {tuple(point): k for k, point in enumerate(corners.tolist())}
    read = [[number[tuple(mesh.vertices[k].tolist())] for k in face] for face in mesh.faces]
    assert loops(read) == loops(turned)


def test_quantized_places_are_scaled(tmp_path):
    data = np.array([[-32767, 0, 0], [32767, 0, 0], [0, 32767, 0]], dtype="<i2").tobytes()
    content = minimal(
        extensionsRequired=["KHR_mesh_quantization"],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}],
        nodes=[{"mesh": 0, "scale": [2, 2, 2]}],
        accessors=[{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3", "normalized": True}],
        bufferViews=[{"buffer": 0, "byteLength": 18}],
        buffers=[{"byteLength": 18, "uri": "data:;base64," + base64.b64encode(data).decode()}],
    )
    mesh = load_mesh(write(tmp_path, content), up="z")
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), (4.0, 2.0, 0.0), atol=1e-12)


def test_bodies_with_a_skin_are_left_out(tmp_path):
    content = minimal(nodes=[{"mesh": 0, "skin": 0}])
    with pytest.raises(SceneError, match="holds no triangles"):
        load_mesh(write(tmp_path, content))


LOOP = [{"mesh": 0, "children": [1]}, {"children": [0]}]
VAST = [{"bufferView": 0, "componentType": 5126, "count": 10**9, "type": "VEC3"}]
DRACO = "KHR_draco_mesh_compression"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"asset": {"version": "1.0"}}, "of glTF 1.0; valid: 2.0"),
        ({"asset": {}}, "without version"),
        ({"extensionsRequired": [DRACO]}, f"needs the extension '{DRACO}'"),
        ({"extensionsUsed": ["EXT_mesh_gpu_instancing"]}, "a node for each mesh"),
        ({"nodes": LOOP}, "node 0 twice in its scene; valid: a tree"),
        ({"nodes": [{"children": [1, 1]}, {"mesh": 0}]}, "node 1 twice"),
        ({"nodes": [{"mesh": 7}]}, "cannot be read"),
        ({"nodes": [{"mesh": -1}]}, "mesh is -1, no count"),
        ({"nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}, "cannot be read"),
        ({"nodes": [{"mesh": 0, "scale": [1e6, 1, 1]}]}, "mistaken unit"),
        ({"nodes": [{"mesh": 0, "translation": [float("nan"), 0, 0]}]}, "finite"),
        ({"nodes": []}, "cannot be read"),
        ({"accessors": VAST}, "cannot be read"),
        ({"accessors": [VAST[0], minimal()["accessors"][1]]}, "at most 2000000"),
        ({"accessors": [{**VAST[0], "count": 4, "byteOffset": 4}, minimal()["accessors"][1]]}, "beyond"),
        ({"accessors": [{**VAST[0], "count": 4, "sparse": {}}, minimal()["accessors"][1]]}, "dense ones"),
        ({"buffers": [{"uri": "/dev/zero"}]}, "valid: a file in its folder"),
        ({"buffers": [{"uri": "../secret.bin"}]}, "valid: a file in its folder"),
        ({"buffers": [{"uri": "gone.bin"}]}, "'gone.bin'"),
        ({"buffers": [{"uri": "data:;base64,&&&"}]}, "cannot be read"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}]}, "holds no triangles"),
        ({"meshes": "many"}, "cannot be read"),
    ],
)
def test_broken_and_hostile_files_are_refused_in_one_line(tmp_path, changes, said):
    (tmp_path.parent / "secret.bin").write_bytes(bytes(100))
    path = write(tmp_path, minimal(**changes))
    with pytest.raises(SceneError) as caught:
        load_mesh(path)
    message = str(caught.value)
    assert said in message
    assert "scene.gltf" in message
    assert "valid: " in message
    assert "\n" not in message


def test_one_mesh_placed_very_often_is_counted_before_it_is_built(tmp_path):
    """A file of some kilobytes must not become a hundred million triangles."""
    nodes = [{"children": list(range(1, 4001))}, *({"mesh": 0} for _ in range(4000))]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    content = minimal(nodes=nodes, meshes=[{"primitives": [primitive] * 1000}])
    with pytest.raises(SceneError, match=r"5333333 triangles .*at most 2000000"):
        load_mesh(write(tmp_path, content))


@given(st.integers(0, 10**6), st.binary(max_size=3))
def test_a_damaged_file_is_read_or_refused(tmp_path_factory, place, junk):
    folder = tmp_path_factory.getbasetemp()
    whole = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type="glb")
    at = place % len(whole)
    (folder / "damaged.glb").write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
    message = ""
    try:
        load_mesh(folder / "damaged.glb")
    except SceneError as error:
        message = str(error)
    assert "\n" not in message


@pytest.fixture
def finished_glb(tmp_path):
    obstacles = (
        Obstacle("box", Box([0.2, 0.3, 0.4]), translation=[1.0, 0.2, 0.2]),
        Obstacle("wall", Box([0.1, 2.0, 1.0]), translation=[-1.0, 0.5, 0.5]),
    )
    body = quadruped()
    file = tmp_path / "motion.glb"
    file.write_bytes(to_glb(body, make_motion(body, body.standing_posture()[None]), Scene(obstacles)))
    return file, obstacles


def test_obstacles_of_our_own_export_come_back(finished_glb):
    """Forward is z in our GLB and -y after its import: a quarter turn brings it home. No body is read."""
    file, obstacles = finished_glb
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    bounds = np.array(Obstacle("again", load_mesh(file), quarter).bounds)
    wanted = np.array([obstacle.bounds for obstacle in obstacles])
    np.testing.assert_allclose(bounds[0], wanted[:, 0].min(axis=0), atol=1e-6)
    np.testing.assert_allclose(bounds[1], wanted[:, 1].max(axis=0), atol=1e-6)
