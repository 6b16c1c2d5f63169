"""The interactive mode: a body is dragged through its scene, and its contacts follow."""

import threading
from collections.abc import Sequence

import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts import HEURISTICS
from manikin.planning.contacts.single_contact import LiveAnswer, LiveContacts, Role
from manikin.viewer.canvas import BodyShapes, Page, add_arrow, add_scene, look_at, side_colour

FRAME_RATE = 60.0
"""Largest number of updates per second; a change that comes while one is made waits for the next."""
NORMAL = 0.2
"""Length of a contact's normal [m]."""
TASK = 0.6
"""Length of the task's arrow [m]."""


class ContactViewer(Page):
    """Serves one body in its scene; every change goes through its methods.

    Callbacks of the page only note what is wanted; :meth:`update` makes the newest of it, so that a
    fast hand never waits for old poses.

    Attributes:
        live: The body, the task and what follows.
        latest: The last answer shown.
        updates: Number of answers so far.
    """

    def __init__(self, live: LiveContacts, port: int = 8080) -> None:
        """Start the server and show the first contacts.

        Args:
            live: The body, its scene and where it begins.

        Raises:
            InputError: If the port is taken.
        """
        super().__init__(port, FRAME_RATE)
        self.live = live
        self.updates = 0
        self._wanted = threading.Event()
        add_scene(self.server, live.scene)
        self._shapes = BodyShapes(self.server, live.body)
        self._build_handles()
        self._build_controls()
        look_at(self.server, live.q[:3])
        self._wanted.set()
        self.latest: LiveAnswer = self.update() or live.answer()

    def move(self, position: Sequence[float] | FloatArray, wxyz: Sequence[float] | FloatArray) -> None:
        """Put the root elsewhere, as the gizmo does.

        Args:
            position: (3,) [m].
            wxyz: (4,) quaternion, the real part first as viser has it.
        """
        with self._lock:
            w, x, y, z = wxyz
            self.live.move(position, (x, y, z, w))
            self._wanted.set()

    def aim(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Turn the task."""
        with self._lock:
            self.live.aim(azimuth_deg, elevation_deg)
            self._wanted.set()

    def choose(self, heuristic: str, role: str, pulling: bool, limbs: Sequence[str]) -> None:
        """Set what the limbs are asked for."""
        with self._lock:
            self.live.heuristic, self.live.role, self.live.pulling = heuristic, Role(role), pulling
            self.live.ask(limbs)
            self._wanted.set()

    def update(self) -> LiveAnswer | None:
        """Find and show the contacts, if anything has changed since the last time."""
        if not self._wanted.is_set():
            return None
        with self._lock:
            self._wanted.clear()
            answer = self.live.answer()
            self._show(answer)
            self.latest = answer
            self.updates += 1
            return answer

    def advance(self, seconds: float) -> None:  # noqa: ARG002
        """Show the newest contacts, if anything has changed."""
        self.update()

    def _build_handles(self) -> None:
        scene, (x, y, z, w) = self.server.scene, self.live.q[3:7]
        self.gizmo = scene.add_transform_controls(
            "/move", scale=0.35, position=self.live.q[:3], wxyz=(w, x, y, z), depth_test=False
        )
        self.gizmo.on_update(lambda _: self.move(self.gizmo.position, self.gizmo.wxyz))
        self._task = scene.add_arrows("/task", _arrow(np.zeros(3), np.ones(3)), np.zeros(3, dtype=np.uint8))
        self._normals = {
            limb.name: add_arrow(self.server, f"/contacts/{limb.name}", side_colour(limb.name))
            for limb in self.live.body.limbs
        }

    def _build_controls(self) -> None:
        gui, names = self.server.gui, [limb.name for limb in self.live.body.limbs]
        with gui.add_folder("Task"):
            self.azimuth = gui.add_slider(
                "azimuth [deg]", min=-180.0, max=180.0, step=1.0, initial_value=self.live.azimuth_deg
            )
            self.elevation = gui.add_slider(
                "elevation [deg]", min=-90.0, max=90.0, step=1.0, initial_value=self.live.elevation_deg
            )
            self.role = gui.add_dropdown("limbs move", tuple(Role), initial_value=self.live.role.value)
            self.pulling = gui.add_checkbox("hold on and pull", initial_value=self.live.pulling)
        with gui.add_folder("Contacts"):
            self.heuristic = gui.add_dropdown("heuristic", HEURISTICS, initial_value=self.live.heuristic)
            self.limbs = {
                name: gui.add_checkbox(name.replace("_", " "), initial_value=name in self.live.limbs)
                for name in names
            }
        with gui.add_folder("Now"):
            self._text = gui.add_markdown("")
        for handle in (self.azimuth, self.elevation):
            handle.on_update(lambda _: self.aim(self.azimuth.value, self.elevation.value))
        for handle in (self.role, self.pulling, self.heuristic, *self.limbs.values()):
            handle.on_update(lambda _: self._chosen())

    def _chosen(self) -> None:
        wanted = [name for name, handle in self.limbs.items() if handle.value]
        self.choose(self.heuristic.value, self.role.value, self.pulling.value, wanted)

    def _show(self, answer: LiveAnswer) -> None:
        with self.server.atomic():
            self._shapes.place(answer.q)
            head = answer.q[:3] + np.array([0.0, 0.0, 1.05])
            self._task.points = _arrow(head, TASK * self.live.direction)
            for name, arrow in self._normals.items():
                result = answer.answers.get(name)
                contact = None if result is None else result.contact
                if contact is not None:
                    arrow.points = _arrow(contact.position, NORMAL * contact.normal)
                arrow.visible = contact is not None
        self._text.content = "\n".join([f"**{1e3 * answer.wall_s:.1f} ms**", "", *_lines(answer)])


def _lines(answer: LiveAnswer) -> list[str]:
    """Result of each limb, in one line each."""
    lines = []
    for name, result in answer.answers.items():
        words = f"{result.obstacle}, EFORT {answer.efforts[name]:.2f}" if result.found else result.message
        lines.append(f"- {name.replace('_', ' ')}: {words}")
    return lines


def _arrow(start: FloatArray, vector: FloatArray) -> FloatArray:
    """(1, 2, 3) points of an arrow."""
    return np.array([[start, start + vector]])
