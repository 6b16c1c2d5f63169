"""A page in the browser: its server, and the obstacles and bodies that it shows."""

import threading
import time as clock
from abc import ABC, abstractmethod
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np
import pinocchio as pin
import viser
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.flesh import MATERIALS
from manikin.body.segments import segment_triangles
from manikin.body.skin import Skin, skin_of
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import MATERIAL_COLOURS
from manikin.scene import HalfSpace, Plane, Scene
from manikin.viewer.door import Door


class Page(ABC):
    """Serves one page until it is closed or left, by the viser server ``server``.

    Attributes:
        root: Node of the page that all nodes of this one are below.
    """

    def __init__(self, door: Door, frame_rate: float, before: "Page | None" = None) -> None:
        """Start the server, which makes at most ``frame_rate`` pictures per second, behind a door.

        A page that comes after one that was left has its server, and so its visitors. What that one drew is
        hidden: a browser with viser 1.1 fails where a skinned mesh is removed.
        """
        self._lock = threading.RLock()
        self._closed, self._left = threading.Event(), False
        self._frame_rate = frame_rate
        self.door = door
        if before is None:
            # viser greets on standard output, whatever its verbosity.
            with redirect_stdout(StringIO()), door.watched():
                self.server = viser.ViserServer(host=door.host, port=door.port, verbose=False)
            number = 1
        else:
            self.server, number = before.server, before._number + 1
            self.server.gui.reset()
            self.server.scene.remove_click_callback("all")
        self._number, self.root = number, f"/{number}"
        self._node = self.server.scene.add_frame(self.root, show_axes=False)
        self.server.scene.set_up_direction("+z")
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.door.url

    @abstractmethod
    def advance(self, seconds: float) -> None:
        """Show the state after ``seconds`` more of real time [s]."""

    def run(self) -> None:
        """Serve until :meth:`close` or :meth:`leave` is called or Ctrl-C is pressed."""
        before = clock.monotonic()
        try:
            while not self._closed.wait(max(0.0, before + 1.0 / self._frame_rate - clock.monotonic())):
                now = clock.monotonic()
                self.advance(now - before)
                before = now
        except KeyboardInterrupt:
            pass
        finally:
            if not self._left:
                self.close()

    def _add_scene(self, scene: Scene | None, *, endless_floor: bool = False) -> None:
        """Draw the finite obstacles and the floor."""
        nodes = self.server.scene
        for obstacle in scene or ():
            if isinstance(obstacle.shape, (HalfSpace, Plane)):
                continue
            mesh = obstacle.to_trimesh()
            nodes.add_mesh_simple(
                f"{self.root}/scene/{obstacle.name}", np.asarray(mesh.vertices), np.asarray(mesh.faces),
                color=COLOURS["obstacle"], opacity=0.85, flat_shading=True, side="double",
            )  # fmt: skip
        if scene is not None and scene.floor_height is not None:
            nodes.add_grid(
                f"{self.root}/floor", width=8.0, height=8.0, cell_size=0.5, plane="xy",
                position=(0, 0, scene.floor_height - 1e-3), infinite_grid=endless_floor,
            )  # fmt: skip

    def _add_body(self, body: BodyModel, opacity: float = 0.7, name: str = "body") -> "BodyShapes":
        """Draw a body as the node ``name`` of the page; see :class:`BodyShapes`."""
        return BodyShapes(self.server, body, opacity, f"{self.root}/{name}")

    def _add_arrow(self, name: str, colour: tuple[int, int, int]) -> viser.ArrowsHandle:
        """Make the arrow of a force or a normal, which is placed later, as the node ``name`` of the page."""
        points = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]])
        return self.server.scene.add_arrows(
            f"{self.root}/{name}", points, np.array(colour, dtype=np.uint8), shaft_radius=0.012,
            head_radius=0.03, head_length=0.06, visible=False,
        )  # fmt: skip

    def _draw_lines(self, path: str, lines: FloatArray, colour: tuple[int, int, int], width: float) -> None:
        """Draw lines (n, 2, 3) in a colour, so many pixels wide, as the node ``path`` of the page."""
        look: dict[str, Any] = {"thickness": width, "thickness_units": "screen"}
        self.server.scene.add_line_segments(f"{self.root}/{path}", lines, np.array(colour), **look)

    def leave(self) -> None:
        """End :meth:`run` without stopping the server, for another page to come."""
        self._left, self._node.visible = True, False
        self._closed.set()

    def close(self) -> None:
        """Stop the server; a second call does nothing."""
        if not self._closed.is_set():
            self._closed.set()
            with redirect_stdout(StringIO()):
                self.server.stop()


COLOURS = {
    "recorded": (106, 81, 163), "planned": (0, 114, 178), "executed": (213, 94, 0), "left": (0, 158, 115),
    "right": (204, 121, 167), "trunk": (150, 156, 166), "obstacle": (186, 192, 202), "force": (230, 159, 0),
}  # fmt: skip
VIEW = np.array([-1.7, -1.9, 0.5])
"""Position of a new visitor's camera relative to what it looks at [m]."""
WHOLE = 2.0
"""Size of what that camera sees as a whole, without a body [m]."""
ABOVE = 0.35
"""Height of a name above the origin of the head [m]."""


def look_at(server: viser.ViserServer, middle: FloatArray, size: float = 0.0) -> None:
    """Let new visitors look at a point (3,) [m] from behind its right, from a person's height or above.

    They are farther away the larger what is to be seen is, a body aside, by its ``size`` [m].
    """
    camera = server.initial_camera
    camera.look_at, camera.up = middle, (0.0, 0.0, 1.0)
    camera.position = middle + max(1.0, size / WHOLE) * VIEW


def look_from(server: viser.ViserServer, middle: FloatArray, offset: FloatArray) -> None:
    """Let every visitor look at a point (3,) from there and an offset (3,) [m]."""
    for camera in _cameras(server):
        camera.up_direction = (0.0, 0.0, 1.0)
        camera.position = middle + offset
        camera.look_at = middle


def carry_cameras(server: viser.ViserServer, offset: FloatArray) -> None:
    """Move every visitor's camera, with what it looks at, by an offset (3,) [m]."""
    for camera in _cameras(server):
        camera.position = camera.position + offset


def _cameras(server: viser.ViserServer) -> list[viser.CameraHandle]:
    """Cameras of the visitors; the server knows those whose browser has said where its camera is."""
    return [client.camera for client in server.get_clients().values()]


OPAQUE = 0.7
"""A surface is drawn opaque from this opacity of the shapes on."""


class BodyShapes:
    """A body on the page: a person by the surface, any body by its shapes.

    Attributes:
        frames: One frame for each segment with shapes.
        data: Pinocchio's data of the configuration shown.
        has_surface: Whether there is a surface beside the shapes.
    """

    def __init__(self, server: viser.ViserServer, body: BodyModel, opacity: float, root: str) -> None:
        """Draw the body as the node ``root``, with an opacity in [0, 1]; of a person the surface."""
        self._body, self.data = body, body.pinocchio.createData()
        self.frames: dict[str, viser.FrameHandle] = {}
        self._meshes: list[viser.MeshHandle] = []
        for segment in body.segments:
            if (triangles := segment_triangles(segment)) is None:
                continue
            name, colour = f"{root}/{segment.name}", side_colour(segment.name)
            self.frames[segment.name] = server.scene.add_frame(name, show_axes=False)
            mesh = server.scene.add_mesh_simple(f"{name}/shape", *triangles, color=colour, opacity=opacity)
            self._meshes.append(mesh)
        skin = skin_of(body)
        self._surface = [] if skin is None else _add_surface(server, skin, f"{root}/surface", opacity)
        self.has_surface = bool(self._surface)
        self._colours = [(mesh, mesh.color) for mesh in (*self._meshes, *self._surface)]
        self._visible, self._shapes_wanted = True, False
        self._show()

    def paint(self, colour: tuple[int, int, int] | None) -> None:
        """Give the whole body one colour, or those of its sides and clothes."""
        for mesh, own in self._colours:
            mesh.color = own if colour is None else colour

    def paint_shares(self, shares: FloatArray) -> None:
        """Colour the shapes by the largest share of the joints of each segment.

        Args:
            shares: (nv - 6,) torques over their limits.
        """
        index = self._body.joint_index
        for name, mesh in zip(self.frames, self._meshes, strict=True):
            joints = [index(hinge.name) for hinge in self._body.segment(name).hinges]
            mesh.color = share_colour(float(shares[joints].max(initial=0.0)))

    def place(self, q: FloatArray) -> None:
        """Show the configuration (nq,)."""
        pin.framesForwardKinematics(self._body.pinocchio, self.data, q)
        for name, frame in self.frames.items():
            frame.wxyz, frame.position = self._placement(name)
        for mesh in self._surface:
            for bone, segment in zip(mesh.bones, self._body.segments, strict=True):
                bone.wxyz, bone.position = self._placement(segment.name)

    def _placement(self, name: str) -> tuple[tuple[float, float, float, float], FloatArray]:
        placement = self.data.oMf[self._body.segment_frame(name)]
        x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
        return (w, x, y, z), placement.translation

    def top(self) -> FloatArray:
        """(3,) above the highest origin of a segment as the body is placed [m]."""
        places = [self.data.oMf[self._body.segment_frame(name)].translation for name in self.frames]
        return max(places, key=lambda place: place[2]) + np.array([0.0, 0.0, ABOVE])

    def show(self, visible: bool) -> None:
        """Draw the body, or hide it."""
        self._visible = visible
        self._show()

    def show_shapes(self, wanted: bool) -> None:
        """Draw the collision shapes of a person, or the surface."""
        self._shapes_wanted = wanted
        self._show()

    def _show(self) -> None:
        shapes = self._shapes_wanted or not self.has_surface
        for frame in self.frames.values():
            frame.visible = self._visible and shapes
        for mesh in self._surface:
            mesh.visible = self._visible and not shapes


def _add_surface(
    server: viser.ViserServer, skin: Skin, name: str, opacity: float
) -> list[viser.MeshSkinnedHandle]:
    """Draw the surface of a person, one mesh for each material, on bones that are its segments."""
    turned = Rotation.from_matrix(skin.rotations).as_quat()[:, [3, 0, 1, 2]]
    weights = np.zeros((len(skin.vertices), len(skin.segments)))
    np.add.at(weights, (np.arange(len(weights))[:, None], skin.bones), skin.weights)
    result = []
    for material in MATERIALS:
        used, faces = np.unique(skin.faces_of(material), return_inverse=True)
        colour = MATERIAL_COLOURS[material]
        result.append(server.scene.add_mesh_skinned(
            f"{name}/{material}", skin.vertices[used], faces.reshape(-1, 3), bone_wxyzs=turned,
            bone_positions=skin.origins, skin_weights=weights[used], side="double",
            color=np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]),
            opacity=None if opacity >= OPAQUE else opacity,
        ))  # fmt: skip
    return result


def side_colour(name: str) -> tuple[int, int, int]:
    """Colour of what belongs to a side of the body, by its name."""
    return next((COLOURS[side] for side in ("left", "right") if name.startswith(side)), COLOURS["trunk"])


SHARES = np.array([(196, 202, 210), (240, 200, 60), (215, 48, 39), (110, 0, 30)])
"""Colours of no torque, of half of the limit, of the limit, and of half more; between them it is blended."""


def share_colour(share: float) -> tuple[int, int, int]:
    """Colour of a torque over its limit."""
    at = np.linspace(0.0, 1.5, len(SHARES))
    red, green, blue = (round(float(np.interp(share, at, channel))) for channel in SHARES.T)
    return red, green, blue
