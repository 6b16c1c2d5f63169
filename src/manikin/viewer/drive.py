"""What is moved by hand: a walker steered with keys and sliders, a body dragged through its scene."""

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, limb_named
from manikin.contact import ContactKind
from manikin.errors import InputError
from manikin.kinematics.efort import usable_efort
from manikin.kinematics.limb_samples import sample_limbs
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.planning.contacts import HEURISTICS, ContactGenerator, ContactRules, GeneratedContact
from manikin.planning.contacts.generator import UsableEfort
from manikin.planning.contacts.heuristics import heuristic_named
from manikin.planning.contacts.single_contact import Role, ask_limb, check_limbs
from manikin.runtime.display import readable
from manikin.scene import Scene
from manikin.viewer.canvas import COLOURS, VIEW, Page, look_at, side_colour
from manikin.viewer.door import Door
from manikin.walking import WalkController, WalkFrame

if TYPE_CHECKING:
    from viser import ClientHandle, GuiEvent
    from viser._messages import HotkeyKey

FRAME_RATE = 60.0
"""Pictures or updates per second; a change that comes while one is made waits for the next."""
LONGEST_STEP = 0.05
"""Longest step of the controller [s]; a late page catches up in several steps."""
LONGEST_GAP = 0.5
"""Longest time that a late page catches up [s]."""
TRAIL = 600
"""Places that are kept of the way [frames]."""


@dataclass(frozen=True)
class Key:
    """Effect of one key, by the page's name of it, on the directive.

    Attributes:
        change: Of forward, left [m/s] and angular velocity [rad/s]; zeros to go straight on, None to stop.
    """

    hotkey: "HotkeyKey"
    label: str
    change: tuple[float, float, float] | None

    @property
    def shown(self) -> str:
        """Common name of the key."""
        return self.hotkey.removeprefix("arrow") if self.hotkey != "space" else "space bar"


KEYS = (
    Key("arrowup", "Faster", (0.2, 0.0, 0.0)), Key("arrowdown", "Slower", (-0.2, 0.0, 0.0)),
    Key("arrowleft", "Turn left", (0.0, 0.0, 0.25)), Key("arrowright", "Turn right", (0.0, 0.0, -0.25)),
    Key("A", "Sideways to the left", (0.0, 0.1, 0.0)), Key("D", "Sideways to the right", (0.0, -0.1, 0.0)),
    Key("S", "Straight on", (0.0, 0.0, 0.0)), Key("space", "Stop", None),
)  # fmt: skip
"""Keys of the page; each press changes the directive once more."""

LOWEST, HIGHEST = np.array([-0.8, -0.8, -2.0]), np.array([3.0, 0.8, 2.0])
"""Limits of the directive, forward, left [m/s] and angular [rad/s]; the walker has its own within them."""


class WalkViewer(Page):
    """Serves a walker that is steered with keys and sliders; every change goes through its methods.

    Attributes:
        directive: (3,) wanted forward, left [m/s] and angular velocity [rad/s].
        notice: What the walker says about the last directive, or None.
    """

    def __init__(self, controller: WalkController, door: Door, scene: Scene | None = None) -> None:
        """Start the server and show the walker standing in a scene that it does not see.

        Raises:
            InputError: If the scene has no floor.
        """
        scene = Scene(floor_height=0.0) if scene is None else scene
        if scene.floor_height is None:
            raise InputError("scene has no floor; valid: floor_height_m, to walk on")
        super().__init__(door, FRAME_RATE)
        self.controller, self.directive = controller, np.zeros(3)
        self.notice: str | None = None
        self._place = np.zeros(3)
        self._trail: list[FloatArray] = []
        self._add_scene(scene, endless_floor=True)
        self._floor = scene.floor_height
        self._raised = np.zeros(controller.body.nq)
        self._raised[2] = self._floor
        self._shapes = self._add_body(controller.body)
        self._build_controls()
        self.advance(1.0 / FRAME_RATE)
        look_at(self.server, self._middle)
        self.server.on_client_connect(self._welcome)

    def press(self, key: Key) -> None:
        """Change the directive as a key does."""
        if key.change is None:
            self.steer(np.zeros(3))
        else:
            self.steer(self.directive + key.change if any(key.change) else self.directive * [1.0, 0.0, 0.0])

    def steer(self, directive: FloatArray) -> None:
        """Set the directive (3,), see :attr:`directive`, held within the limits of the page."""
        with self._lock:
            # Presses add up to tenths; what is left of them by rounding is no direction.
            held = np.round(np.clip(directive, LOWEST, HIGHEST), 6)
            if np.array_equal(held, self.directive):
                return
            self.directive = held
            for handle, value in zip(self._sliders, held, strict=True):
                handle.value = float(value)

    def advance(self, seconds: float) -> None:
        """Walk for ``seconds`` of real time [s], as far as they are made up for."""
        with self._lock:
            left = min(seconds, LONGEST_GAP)
            count = max(1, int(np.ceil(left / LONGEST_STEP)))
            for _ in range(count):
                frame = self.controller.step(left / count, self.directive)
            self.notice = frame.notice
            self._show(frame)

    def _build_controls(self) -> None:
        gui = self.server.gui
        with gui.add_folder("Directive"):
            labels = "forward [m/s]", "left [m/s]", "turn left [rad/s]"
            self._sliders = [
                gui.add_slider(label, float(low), float(high), 0.05, 0.0)
                for label, low, high in zip(labels, LOWEST, HIGHEST, strict=True)
            ]
            self._follow = gui.add_checkbox("camera follows", initial_value=True)
        with gui.add_folder("Keys"):
            gui.add_markdown("\n".join(f"- **{key.shown}**: {key.label.lower()}" for key in KEYS))
        with gui.add_folder("Now"):
            self._text = gui.add_markdown("")
        for handle in self._sliders:
            handle.on_update(self._slid)
        for key in KEYS:
            gui.add_command(key.label, hotkey=key.hotkey).on_trigger(lambda _, key=key: self.press(key))

    def _welcome(self, client: "ClientHandle") -> None:
        """Point the camera of a new visitor at the walker."""
        with client.atomic():
            client.camera.position, client.camera.look_at = self._middle + VIEW, self._middle

    @property
    def _middle(self) -> FloatArray:
        """(3,) middle of the walker [m]."""
        return np.append(self._place[:2], self._floor + 0.9)

    def _slid(self, event: "GuiEvent[Any]") -> None:
        """Follow the sliders, unless it was this page that moved them."""
        if event.client is not None:
            self.steer(np.array([item.value for item in self._sliders]))

    def _show(self, frame: WalkFrame) -> None:
        moved = bool(np.any(frame.place != self._place))
        self._place = frame.place
        self._trail = [*self._trail[-TRAIL:], np.append(frame.place[:2], self._floor + 0.004)]
        with self.server.atomic():
            self._shapes.place(frame.q + self._raised)
            if len(self._trail) > 1:
                path = np.array(self._trail)
                self._draw_lines("trail", np.stack([path[:-1], path[1:]], axis=1), COLOURS["planned"], 2.0)
        if moved and self._follow.value:
            middle = self._middle
            for client in self.server.get_clients().values():
                with client.atomic():
                    # What the page last said of its camera may be late, but not how it looks at the walker.
                    view = client.camera.position - client.camera.look_at
                    client.camera.position, client.camera.look_at = middle + view, middle
        forward, left, angular = frame.velocity
        standing = [name for name, on in zip(("left", "right"), frame.support, strict=True) if on]
        lines = [f"forward {forward:.2f} m/s, left {left:.2f} m/s, turning {angular:.2f} rad/s"]
        lines += [f"standing on: {', '.join(standing) or 'nothing'}", frame.notice or ""]
        self._text.content = "\n".join(f"- {line}" for line in lines if line)


@dataclass(frozen=True, eq=False)
class LiveAnswer:
    """Answers of all limbs.

    Attributes:
        q: (nq,) the body with each limb that found a contact in it.
        answers: The limbs' answers by their names, in the order in which they were asked.
        efforts: EFORT of each posture found [N per N.m].
        wall_s: Wall time of all requests [s].
    """

    q: FloatArray
    answers: dict[str, GeneratedContact]
    efforts: dict[str, float]
    wall_s: float


class LiveContacts:
    """The pose of a body, a task, and the contacts that follow from both.

    Attributes:
        q: (nq,) the body as it was put, before any limb is moved.
        azimuth_deg: Direction of the task about the vertical, from world x [deg].
        elevation_deg: Direction of the task above the horizon [deg].
        limbs: Names of the limbs that are asked.
        role: What the limbs do with their contacts.
        pulling: Whether they hold on and pull.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, q: ArrayLike, *, samples: int = 10_000, seed: int = 0,
        rules: ContactRules | None = None,
    ) -> None:  # fmt: skip
        """Begin at a configuration (nq,), with a number of samples of each limb drawn from a seed.

        Raises:
            BodyError: If the body has no limbs.
        """
        check_limbs(body)
        self.body, self.scene = body, scene
        self.q = np.array(q, dtype=np.float64)
        self.azimuth_deg, self.elevation_deg = 0.0, 90.0
        self.limbs: tuple[str, ...] = tuple(limb.name for limb in body.limbs)
        self.heuristic = "efort"
        self.role = Role.AUTO
        self.pulling = False
        self._generator = ContactGenerator(
            body, scene, sample_limbs(body, np.random.default_rng(seed), samples), rules=rules
        )

    def move(self, position: ArrayLike, quaternion: ArrayLike) -> None:
        """Put the root at a position (3,) [m] with a quaternion xyzw (4,), normalised here."""
        turn = frozen_array(quaternion, "quaternion", (4,))
        self.q[:3] = frozen_array(position, "position [m]", (3,))
        self.q[3:7] = turn / np.linalg.norm(turn)

    def aim(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Turn the task: azimuth about the vertical from world x, elevation above the horizon [deg]."""
        self.azimuth_deg, self.elevation_deg = float(azimuth_deg), float(elevation_deg)

    @property
    def direction(self) -> FloatArray:
        """(3,) unit direction of the task in the world."""
        azimuth, elevation = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        level = np.cos(elevation)
        return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])

    def ask(self, limbs: Sequence[str]) -> None:
        """Choose the limbs that are asked, in the body's own order."""
        self.limbs = tuple(limb.name for limb in self.body.limbs if limb.name in limbs)

    def answer(self) -> LiveAnswer:
        """Ask one limb after the other; each sees the postures of those before it."""
        started = time.perf_counter()
        heuristic = heuristic_named(self.heuristic, pulling=self.pulling)
        kind = ContactKind.GRASP if self.pulling else None
        q, answers, efforts = np.array(self.q), {}, {}
        for name in self.limbs:
            limb = limb_named(self.body, name)
            usable = UsableEfort(usable_efort(self.body, limb), self.pulling)
            _, answers[name], value = ask_limb(
                self._generator, q, limb, self.direction, self.role, heuristic, kind, usable
            )
            efforts |= {} if value is None else {name: value}
            reached = answers[name].q
            q = q if reached is None else np.array(reached)
        return LiveAnswer(q, answers, efforts, time.perf_counter() - started)


NORMAL = 0.2
"""Length of a contact's normal [m]."""
TASK = 0.6
"""Length of the task's arrow [m]."""


class ContactViewer(Page):
    """Serves one body in its scene; every change goes through its methods.

    Callbacks of the page only note what is wanted; :meth:`update` makes the newest of it, so that a fast hand
    never waits for old poses.

    Attributes:
        latest: The last answer shown.
        updates: Number of answers so far.
    """

    def __init__(self, live: LiveContacts, door: Door) -> None:
        """Start the server and show the first contacts."""
        super().__init__(door, FRAME_RATE)
        self.live = live
        self.updates = 0
        self._wanted = threading.Event()
        self._add_scene(live.scene)
        self._shapes = self._add_body(live.body)
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
            self.latest = self.live.answer()
            self._show(self.latest)
            self.updates += 1
            return self.latest

    def advance(self, seconds: float) -> None:  # noqa: ARG002
        """Show the newest contacts, if anything has changed."""
        self.update()

    def _build_handles(self) -> None:
        scene, (x, y, z, w) = self.server.scene, self.live.q[3:7]
        self.gizmo = scene.add_transform_controls(
            f"{self.root}/move", scale=0.35, position=self.live.q[:3], wxyz=(w, x, y, z), depth_test=False
        )
        self.gizmo.on_update(lambda _: self.move(self.gizmo.position, self.gizmo.wxyz))
        self._task = scene.add_arrows(
            f"{self.root}/task", _arrow(np.zeros(3), np.ones(3)), np.zeros(3, dtype=np.uint8)
        )
        sides = {limb.name: side_colour(limb.name) for limb in self.live.body.limbs}
        self._normals = {name: self._add_arrow(f"contacts/{name}", sides[name]) for name in sides}

    def _build_controls(self) -> None:
        gui, names = self.server.gui, [limb.name for limb in self.live.body.limbs]
        with gui.add_folder("Task"):
            self.azimuth = gui.add_slider("azimuth [deg]", -180.0, 180.0, 1.0, self.live.azimuth_deg)
            self.elevation = gui.add_slider("elevation [deg]", -90.0, 90.0, 1.0, self.live.elevation_deg)
            self.role = gui.add_dropdown("limbs move", tuple(Role), initial_value=self.live.role.value)
            self.pulling = gui.add_checkbox("hold on and pull", initial_value=self.live.pulling)
        with gui.add_folder("Contacts"):
            self.heuristic = gui.add_dropdown("heuristic", HEURISTICS, initial_value=self.live.heuristic)
            self.limbs = {name: gui.add_checkbox(readable(name), name in self.live.limbs) for name in names}
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
        lines = [f"**{1e3 * answer.wall_s:.1f} ms**", ""]
        for name, result in answer.answers.items():
            words = f"{result.obstacle}, EFORT {answer.efforts[name]:.2f}" if result.found else result.message
            lines.append(f"- {readable(name)}: {words}")
        self._text.content = "\n".join(lines)


def _arrow(start: FloatArray, vector: FloatArray) -> FloatArray:
    """(1, 2, 3) points of an arrow."""
    return np.array([[start, start + vector]])
