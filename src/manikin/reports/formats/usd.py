"""A motion as Universal Scene Description (USD): the skinned body, its animation and the scene.

Metres and z up, as here. ``/World/body`` is a ``SkelRoot`` with the skeleton of the segments, the animation
with a sample for each instant, and the surface; ``/World/scene`` holds the obstacles. Time codes are samples.
"""

from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.flesh import MATERIALS
from manikin.body.skin import Skin
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.reports.gltf import LINEAR_COLOURS, joint_tracks, moved_surface
from manikin.reports.solids import finite_obstacles
from manikin.scene import Scene

ROOT, BODY, SCENE, LOOKS = "/World", "/World/body", "/World/scene", "/World/materials"


def to_usd(body: BodyModel, motion: Motion, rate: float, scene: Scene | None = None) -> bytes:
    """Content of a binary USD file of a motion, one time code per sample, and its scene.

    Args:
        body: Whose motion it is.
        motion: Sampled at the rate.
        rate: Samples per second [Hz].
        scene: What stands around, or None; what is endless is left out.

    Raises:
        InputError: If usd-core is not installed.
        MotionFileError: If the motion is not the body's, or the body has nothing to draw.
    """
    stage, skin = _Stage(), moved_surface(body, motion)
    stage.time(len(motion.time), rate)
    stage.body(skin, body, motion)
    for obstacle in finite_obstacles(scene or Scene(())):
        mesh = obstacle.to_trimesh()
        path = stage.free_path(SCENE, obstacle.name)
        item = stage.mesh(path, np.asarray(mesh.vertices), np.asarray(mesh.faces))
        stage.bind(item.GetPrim(), "scene")
    return stage.content()


def _library(name: str) -> Any:
    try:
        return import_module(f"pxr.{name}")
    except ModuleNotFoundError as error:
        if error.name != "pxr":
            raise
        raise InputError("usd needs usd-core; install it with: pip install 'manikin[usd]'") from None


class _Stage:
    """A stage in memory."""

    def __init__(self) -> None:
        names = ("Usd", "UsdGeom", "UsdShade", "UsdSkel", "Sdf", "Gf", "Vt", "Tf")
        self.usd, self.geom, self.shade, self.skel, self.sdf, self.gf, self.vt, self.tf = map(_library, names)
        self.stage = self.usd.Stage.CreateInMemory()
        self.geom.SetStageUpAxis(self.stage, self.geom.Tokens.z)
        self.geom.SetStageMetersPerUnit(self.stage, 1.0)
        self.stage.SetDefaultPrim(self.geom.Xform.Define(self.stage, ROOT).GetPrim())

    def time(self, count: int, rate: float) -> None:
        """Let time codes be samples."""
        self.stage.SetTimeCodesPerSecond(rate)
        self.stage.SetFramesPerSecond(rate)
        self.stage.SetStartTimeCode(0)
        self.stage.SetEndTimeCode(count - 1)

    def body(self, skin: Skin, body: BodyModel, motion: Motion) -> None:
        """Skeleton, animation and surface."""
        root = self.skel.Root.Define(self.stage, BODY)
        joints = self.vt.TokenArray(list(_joint_paths(body, self.tf.MakeValidIdentifier)))
        skeleton = self.skel.Skeleton.Define(self.stage, f"{BODY}/skeleton")
        bind = _matrices(skin.rotations, skin.origins)
        skeleton.CreateJointsAttr(joints)
        skeleton.CreateBindTransformsAttr(self._transforms(bind))
        tracks = list(joint_tracks(body, motion))
        skeleton.CreateRestTransformsAttr(self._transforms(_local(bind, skin.segments, body)))
        animation = self.skel.Animation.Define(self.stage, f"{BODY}/motion")
        animation.CreateJointsAttr(joints)
        animation.CreateScalesAttr(self.vt.Vec3hArray(len(joints), self.gf.Vec3h(1.0)))
        turns, places = animation.CreateRotationsAttr(), animation.CreateTranslationsAttr()
        for sample in range(len(motion.time)):
            keys = [track[0][sample] for track in tracks]
            turns.Set(
                self.vt.QuatfArray([self.gf.Quatf(*key[[3, 0, 1, 2]].tolist()) for key in keys]), sample
            )
            places.Set(self._points(np.array([track[1][sample] for track in tracks])), sample)
        binding = self.skel.BindingAPI.Apply(skeleton.GetPrim())
        binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
        self._surface(skin, skeleton)
        low, high = motion.q[:, :3].min(axis=0) - 2.0, motion.q[:, :3].max(axis=0) + 2.0
        self.geom.Boundable(root).CreateExtentAttr(self._points(np.array([low, high])))

    def _surface(self, skin: Skin, skeleton: Any) -> None:
        item = self.mesh(f"{BODY}/surface", skin.vertices, skin.faces)
        item.CreateNormalsAttr(self._points(skin.normals))
        item.SetNormalsInterpolation(self.geom.Tokens.vertex)
        binding = self.skel.BindingAPI.Apply(item.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        width = skin.bones.shape[1]
        bones = np.where(skin.weights > 0.0, skin.bones, 0).astype(np.int32)
        weights = (skin.weights / skin.weights.sum(axis=1, keepdims=True)).astype(np.float32)
        binding.CreateJointIndicesPrimvar(False, width).Set(self.vt.IntArray.FromNumpy(bones.ravel()))
        binding.CreateJointWeightsPrimvar(False, width).Set(self.vt.FloatArray.FromNumpy(weights.ravel()))
        binding.CreateGeomBindTransformAttr(self.gf.Matrix4d(1.0))
        family = self.shade.Tokens.materialBind
        self.geom.Subset.SetFamilyType(item, family, self.geom.Tokens.partition)
        for number in np.unique(skin.materials).tolist():
            name = "shapes" if number < 0 else str(MATERIALS[number])
            faces = self.vt.IntArray.FromNumpy(np.flatnonzero(skin.materials == number).astype(np.int32))
            part = self.geom.Subset.CreateGeomSubset(item, name, self.geom.Tokens.face, faces, family)
            self.bind(part.GetPrim(), name)

    def mesh(self, path: str, vertices: FloatArray, faces: np.ndarray) -> Any:
        """Triangles as a mesh with edges as they are."""
        item = self.geom.Mesh.Define(self.stage, path)
        item.CreatePointsAttr(self._points(vertices))
        item.CreateFaceVertexCountsAttr(self.vt.IntArray(len(faces), 3))
        item.CreateFaceVertexIndicesAttr(self.vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
        item.CreateSubdivisionSchemeAttr(self.geom.Tokens.none)
        item.CreateDoubleSidedAttr(True)
        item.CreateExtentAttr(self._points(np.array([vertices.min(axis=0), vertices.max(axis=0)])))
        return item

    def bind(self, prim: Any, name: str) -> None:
        """Give a mesh, or a part of one, the material of a name."""
        path = f"{LOOKS}/{self.tf.MakeValidIdentifier(name)}"
        if not self.stage.GetPrimAtPath(path):
            material = self.shade.Material.Define(self.stage, path)
            shader = self.shade.Shader.Define(self.stage, f"{path}/surface")
            shader.CreateIdAttr("UsdPreviewSurface")
            colour = shader.CreateInput("diffuseColor", self.sdf.ValueTypeNames.Color3f)
            colour.Set(self.gf.Vec3f(*LINEAR_COLOURS[name][:3]))
            shader.CreateInput("roughness", self.sdf.ValueTypeNames.Float).Set(0.9)
            material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        self.shade.MaterialBindingAPI.Apply(prim).Bind(self.shade.Material.Get(self.stage, path))

    def free_path(self, parent: str, name: str) -> str:
        """A path of a name that USD takes and nothing has yet."""
        if not self.stage.GetPrimAtPath(parent):
            self.geom.Xform.Define(self.stage, parent)
        path = first = f"{parent}/{self.tf.MakeValidIdentifier(name)}"
        number = 1
        while self.stage.GetPrimAtPath(path):
            path, number = f"{first}_{number}", number + 1
        return path

    def content(self) -> bytes:
        """The binary file."""
        with TemporaryDirectory(prefix="manikin-") as folder:
            path = Path(folder) / "motion.usdc"
            self.stage.GetRootLayer().Export(str(path))
            return path.read_bytes()

    def _points(self, values: FloatArray) -> Any:
        return self.vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))

    def _transforms(self, matrices: FloatArray) -> Any:
        """Matrices (n, 4, 4) that act on columns, as those of USD, which act on rows."""
        return self.vt.Matrix4dArray([self.gf.Matrix4d(item.T.tolist()) for item in matrices])


def _joint_paths(body: BodyModel, valid: Any) -> Iterator[str]:
    """Of each segment the names from the root to it, as USD names joints."""
    paths = dict[str | None, str]()
    for segment in body.segments:
        above = paths.get(segment.parent)
        paths[segment.name] = valid(segment.name) if above is None else f"{above}/{valid(segment.name)}"
        yield paths[segment.name]


def _matrices(rotations: FloatArray, places: FloatArray) -> FloatArray:
    """(n, 4, 4) transforms of rotations (n, 3, 3) and places (n, 3)."""
    result = np.tile(np.eye(4), (len(places), 1, 1))
    result[:, :3, :3], result[:, :3, 3] = rotations, places
    return result


def _local(to_root: FloatArray, names: Sequence[str], body: BodyModel) -> FloatArray:
    """(n, 4, 4) transforms to the parents of transforms to the root."""
    result = np.array(to_root)
    for number, segment in enumerate(body.segments):
        if segment.parent is not None:
            result[number] = np.linalg.inv(to_root[names.index(segment.parent)]) @ to_root[number]
    return result
