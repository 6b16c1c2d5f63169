"""MJCF and URDF files, loaded by MuJoCo and compared with Pinocchio's model of the body."""

from itertools import product

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from tests.reports.export.test_bvh import make_motion

from manikin.body import human, quadruped, random_configuration
from manikin.body.creature import LimbSpec, creature_from_urdf
from manikin.reports.export import ExportOptions, export_motion
from manikin.reports.formats.robots import scene_urdf, to_mjcf, to_urdf
from manikin.scene import Box, Capsule, Cylinder, Mesh, Obstacle, Scene, Sphere

BODIES = {"human": human, "quadruped": quadruped}
POSTURES = 4


@pytest.fixture(scope="module", params=BODIES)
def body(request):
    return BODIES[request.param]()


@pytest.fixture(scope="module")
def q(body):
    rng = np.random.default_rng(7)
    return np.array([random_configuration(body, rng) for _ in range(POSTURES)])


@pytest.fixture(scope="module", params=["mjcf", "urdf"])
def loaded(request, body, q):
    text = to_urdf(body) if request.param == "urdf" else to_mjcf(body, make_motion(body, q))
    return mujoco.MjModel.from_xml_string(text)


def test_masses_and_inertias_are_those_of_the_segments(loaded, body):
    # Twelve digits are written; 1e-6 relative is what other programs' rounding would leave.
    np.testing.assert_allclose(loaded.body_mass.sum(), body.mass, rtol=1e-9)
    for segment in body.segments:
        item = loaded.body(segment.name)
        turn = Rotation.from_quat(item.iquat, scalar_first=True).as_matrix()
        np.testing.assert_allclose(item.mass[0], segment.mass, rtol=1e-9)
        np.testing.assert_allclose(item.ipos, segment.com, atol=1e-9)
        inertia = turn @ np.diag(item.inertia) @ turn.T
        np.testing.assert_allclose(inertia, segment.inertia, atol=1e-6 * np.abs(segment.inertia).max())


def test_joints_and_centre_of_mass_are_at_the_same_places(loaded, body, q):
    data, own = mujoco.MjData(loaded), body.pinocchio.createData()
    for posture in q:
        data.qpos[:7] = posture[[0, 1, 2, 6, 3, 4, 5]]
        for name, angle in zip(body.joint_names, posture[7:], strict=True):
            data.qpos[loaded.joint(name).qposadr[0]] = angle
        mujoco.mj_forward(loaded, data)
        pin.framesForwardKinematics(body.pinocchio, own, posture)
        com = pin.centerOfMass(body.pinocchio, own, posture)
        np.testing.assert_allclose(data.subtree_com[1], com, atol=1e-9)
        for segment in body.segments:
            placed, here = own.oMf[body.segment_frame(segment.name)], data.body(segment.name)
            np.testing.assert_allclose(here.xpos, placed.translation, atol=1e-9)
            np.testing.assert_allclose(here.xmat.reshape(3, 3), placed.rotation, atol=1e-9)


def test_limits_and_torques_are_kept(loaded, body):
    for hinge in body.hinges:
        np.testing.assert_allclose(loaded.joint(hinge.name).range, [hinge.lower, hinge.upper], rtol=1e-9)


def turned(order, *angles):
    return Rotation.from_euler(order, angles).as_matrix()


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
SIDES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
OBSTACLES = (
    Obstacle("box", Box([0.2, 0.3, 0.4]), translation=[1.0, 0.2, 0.2]),
    Obstacle("tilted", Box([0.5, 0.3, 0.1]), turned("zyx", 0.3, 0.5, 0.2), [2.0, 0, 1]),
    Obstacle("ball", Sphere(0.3), translation=[0.0, 2.0, 0.3]),
    Obstacle("post", Cylinder(0.1, 2.0), translation=[0.0, -2.0, 1.0]),
    Obstacle("rail", Capsule(0.05, 1.0), turned("x", 0.5 * np.pi), [1.0, 1.0, 0.9]),
    Obstacle("wedge", Mesh(CORNERS, SIDES, convex="hull"), turned("z", 0.4), [-1.0, 0.5, 0.0]),
)


def points_of(model, data, geom):
    """(n, 3) vertices of a geometry in the world, of a round one corners around it in its axes."""
    if (mesh := model.geom_dataid[geom]) >= 0:
        first = model.mesh_vertadr[mesh]
        points = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    else:
        centre, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
        points = centre + half * np.array(list(product((-1, 1), repeat=3)))
    return points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


@pytest.mark.parametrize("form", ["mjcf", "urdf"])
def test_scene_stands_where_it_stood(form, tmp_path):
    """The box around each obstacle is the same, but for the corners of what is round."""
    scene, body = Scene(OBSTACLES), human()
    if form == "urdf":
        text, meshes = scene_urdf(scene, "parts")
        (tmp_path / "parts").mkdir()
        for name, content in meshes.items():
            (tmp_path / "parts" / name).write_bytes(content)
        assert set(meshes) == {"rail.stl", "wedge.stl"}
    else:
        text = to_mjcf(body, make_motion(body, body.standing_posture()[None]), scene)
    (tmp_path / "scene.xml").write_text(text)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for obstacle in OBSTACLES:
        names = [model.geom(k).name.split("/")[:2] for k in range(model.ngeom)]
        geoms = [k for k, name in enumerate(names) if name == ["scene", obstacle.name]]
        if form == "urdf":
            geoms = [int(model.body(obstacle.name).geomadr[0])]
        points = np.vstack([points_of(model, data, k) for k in geoms])
        # An STL file has 7 digits, and the mesh of the rail 32 corners around.
        within = 5e-4 if form == "urdf" and obstacle.name == "rail" else 1e-6
        np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], obstacle.bounds, atol=within)


def test_own_reader_and_pinocchio_take_the_urdf(tmp_path):
    body = human()
    file = tmp_path / "body.urdf"
    file.write_text(to_urdf(body))
    model = pin.buildModelFromUrdf(str(file))
    assert pin.computeTotalMass(model) == pytest.approx(body.mass, rel=1e-9)
    again = creature_from_urdf(file, {"left leg": LimbSpec("left_foot"), "right leg": LimbSpec("right_foot")})
    assert again.joint_names == body.joint_names
    assert again.mass == pytest.approx(body.mass, rel=1e-9)
    np.testing.assert_allclose(again.lower, body.lower, rtol=1e-9)


def test_files_of_a_run(finished_run, tmp_path):
    path = export_motion(finished_run, tmp_path, "mjcf")
    assert path == tmp_path / "motion.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    assert [model.key(k).name for k in range(model.nkey)] == ["start", "end"]
    np.testing.assert_allclose(model.key("end").qpos[:3], finished_run.executed.q[-1, :3], atol=1e-9)
    assert {f"scene/{name}" for name in finished_run.scene.names} <= {
        model.geom(k).name for k in range(model.ngeom)
    }
    export_motion(finished_run, tmp_path, "urdf")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "motion_scene.urdf")).ngeom == len(finished_run.scene)
    export_motion(
        finished_run, tmp_path, "urdf", out=tmp_path / "alone.urdf", options=ExportOptions(beside=False)
    )
    assert not (tmp_path / "alone_scene.urdf").exists()
