"""USD files, read back by the library's own skinning."""

from importlib import import_module

import numpy as np
import pytest
from tests.reports.export.test_bvh import make_motion

from manikin.body import human, quadruped, random_configuration
from manikin.body.skin import segment_frames
from manikin.errors import InputError, MotionFileError
from manikin.reports.export import export_motion
from manikin.reports.formats import usd
from manikin.reports.formats.usd import to_usd
from manikin.reports.gltf import surface_of
from manikin.scene import Box, Obstacle, Scene

RATE = 30.0
SAMPLES = 3
SCENE = Scene((
    Obstacle("low table", Box([0.4, 0.6, 0.3]), translation=[1.0, 0.0, 0.15]),
))  # fmt: skip


@pytest.fixture(scope="module")
def libraries():
    pytest.importorskip("pxr", reason="usd needs usd-core (extra 'usd')")
    return {name: import_module(f"pxr.{name}") for name in ("Usd", "UsdGeom", "UsdSkel", "UsdShade")}


@pytest.fixture(scope="module", params=[human, quadruped])
def body(request):
    return request.param()


@pytest.fixture(scope="module")
def q(body):
    rng = np.random.default_rng(11)
    return np.array([random_configuration(body, rng) for _ in range(SAMPLES)])


@pytest.fixture(scope="module")
def stage(libraries, body, q, tmp_path_factory):
    file = tmp_path_factory.mktemp("usd") / "motion.usdc"
    file.write_bytes(to_usd(body, make_motion(body, q, np.arange(SAMPLES) / RATE), RATE, SCENE))
    return libraries["Usd"].Stage.Open(str(file))


def test_axes_unit_and_time_are_said(libraries, stage):
    geom = libraries["UsdGeom"]
    assert geom.GetStageUpAxis(stage) == "Z"
    assert geom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (30.0, 0, 2)
    assert stage.GetDefaultPrim().GetPath() == "/World"


def skinned(libraries, stage, sample):
    """(n, 3) surface and (s, 4, 4) joints of a sample in the world, by USD's own skinning."""
    skel = libraries["UsdSkel"]
    cache, root = skel.Cache(), skel.Root.Get(stage, "/World/body")
    cache.Populate(root, libraries["Usd"].PrimDefaultPredicate)
    skeleton = skel.Skeleton.Get(stage, "/World/body/skeleton")
    query = cache.GetSkelQuery(skeleton)
    mesh = stage.GetPrimAtPath("/World/body/surface")
    points = libraries["UsdGeom"].Mesh(mesh).GetPointsAttr().Get()
    turned = query.ComputeSkinningTransforms(sample)
    assert cache.GetSkinningQuery(mesh).ComputeSkinnedPoints(turned, points, sample)
    joints = [np.array(item).T for item in query.ComputeJointSkelTransforms(sample)]
    return np.array(points), np.array(joints)


@pytest.mark.parametrize("sample", range(SAMPLES))
def test_surface_and_joints_move_as_ours(libraries, stage, body, q, sample):
    """Within 0.01 mm; the file has single precision."""
    points, joints = skinned(libraries, stage, sample)
    rotations, origins = segment_frames(body, q[sample])
    np.testing.assert_allclose(joints[:, :3, 3], origins, atol=1e-5)
    np.testing.assert_allclose(joints[:, :3, :3], rotations, atol=1e-5)
    wanted, _ = surface_of(body).posed(rotations, origins)
    np.testing.assert_allclose(points, wanted, atol=1e-5)


def test_obstacles_that_end_are_there_and_all_has_a_material(libraries, stage):
    geom, shade = libraries["UsdGeom"], libraries["UsdShade"]
    scene = stage.GetPrimAtPath("/World/scene")
    (table,) = scene.GetChildren()
    points = np.array(geom.Mesh(table).GetPointsAttr().Get())
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[0.8, -0.3, 0], [1.2, 0.3, 0.3]])
    surface = stage.GetPrimAtPath("/World/body/surface")
    parts = [child for child in surface.GetChildren() if child.IsA(geom.Subset)]
    faces = sum(len(geom.Subset(part).GetIndicesAttr().Get()) for part in parts)
    assert faces == len(geom.Mesh(surface).GetFaceVertexCountsAttr().Get())
    for prim in (table, *parts):
        assert shade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]


def test_the_validators_of_usd_find_nothing(stage):
    validation = pytest.importorskip("pxr.UsdValidation", reason="usd-core before 26 has no validators")
    every = validation.ValidationRegistry().GetOrLoadAllValidators()
    found = validation.ValidationContext(every).Validate(stage)
    assert [error.GetMessage() for error in found] == []


def test_file_of_a_run(libraries, finished_run, tmp_path):
    path = export_motion(finished_run, tmp_path, "usd", rate=4.0)
    assert path == tmp_path / "motion.usd"
    stage = libraries["Usd"].Stage.Open(str(path))
    assert stage.GetEndTimeCode() == int(finished_run.executed.duration * 4.0)
    ends = [name for name in finished_run.scene.names if name != "floor"]
    assert len(stage.GetPrimAtPath("/World/scene").GetChildren()) == len(ends)


def test_a_motion_of_another_body_is_refused(libraries):  # noqa: ARG001  (the library is asked for first)
    other = make_motion(human(), human().standing_posture()[None])
    with pytest.raises(MotionFileError, match="other joints"):
        to_usd(quadruped(), other, RATE)


def test_a_missing_library_is_said(monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name=name.partition(".")[0])

    monkeypatch.setattr(usd, "import_module", missing)
    body = quadruped()
    with pytest.raises(InputError, match=r"pip install 'manikin\[usd\]'"):
        to_usd(body, make_motion(body, body.standing_posture()[None]), RATE)
