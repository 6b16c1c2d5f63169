import numpy as np
import pytest
import trimesh

from manikin.errors import SceneError
from manikin.scene import Mesh, Obstacle, load_mesh, mesh_place
from manikin.scene.mesh import UNITS

BOX = trimesh.creation.box((1.0, 2.0, 3.0))


@pytest.mark.parametrize("extension", ["stl", "obj", "ply", "dae"])
@pytest.mark.parametrize("unit", sorted(UNITS))
def test_every_format_reads_in_every_unit(tmp_path, extension, unit):
    """Vertices written in a unit come back in metres; STL stores single precision (1e-6 relative)."""
    path = tmp_path / f"box.{extension}"
    written = BOX.copy()
    written.apply_scale(1.0 / UNITS[unit])
    written.export(str(path))
    mesh = load_mesh(path, unit=unit, up="z")
    assert np.allclose(np.ptp(mesh.vertices, axis=0), (1.0, 2.0, 3.0), rtol=1e-6)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.faces.shape == (12, 3)
    assert mesh.source == str(path)


def test_scale_multiplies_the_unit(tmp_path):
    path = tmp_path / "box.stl"
    BOX.export(str(path))
    mesh = load_mesh(path, unit="cm", scale=50.0)
    assert np.allclose(np.ptp(mesh.vertices, axis=0), (0.5, 1.0, 1.5))


def test_collada_gives_its_own_unit_and_up_axis_and_both_can_be_seen(tmp_path):
    path = tmp_path / "box.dae"
    BOX.export(str(path))
    text = path.read_text()
    start, end = text.index("<asset>"), text.index("</asset>")
    asset = '<asset><unit meter="0.01" name="centimeter"/><up_axis>{}_UP</up_axis>'
    path.write_text(text[:start] + asset.format("Z") + text[end:])
    assert np.allclose(np.ptp(load_mesh(path).vertices, axis=0), (0.01, 0.02, 0.03))
    assert np.allclose(np.ptp(load_mesh(path, unit="m").vertices, axis=0), (1.0, 2.0, 3.0))
    path.write_text(text[:start] + asset.format("Y") + text[end:])
    assert np.allclose(np.ptp(load_mesh(path).vertices, axis=0), (0.01, 0.03, 0.02))
    path.write_text(text[:start] + asset.format("X") + text[end:])
    assert np.allclose(np.ptp(load_mesh(path).vertices, axis=0), (0.02, 0.03, 0.01))


def test_a_mirrored_mesh_is_never_made(tmp_path):
    """Turning a file's up axis keeps the enclosed volume positive."""
    path = tmp_path / "box.dae"
    BOX.export(str(path))
    text = path.read_text()
    start, end = text.index("<asset>"), text.index("</asset>")
    for axis in "XYZ":
        asset = f'<asset><unit meter="1.0"/><up_axis>{axis}_UP</up_axis>'
        path.write_text(text[:start] + asset + text[end:])
        mesh = load_mesh(path)
        volume = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume
        assert np.isclose(volume, 6.0)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("gone.stl", None, "does not exist"),
        ("car.step", "x", "extension '.step'"),
        ("car", "x", "extension ''"),
        ("bad.stl", "not a mesh", "holds no triangles"),
        ("bad.obj", "", "bad.obj"),
        ("bad.dae", "<xml", "cannot be read"),
        ("points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n0 0 0\n", "points.ply"),
    ],
)  # fmt: skip
def test_unusable_files_are_named_in_one_line(tmp_path, name, content, said):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(SceneError) as caught:
        load_mesh(path)
    message = str(caught.value)
    assert said in message
    assert name in message
    assert "valid: " in message
    assert "\n" not in message


def test_bad_options_are_refused(tmp_path):
    path = tmp_path / "box.stl"
    BOX.export(str(path))
    with pytest.raises(SceneError, match="unit is 'inch'; valid: m, cm, mm, in"):
        load_mesh(path, unit="inch")
    with pytest.raises(SceneError, match="up is 'w'; valid: x, y, z"):
        load_mesh(path, up="w")
    with pytest.raises(SceneError, match="scale"):
        load_mesh(path, scale=0.0)
    with pytest.raises(SceneError, match="convex is 'yes'; valid: no, hull, parts"):
        load_mesh(path, convex="yes")


def test_a_size_that_suggests_a_mistaken_unit_is_refused(tmp_path):
    path = tmp_path / "box.stl"
    big = BOX.copy()
    big.apply_scale(1000.0)
    big.export(str(path))
    with pytest.raises(SceneError, match=r"3000 m if its unit is the metre, and 3 m .* or say its unit"):
        load_mesh(path)
    with pytest.raises(SceneError, match=r"3000 m, which suggests a mistaken unit.*set unit"):
        load_mesh(path, unit="m")
    assert np.allclose(np.ptp(load_mesh(path, unit="mm").vertices, axis=0), (1.0, 2.0, 3.0))
    with pytest.raises(SceneError, match="mistaken unit"):
        load_mesh(path, unit="mm", scale=1e-5)


def test_a_step_in_millimetres_is_no_plateau_and_a_hall_says_its_metres(tmp_path):
    """0.151 m in millimetres reads as 151 m, far below the size of the largest mesh; so is asked for."""
    step = trimesh.creation.box((151.0, 400.0, 90.0))
    step.export(str(tmp_path / "step.stl"))
    with pytest.raises(
        SceneError, match=r"400 m if its unit is the metre, and 0\.4 m if it is the millimetre"
    ):
        load_mesh(tmp_path / "step.stl")
    assert np.allclose(
        np.ptp(load_mesh(tmp_path / "step.stl", unit="mm").vertices, axis=0), (0.151, 0.4, 0.09)
    )
    assert np.allclose(np.ptp(load_mesh(tmp_path / "step.stl", unit="m").vertices, axis=0), (151, 400, 90))


def test_a_file_that_is_cut_off_or_not_finite_says_so(tmp_path):
    BOX.export(str(tmp_path / "box.stl"))
    whole = (tmp_path / "box.stl").read_bytes()
    text = trimesh.exchange.stl.export_stl_ascii(BOX).encode()
    nan = whole[:96] + np.float32(np.nan).tobytes() + whole[100:]
    for content, said in (
        (whole[: 84 + 5 * 50 + 17], "cut off: 5 of 12 triangles are there"),
        (text[: len(text) // 2], "cut off, it has no endsolid"),
        (nan, "vertices is"),
    ):
        (tmp_path / "box.stl").write_bytes(content)
        with pytest.raises(SceneError, match=said):
            load_mesh(tmp_path / "box.stl")
    (tmp_path / "box.stl").write_bytes(text)
    assert len(load_mesh(tmp_path / "box.stl").faces) == 12


@pytest.mark.long
def test_a_fine_mesh_is_decimated_where_its_surface_stays(tmp_path):
    """A ball of 81,920 triangles keeps its surface; 80,000 random triangles in a cube cannot."""
    ball = trimesh.creation.icosphere(subdivisions=6)
    ball.export(str(tmp_path / "ball.stl"))
    fewer = load_mesh(tmp_path / "ball.stl")
    assert 40_000 < len(fewer.faces) <= 50_000
    distance = np.linalg.norm(fewer.vertices, axis=1)
    np.testing.assert_allclose(distance, 1.0, atol=2e-3)
    corners = np.random.default_rng(0).uniform(-1.0, 1.0, (80_000, 3, 3))
    cloud = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(240_000).reshape(-1, 3), process=False)
    cloud.export(str(tmp_path / "cloud.stl"))
    with pytest.raises(SceneError, match=r"80000 triangles, and with \d+ its surface is .* mm off"):
        load_mesh(tmp_path / "cloud.stl")


def test_too_many_triangles_are_counted_before_they_are_loaded(tmp_path):
    """The header alone, of three million triangles that are all zero, in a file without content."""
    with (tmp_path / "huge.stl").open("wb") as file:
        file.write(bytes(80) + (3_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 3_000_000)
    with pytest.raises(SceneError, match="3000000 triangles; valid: at most 2000000"):
        load_mesh(tmp_path / "huge.stl")
    with (tmp_path / "huge.stl").open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(SceneError, match="has 1000000000000 bytes; valid: at most"):
        load_mesh(tmp_path / "huge.stl")


def test_bad_arrays_are_refused():
    with pytest.raises(SceneError, match="finite"):
        Mesh([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(SceneError, match="empty"):
        Mesh(np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(SceneError, match="name vertex 3; valid: 0 to 2"):
        Mesh(np.eye(3), [[0, 1, 3]])
    with pytest.raises(SceneError, match="no triangle with an area"):
        Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])


def test_degenerate_and_doubled_triangles_are_dropped_and_counted():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [0, 0, 0]]
    mesh = Mesh(vertices, [[0, 1, 2], [0, 1, 3], [4, 1, 2], [0, 0, 1]])
    assert mesh.dropped_faces == 3
    assert mesh.faces.shape == (1, 3)
    assert mesh.vertices.shape == (3, 3)


def test_too_many_triangles_are_refused_with_the_remedy_and_a_hull_is_one():
    ball = trimesh.creation.icosphere(subdivisions=4)
    noisy = ball.vertices * np.linspace(0.8, 1.0, len(ball.vertices))[:, None]
    with pytest.raises(SceneError, match=r"5120 triangles; valid: at most 3000.*decimate.*hull"):
        Mesh(noisy, ball.faces, max_faces=3000)
    hull = Mesh(noisy, ball.faces, convex="hull", max_faces=3000)
    assert len(hull.faces) < 3000
    (piece,) = hull.pieces
    assert piece.convex


def test_pieces_are_found_closed_and_convex():
    left, right = trimesh.creation.box((1, 1, 1)), trimesh.creation.torus(1.0, 0.2)
    right.apply_translation((5.0, 0.0, 0.0))
    sheet = trimesh.Trimesh([[9, 0, 0], [10, 0, 0], [9, 1, 0]], [[0, 1, 2]])
    both = trimesh.util.concatenate([left, right, sheet])
    pieces = Mesh(both.vertices, both.faces).pieces
    assert [(piece.closed, piece.convex) for piece in pieces] == [(True, True), (True, False), (False, False)]
    hulls = Mesh(*_closed(left, right), convex="parts").pieces
    assert [piece.convex for piece in hulls] == [True, True]
    with pytest.raises(SceneError, match="flat piece"):
        Mesh(both.vertices, both.faces, convex="parts")


def _closed(*meshes):
    whole = trimesh.util.concatenate(meshes)
    return whole.vertices, whole.faces


@pytest.mark.parametrize(
    ("file", "extent"),
    [
        # Sizes stated by the files' providers, or furniture sizes, in metres.
        ("hpp_environments/truck.stl", (6.15, 6.15, 2.38)),
        ("hpp_environments/climb.stl", (2.0, 2.0, 2.53)),
        ("hpp_environments/stairs.stl", (4.08, 2.01, 0.68)),
        ("aws_robomaker/aws_KitchenTable_01_collision.DAE", (0.72, 1.82, 0.82)),
        ("aws_robomaker/aws_ChairA_01_collision.DAE", (0.46, 0.48, 0.92)),
        ("aws_robomaker/aws_Sofa_01_collision.DAE", (2.43, 2.46, 0.97)),
    ],
)
def test_real_meshes_come_in_metres(scene_files, file, extent):
    low, high = Obstacle("real", load_mesh(scene_files / file)).bounds
    assert np.allclose(high - low, extent, atol=0.01)


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """An installed distribution that holds a mesh in its share, as those of robots' packages do."""
    folder = tmp_path / "site"
    inside = "prefix/share/some_scenes/meshes/box.stl"
    (folder / inside).parent.mkdir(parents=True)
    BOX.export(str(folder / inside))
    info = folder / "some_scenes-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: some-scenes\nVersion: 1.0\n")
    (info / "RECORD").write_text(f"{inside},,\nsome_scenes-1.0.dist-info/METADATA,,\n")
    monkeypatch.syspath_prepend(str(folder))
    return "package://some_scenes/meshes/box.stl"


def test_a_mesh_of_an_installed_distribution_is_found(distribution, tmp_path):
    """From any folder, and as the same place again."""
    assert mesh_place(distribution, tmp_path) == distribution
    assert np.allclose(np.ptp(load_mesh(distribution).vertices, axis=0), (1.0, 2.0, 3.0), rtol=1e-6)
    with pytest.raises(SceneError, match="is not in the package 'some_scenes'"):
        load_mesh(distribution.replace("box", "ball"))


def test_a_mesh_of_no_installed_distribution_names_what_to_install():
    with pytest.raises(SceneError, match="not installed; valid: after pip install no-such-scenes"):
        load_mesh("package://no_such_scenes/box.stl")
