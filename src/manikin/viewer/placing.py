"""A task put down by hand: start and goal of a body in a scene, placed with the mouse, planned when asked."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
import viser
from numpy.typing import ArrayLike

from manikin.errors import InputError, ManikinError
from manikin.motion.file import MotionFile
from manikin.numerics.spatial import FloatArray, turned_root
from manikin.scenarios import Scenario
from manikin.viewer.canvas import COLOURS, Page, look_at
from manikin.viewer.door import Door

FRAME_RATE = 30.0
"""Updates per second."""
STEEPEST = float(np.deg2rad(35.0))
"""Slope of what a body is put on, at most [rad]."""
AHEAD = 0.35
"""Length of the arrow of a heading [m]."""
GHOST = 0.45
"""Opacity of the body at the goal."""
PLACES = {"at": 3, "heading_deg": 1, "height_m": 3}
"""Decimals that are kept of a place."""
End = Literal["start", "goal"]
ENDS: tuple[End, ...] = get_args(End)
POSTURES = ("standing", "seated", "crouched")
PACES = ("slow", "comfortable", "brisk")
OTHER_WAYS = ("supports", "com_constraints", "walking", "recovery", "push", "expect")
"""Sections of a scenario that say how its own task is done, taken out of one whose task is placed."""
TUNED = ("planning", "wholebody")
"""Sections that are options of a plan on the supports that a scenario lists."""


class Stopped(Exception):
    """Planning was stopped on the page."""


@dataclass(frozen=True, eq=False)
class Planned:
    """What became of a task: the verdict in words, and the motion file where there is a motion."""

    words: str
    content: MotionFile | None


Plan = Callable[[Scenario, Callable[..., None]], Planned]
"""Plans a scenario; reports (stage, share of it that is done, remark) on the way."""


class TaskViewer(Page):
    """Serves a scene in which start and goal are placed; every change goes through its methods.

    Planning is done by :meth:`advance`, that is by whoever runs the page, so that the page answers meanwhile.

    Attributes:
        places: (3,) where the body stands or sits at each end [m].
        headings: Where it faces there [deg].
        postures: How it is there at rest.
        pace: Of the motion.
        planned: What became of the task that was planned last.
    """

    def __init__(self, job: Scenario, door: Door, plan: Plan, before: Page | None = None) -> None:
        """Show the body at the places that the scenario gives, on a new server or that of a page before.

        Raises:
            InputError: If it is a scenario of a point mass, or of a scene without level ground.
        """
        if job.is_point_mass:
            raise InputError(f"{job.source}: body is a point mass; valid here: a body that stands")
        self._job, self._plan = job, plan
        self._body, self._scene = job.build_body(), job.build_scene()
        self._grounds = self._scene.surfaces_facing((0.0, 0.0, 1.0), STEEPEST)
        if not self._grounds:
            raise InputError(
                f"{job.source}: scene has nothing to stand on; valid: a floor, or level surfaces"
            )
        self.places: dict[End, FloatArray] = dict.fromkeys(ENDS, np.zeros(3))
        self.headings: dict[End, float] = dict.fromkeys(ENDS, 0.0)
        self.postures: dict[End, str] = dict.fromkeys(ENDS, "standing")
        self.pace = job.file.task.pace
        self.planned: Planned | None = None
        self._wanted, self._working, self._stopping = False, False, False
        self._held: End | None = None
        super().__init__(door, FRAME_RATE, before)
        self._add_scene(self._scene, endless_floor=True)
        self._standing = self._body.standing_posture()
        self._shapes = {
            "start": self._add_body(self._body, name="start"),
            "goal": self._add_body(self._body, GHOST, "goal"),
        }
        self._build_handles()
        self._build_controls()
        for end in ENDS:
            self._place_as_given(end)
        middle = 0.5 * (self.places["start"] + self.places["goal"]) + (0.0, 0.0, 0.9)
        look_at(self.server, middle, float(np.linalg.norm(self.places["goal"] - self.places["start"])))

    def place(self, end: End, position: ArrayLike, heading_deg: float | None = None) -> None:
        """Put an end of the task on the ground that is nearest in height below or above a position (3,) [m].

        Where there is none the end stays where it was. The heading [deg] stays if it is not given.
        """
        with self._lock:
            ground = self._ground(np.asarray(position, dtype=np.float64))
            self.places[end] = self.places[end] if ground is None else ground
            self.headings[end] = self.headings[end] if heading_deg is None else heading_deg
            self._show(end)

    def click(self, end: End, origin: ArrayLike, direction: ArrayLike) -> None:
        """Put an end of the task on the first ground along a ray from (3,) [m] along (3,)."""
        start, along = np.asarray(origin, dtype=np.float64), np.asarray(direction, dtype=np.float64)
        met = [
            start + share * along
            for surface in self._grounds
            if (fall := float(-along @ surface.normal)) > 0.0
            and (share := float(surface.height(start[None])[0]) / fall) > 0.0
            and surface.holds((start + share * along)[None])[0]
        ]
        if met:
            self.place(end, min(met, key=lambda point: float(np.linalg.norm(point - start))))

    def scenario(self) -> Scenario:
        """The task as it is placed; ScenarioError if the scenario's other sections do not go with it."""
        with self._lock:
            task: dict[str, Any] = {"pace": self.pace}
            for end in ENDS:
                x, y, z = self.places[end]
                given = {"at": [x, y], "heading_deg": self.headings[end], "height_m": z}
                task[end] = {key: np.round(given[key], PLACES[key]).tolist() for key in PLACES}
                task[end]["posture"] = self.postures[end]
        tuned = () if self._job.file.supports is None else TUNED
        return self._job.replaced(task=task, **dict.fromkeys((*OTHER_WAYS, *tuned)))

    def ask(self) -> None:
        """Ask for a plan; :meth:`advance` makes it."""
        with self._lock:
            self._wanted, self._stopping = not self._working, False

    def stop(self) -> None:
        """Stop planning at the next report of its progress."""
        with self._lock:
            self._wanted, self._stopping = False, True

    def advance(self, seconds: float) -> None:  # noqa: ARG002
        """Plan, if that was asked for, and leave the page once there is a motion to watch."""
        with self._lock:
            wanted, self._wanted = self._wanted, False
            self._working = wanted
        if not wanted:
            return
        self._button.disabled = True
        try:
            self.planned = self._plan(self.scenario(), self._report)
            words = self.planned.words
        except Stopped:
            words = "stopped"
        except ManikinError as error:
            words = str(error)
        self._say(words)
        self._working, self._button.disabled = False, False
        if self.planned is not None and self.planned.content is not None:
            self.leave()

    def _report(self, stage: str, share: float, remark: str = "") -> None:
        if self._stopping:
            raise Stopped
        self._say(f"{stage} {100.0 * share:.0f} % {remark}".rstrip())

    def _say(self, words: str) -> None:
        self._text.content = words

    def _ground(self, position: FloatArray) -> FloatArray | None:
        """(3,) on the surface straight above or below a position whose height is nearest; None without."""
        heights = []
        for surface in self._grounds:
            # Along the vertical a plane is as far as along its normal, over the cosine of its slope.
            point = position - (0.0, 0.0, surface.height(position[None])[0] / surface.normal[2])
            heights += [point] if surface.holds(point[None])[0] else []
        return min(heights, key=lambda point: abs(point[2] - position[2]), default=None)

    def _place_as_given(self, end: End) -> None:
        """Put an end where the scenario has it; a goal that is nowhere else is a step ahead of the start."""
        state = getattr(self._job.file.task, end)
        self.postures[end] = state.posture if state.posture in POSTURES else "standing"
        self._choices[end].value = self.postures[end]
        if state.at is not None:
            at, height = state.at, 0.0 if state.height_m is None else state.height_m
        else:
            at, height = state.com[:2], self._scene.floor_height or 0.0
        self.place(end, (*at, height), state.heading_deg or 0.0)
        if end == "goal" and np.allclose(self.places["goal"][:2], self.places["start"][:2]):
            turn = np.deg2rad(self.headings["start"])
            self.place(end, self.places["start"] + (np.cos(turn), np.sin(turn), 0.0))

    def _build_handles(self) -> None:
        scene = self.server.scene
        self._gizmos: dict[End, viser.TransformControlsHandle] = {
            end: scene.add_transform_controls(
                f"{self.root}/move/{end}", scale=0.5, active_axes=(True, True, False), depth_test=False
            )
            for end in ENDS
        }
        self._arrows = {end: self._add_arrow(f"heading/{end}", COLOURS["force"]) for end in ENDS}
        self._names = {
            end: scene.add_label(f"{self.root}/names/{end}", end, anchor="bottom-center") for end in ENDS
        }
        for end, gizmo in self._gizmos.items():
            gizmo.on_update(partial(self._dragged, end))
        scene.on_click()(self._clicked)

    def _build_controls(self) -> None:
        gui = self.server.gui
        with gui.add_folder("Task"):
            gui.add_markdown("Drag the arrows of a body, turn it by the ring, or click on the ground.")
            self._clicks = gui.add_dropdown("a click places", ("nothing", *ENDS), initial_value="nothing")
            self._choices: dict[End, viser.GuiDropdownHandle] = {
                end: gui.add_dropdown(f"at the {end}", POSTURES, initial_value="standing") for end in ENDS
            }
            pace = gui.add_dropdown("pace", PACES, initial_value=self.pace)
        with gui.add_folder("Plan"):
            self._button = gui.add_button("Plan and watch")
            stop, keep = gui.add_button("Stop"), gui.add_button("Save the scenario")
            self._text = gui.add_markdown("")
        for end, choice in self._choices.items():
            choice.on_update(partial(self._chosen, end))
        pace.on_update(lambda _: setattr(self, "pace", pace.value))
        self._button.on_click(lambda _: self.ask())
        stop.on_click(lambda _: self.stop())
        keep.on_click(lambda event: None if event.client is None else self._send(event.client))

    def _send(self, client: Any) -> None:
        try:
            text = self.scenario().to_short_yaml()
        except ManikinError as error:
            self._say(str(error))
        else:
            client.send_file_download(f"{self._job.name}.yaml", text.encode())

    def _dragged(self, end: End, event: Any) -> None:
        gizmo = self._gizmos[end]
        with self._lock:
            self._held = None if event.phase == "end" else end
            self.place(end, gizmo.position, _yaw(gizmo.wxyz))

    def _chosen(self, end: End, _: Any) -> None:
        self.postures[end] = self._choices[end].value

    def _clicked(self, event: Any) -> None:
        if (end := self._clicks.value) in ENDS:
            self.click(end, event.ray_origin, event.ray_direction)

    def _show(self, end: End) -> None:
        place, yaw = self.places[end], float(np.deg2rad(self.headings[end]))
        q = turned_root(self._standing, yaw)
        q[:3] += place
        ahead = place + np.array([0.0, 0.0, 0.02])
        with self.server.atomic():
            self._shapes[end].place(q)
            self._names[end].position = self._shapes[end].top()
            self._arrows[end].points = np.array(
                [[ahead, ahead + AHEAD * np.array([np.cos(yaw), np.sin(yaw), 0.0])]]
            )
            self._arrows[end].visible = True
            if self._held != end:  # what a hand holds goes where the hand goes
                turn = np.cos(0.5 * yaw), 0.0, 0.0, np.sin(0.5 * yaw)
                self._gizmos[end].position, self._gizmos[end].wxyz = place, turn


def _yaw(wxyz: ArrayLike) -> float:
    """Angle of a quaternion, the real part first, about the vertical [deg]."""
    w, _, _, z = np.asarray(wxyz, dtype=np.float64)
    return float(np.rad2deg(2.0 * np.arctan2(z, w)))
