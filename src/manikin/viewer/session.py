"""One viewer in the browser: the scene, the body, the controls and their state."""

import io
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import viser
from PIL import Image
from viser import uplot

from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.motion.motion import effector_positions
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import readable
from manikin.viewer.canvas import (
    COLOURS,
    Page,
    carry_cameras,
    look_at,
    look_from,
    share_colour,
    side_colour,
)
from manikin.viewer.door import Door

FRAME_RATE = 30.0
"""Pictures per second while playing."""
METRES_PER_NEWTON = 1e-3
SMALLEST_FORCE = 5.0
"""Contact forces below this are not drawn [N]."""
PLOT_POINTS = 400
MOST_PLACES = 1000
"""Places of the centre of mass that are drawn, about."""
BESIDE = 1.2
"""Distance of the motion beside from the motion shown, to begin with [m]."""
NOTHING = "nothing"
AS_IT_IS, TORQUE = "as it is", "torque"
SPEEDS = ("0.1", "0.25", "0.5", "1", "2")
STEPS = {"-0.1": -0.1, "-0.01": -0.01, "+0.01": 0.01, "+0.1": 0.1}
MARGIN = "margin"
PAINTINGS = (AS_IT_IS, TORQUE, MARGIN)
"""What the body may be coloured by."""
VIEWS = {"front": (2.8, 0.0, 0.4), "behind": (-2.8, 0.0, 0.6), "left": (0.0, 2.8, 0.2),
         "right": (0.0, -2.8, 0.2), "above": (-0.05, 0.0, 4.0)}  # fmt: skip
"""Where the camera stands from the centre of mass: ahead on the way, to its left, upward [m]."""
LARGEST_PICTURE = (1080, 1920)
"""Height and width of a picture, at most [pixels]."""
FILMS = ("mp4", "gif")
FilmMaker = Callable[[MotionFile, str, str, Callable[[float], object]], bytes]
"""Makes a film of a motion of a file, by its name, in one of :data:`FILMS`; told the share that is done."""


class ViewerSession(Page):
    """Serves one motion file; every change of state goes through its methods.

    Attributes:
        chosen, beside: Names of the motion shown, and of that beside it or ``"nothing"``.
        time: Instant shown [s].
        playing: Whether time runs.
        speed: Seconds of motion per second.
        looping: Whether time begins again at the end.
        following: Whether the cameras go along with the centre of mass.
        apart: Distance of the motion beside from the motion shown [m]; 0 lays it over.
        again: Whether the page was left to place the task anew.
    """

    def __init__(
        self, content: MotionFile, door: Door, others: Mapping[str, MotionFile] | None = None,
        verdict: str | None = None, before: Page | None = None, film: FilmMaker | None = None,
    ) -> None:  # fmt: skip
        """Start the server and draw the first instant, with others who are there on the same clock, by name.

        A verdict is of a task that was placed on the page before, whose server this one then has, and a
        button to place it anew. With a maker of films there is a button for one.

        Raises:
            InputError: If a file holds no body.
        """
        if content.body is None:
            raise InputError("motion file holds no body; valid: a motion file written by 'manikin run'")
        for name, other in (others or {}).items():
            if other.body is None or not other.motions:
                problem = f"motion of {name} holds no body or no motion"
                raise InputError(f"{problem}; valid: as 'manikin run' wrote it")
        self.content, self._body, self._film = content, content.body, film
        self.chosen = list(content.motions)[-1]
        self.beside = "recorded" if content.recorded is not None and self.chosen != "recorded" else NOTHING
        self.playing, self.speed, self.looping, self.following = False, 1.0, False, False
        self._painting, self.plotted = AS_IT_IS, MARGIN
        self.apart, self.again = BESIDE, False
        self._feet: dict[str, FloatArray] = {}
        self._filming = threading.Lock()
        if content.body.is_point_mass:
            names = self.motion.contact_names
            self._feet = effector_positions(content.body, self.motion, names, content.schedule)
        super().__init__(door, FRAME_RATE, before)
        self.time = float(self.motion.time[0])
        self._build_scene()
        self._build_body()
        self._others = [
            (self._add_body(other.body, 0.35, f"others/{name}"), list(other.motions.values())[-1])
            for name, other in (others or {}).items()
            if other.body is not None
        ]
        self._build_controls()
        if verdict is not None:
            self.server.gui.add_markdown(verdict, order=-2)
            self.server.gui.add_button("Place anew", order=-1).on_click(lambda _: self.place_anew())
        self.put_beside(self.beside)

    @property
    def motion(self) -> Motion:
        """The motion shown."""
        return self.content.motions[self.chosen]

    def show(self, time: float) -> None:
        """Show the instant ``time`` [s], held inside the motion."""
        with self._lock:
            motion = self.motion
            before = motion.com[self._sample(motion)]
            self.time = float(np.clip(time, motion.time[0], motion.time[-1]))
            index = self._sample(motion)
            if self.following:
                carry_cameras(self.server, motion.com[index] - before)
            with self.server.atomic():
                self._shapes.place(motion.q[index])
                self._paint(motion, index)
                self._place_legs(motion, index)
                self._place_forces(motion, index)
                self._com.position = motion.com[index]
                for shapes, other in self._others:
                    shapes.place(other.q[self._sample(other)])
                self._place_beside()
            self._show_numbers(motion, index)

    def choose(self, name: str) -> None:
        """Show another motion of the file at the same instant.

        Raises:
            InputError: If the file does not hold it.
        """
        self._check(name, *self.content.motions)
        with self._lock:
            self.chosen = self._motions_box.value = name
            self.show(self.time)

    @staticmethod
    def _check(name: str, *valid: str) -> None:
        if name not in valid:
            raise InputError(f"motion is {name!r}; valid here: {', '.join(valid)}")

    def put_beside(self, name: str) -> None:
        """Show a motion of the file, or ``"nothing"``, beside the chosen one, at the same instant.

        Raises:
            InputError: If the file does not hold it.
        """
        self._check(name, NOTHING, *self.content.motions)
        with self._lock:
            self.beside = self._beside_box.value = name
            if name != NOTHING:
                self._second.paint(COLOURS[name])
            self.show(self.time)

    def show_shapes(self, wanted: bool) -> None:
        """Show the collision shapes of the bodies instead of their surfaces; torques are shown on shapes."""
        with self._lock:
            for shapes in (self._shapes, self._second, *(item for item, _ in self._others)):
                shapes.show_shapes(wanted or (shapes is self._shapes and self._painting == TORQUE))

    def play(self) -> None:
        """Let time run, from the beginning when it is at the end."""
        with self._lock:
            if self.time >= self.motion.time[-1]:
                self.show(float(self.motion.time[0]))
            self.playing = True
            self._button.label = "Pause"

    def pause(self) -> None:
        """Stop time."""
        with self._lock:
            self.playing = False
            self._button.label = "Play"

    def advance(self, seconds: float) -> None:
        """Let ``seconds`` of real time pass; stops at the end of the motion."""
        with self._lock:
            if not self.playing:
                return
            self.show(self.time + seconds * self.speed)
            if self.time >= self.motion.time[-1] and self.looping:
                self.show(float(self.motion.time[0]))
            elif self.time >= self.motion.time[-1]:
                self.pause()

    def step(self, seconds: float) -> None:
        """Stop, and show what is so much later, or earlier if it is negative [s]."""
        self.pause()
        self.show(self.time + seconds)

    def look(self, view: str) -> None:
        """Let every visitor look from one of :data:`VIEWS`.

        Raises:
            InputError: If there is no such view.
        """
        if view not in VIEWS:
            raise InputError(f"view is {view!r}; valid: {', '.join(VIEWS)}")
        with self._lock:
            left = _across(self.motion.com)
            ahead = np.array([left[1], -left[0]])
            forward, aside, up = VIEWS[view]
            middle = self.motion.com[self._sample(self.motion)]
            look_from(self.server, middle, np.append(forward * ahead + aside * left, up))

    def paint_by(self, quantity: str) -> None:
        """Colour the shapes of the body by the joints' torques, the whole body by the margin, or neither.

        Raises:
            InputError: If there is no such quantity.
        """
        if quantity not in PAINTINGS:
            raise InputError(f"colour is by {quantity!r}; valid: {', '.join(PAINTINGS)}")
        with self._lock:
            self._painting = self._painting_box.value = quantity
            self._shapes.paint(None)
            self.show_shapes(self._shapes_box.value)
            self.show(self.time)

    def set_apart(self, distance: float) -> None:
        """Draw the motion beside at a distance from the motion shown [m]; 0 lays it over."""
        with self._lock:
            self.apart = self._apart_slider.value = distance
            self.show(self.time)

    def place_anew(self) -> None:
        """Leave the page, for the task to be placed anew."""
        self.again = True
        self.leave()

    def plot(self, quantity: str) -> None:
        """Plot the margin, or the torque of a joint over its limit, of all motions of the file.

        Raises:
            InputError: If the body has no such joint.
        """
        if quantity not in (MARGIN, *self._body.joint_names):
            joints = ", ".join(self._body.joint_names)
            raise InputError(f"quantity is {quantity!r}; valid: {MARGIN}, {joints}")
        with self._lock:
            self.plotted = self._plotted_box.value = quantity
            self._plot.remove()
            self._build_plot()
            self.show(self.time)

    def send_picture(self, client: viser.ClientHandle) -> None:
        """Let a visitor's browser draw what it shows as a PNG file, and keep it."""
        height, width = (
            min(seen, most)
            for seen, most in zip(
                (client.camera.image_height, client.camera.image_width), LARGEST_PICTURE, strict=True
            )
        )
        file = io.BytesIO()
        Image.fromarray(client.get_render(height, width, transport_format="png")).save(file, "PNG")
        client.send_file_download(f"{self.chosen}-{self.time:.3f}s.png", file.getvalue())

    def send_film(self, client: viser.ClientHandle, kind: str) -> None:
        """Make a film of the motion shown, in one of :data:`FILMS`, and let a visitor's browser keep it.

        One at a time is made; what stands in its way is said on the page.
        """
        if self._film is None or not self._filming.acquire(blocking=False):
            return
        name, label = self.chosen, self._film_button.label
        try:
            self._film_button.disabled = True
            client.send_file_download(f"{name}.{kind}", self._film(self.content, name, kind, self._filmed))
        except InputError as error:
            client.add_notification("No film", str(error), color="red")
        finally:
            if not self._closed.is_set():  # which a page that was left is, too
                self._film_button.label, self._film_button.disabled = label, False
            self._filming.release()

    def _filmed(self, share: float) -> None:
        """Show how much of a film is made, unless the page is closed."""
        if self._closed.is_set():
            raise InputError("film was not made; valid: with the page open")
        self._film_button.label = f"Film: {100.0 * share:.0f} %"

    # --- what stands still ---------------------------------------------------------------

    def _build_scene(self) -> None:
        self._add_scene(self.content.scene)
        for name, motion in self.content.motions.items():
            path = motion.com[:: max(1, len(motion.com) // MOST_PLACES)]
            self._draw_lines(f"com/{name}", np.stack([path[:-1], path[1:]], axis=1), COLOURS[name], 3.0)
        self._draw_contacts()
        path = self.motion.com
        look_at(self.server, path.mean(axis=0), float(np.linalg.norm(np.ptp(path, axis=0))))

    def _draw_contacts(self) -> None:
        """Outline of every sole of the schedule."""
        schedule = self.content.schedule
        for number, phase in enumerate([] if schedule is None else schedule.sequence):
            for contact in phase.stance:
                corners, name = contact.points_in_world + 0.002 * contact.normal, contact.effector
                if len(corners) >= 3:
                    edges = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
                    self._draw_lines(f"contacts/{number}_{name}", edges, side_colour(name), 2.0)

    # --- what moves ----------------------------------------------------------------------

    def _build_body(self) -> None:
        scene = self.server.scene
        self._shapes = self._add_body(self._body)  # the centre of mass and its path are inside
        self._second = self._add_body(self._body, 0.45, "beside")
        self._aside = _across(self.motion.com)
        places = ("shown", "beside")
        self._names = [
            scene.add_label(f"{self.root}/names/{of}", of, anchor="bottom-center") for of in places
        ]
        self._com = scene.add_icosphere(f"{self.root}/com/now", radius=0.03, color=(34, 34, 34))
        names = dict.fromkeys(name for item in self.content.motions.values() for name in item.contact_names)
        self._arrows = {name: self._add_arrow(f"forces/{name}", COLOURS["force"]) for name in names}

    def _sample(self, motion: Motion) -> int:
        """Sample of a motion at the instant shown."""
        return int(np.searchsorted(motion.time, self.time).clip(0, len(motion.time) - 1))

    def _paint(self, motion: Motion, index: int) -> None:
        if self._painting == TORQUE:
            self._shapes.paint_shares(self._body.torque_share(motion.tau[index, 6:]))
        elif self._painting == MARGIN and np.isfinite(motion.margin[index]):
            largest = float(np.nanmax(motion.margin, initial=0.0, where=np.isfinite(motion.margin)))
            self._shapes.paint(share_colour(1.0 - float(motion.margin[index]) / max(largest, 1e-9)))
        elif self._painting == MARGIN:
            self._shapes.paint(None)

    def _place_beside(self) -> None:
        together = self.beside != NOTHING
        self._second.show(together)
        for label in self._names:
            label.visible = together
        if not together:
            return
        motion = self.content.motions[self.beside]
        q = np.array(motion.q[self._sample(motion)])
        q[:2] += self.apart * self._aside
        self._second.place(q)
        bodies = (self.chosen, self._shapes), (self.beside, self._second)
        for label, (name, shapes) in zip(self._names, bodies, strict=True):
            label.text, label.position = name, shapes.top()

    def _place_forces(self, motion: Motion, index: int) -> None:
        for number, name in enumerate(motion.contact_names):
            force = motion.contact_force[index, number, :3]
            drawn = bool(np.linalg.norm(force) >= SMALLEST_FORCE) and self._forces.value
            if drawn and name in self._feet:
                start = self._feet[name][index]
            elif drawn:
                start = self._shapes.data.oMf[self._body.effector_frame(name)].translation
            if drawn:
                self._arrows[name].points = np.array([[start, start + METRES_PER_NEWTON * force]])
            self._arrows[name].visible = drawn

    def _place_legs(self, motion: Motion, index: int) -> None:
        """Draw the massless legs of a point mass as lines, those in contact thicker."""
        for name, places in self._feet.items():
            on = bool(motion.support[index, motion.contact_names.index(name)])
            leg = np.array([[motion.com[index], places[index]]])
            self._draw_lines(f"legs/{name}", leg, side_colour(name), 6.0 if on else 2.0)

    # --- controls ------------------------------------------------------------------------

    def _build_controls(self) -> None:
        gui = self.server.gui
        last = max(float(motion.time[-1]) for motion in self.content.motions.values())
        with gui.add_folder("Playback"):
            self._slider = gui.add_slider("time [s]", min=0.0, max=last, step=0.001, initial_value=self.time)
            self._button = gui.add_button("Play")
            steps = gui.add_button_group("step [s]", tuple(STEPS))
            speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
            loop = gui.add_checkbox("loop", initial_value=False)
            names = tuple(self.content.motions)
            self._motions_box = gui.add_dropdown("motion", names, initial_value=self.chosen)
            self._beside_box = gui.add_dropdown("beside", (NOTHING, *names), initial_value=self.beside)
            self._apart_slider = gui.add_slider("apart [m]", 0.0, 2.0, 0.1, self.apart)
        with gui.add_folder("View"):
            views = gui.add_button_group("from", tuple(VIEWS))
            follow = gui.add_checkbox("follow the body", initial_value=False)
            self._forces = gui.add_checkbox("contact forces", initial_value=True)
            self._shapes_box = gui.add_checkbox(
                "collision shapes", initial_value=not self._shapes.has_surface
            )
            self._shapes_box.visible = self._shapes.has_surface
            self._painting_box = gui.add_dropdown(
                "colour by", PAINTINGS, initial_value=AS_IT_IS,
                hint="Torque over its limit: grey none, yellow half, red all of it, dark more. Margin: grey "
                "the largest of the motion, yellow half of it, red none, dark less.",
            )  # fmt: skip
            picture = gui.add_button("Save a picture")
            kinds = gui.add_dropdown("film as", FILMS, visible=self._film is not None)
            self._film_button = gui.add_button(
                "Save a film", visible=self._film is not None,
                hint="Of the motion shown, from a camera that goes along; about a second for each picture.",
            )  # fmt: skip
        with gui.add_folder("Now"):
            self._text = gui.add_markdown("")
        self._plot_folder = gui.add_folder("Over time")
        with self._plot_folder:
            self._plotted_box = gui.add_dropdown(
                "of", (MARGIN, *self._body.joint_names), initial_value=MARGIN,
                hint="The margin, or the torque of a joint over its limit.",
            )  # fmt: skip
        self._build_plot()
        # What shows the state is followed unless it was this session that changed it.
        for handle, follows in (
            (self._slider, self.show), (self._motions_box, self.choose), (self._beside_box, self.put_beside),
            (self._apart_slider, self.set_apart), (self._painting_box, self.paint_by),
            (self._plotted_box, self.plot),
        ):  # fmt: skip
            handle.on_update(partial(self._changed, follows))
        self._button.on_click(lambda _: self.pause() if self.playing else self.play())
        steps.on_click(lambda _: self.step(STEPS[steps.value]))
        speed.on_update(lambda _: setattr(self, "speed", float(speed.value)))
        loop.on_update(lambda _: setattr(self, "looping", loop.value))
        views.on_click(lambda _: self.look(views.value))
        follow.on_update(lambda _: setattr(self, "following", follow.value))
        self._forces.on_update(lambda _: self.show(self.time))
        self._shapes_box.on_update(lambda _: self.show_shapes(self._shapes_box.value))
        picture.on_click(lambda event: None if event.client is None else self.send_picture(event.client))
        self._film_button.on_click(
            lambda event: None if event.client is None else self.send_film(event.client, kinds.value)
        )

    @staticmethod
    def _changed(follows: Callable[[Any], object], event: "viser.GuiEvent[Any]") -> None:
        """Take over what a visitor chose."""
        if event.client is not None:
            follows(event.target.value)

    def _quantity(self, motion: Motion) -> FloatArray:
        """(n,) what is plotted of a motion."""
        if self.plotted == MARGIN:
            return motion.margin
        return self._body.torque_share(motion.tau[:, 6:])[:, self._body.joint_index(self.plotted)]

    def _build_plot(self) -> None:
        motions = self.content.motions.values()
        start, end = min(motion.time[0] for motion in motions), max(motion.time[-1] for motion in motions)
        self._plot_time, outside = np.linspace(start, end, PLOT_POINTS), {"left": np.nan, "right": np.nan}
        values = [self._quantity(motion) for motion in motions]
        self._plot_values = [
            np.interp(self._plot_time, of.time, value, **outside)
            for of, value in zip(motions, values, strict=True)
        ]
        known = np.concatenate(values)
        known = known[np.isfinite(known)]
        low, high = float(known.min(initial=0.0)), float(known.max(initial=1.0))
        self._plot_range = (low - 0.05 * (high - low), high + 0.05 * (high - low))
        colours = {name: f"rgb{COLOURS[name]}" for name in self.content.motions}
        series: list[Any] = [uplot.Series(label="time [s]")]
        series += [uplot.Series(label=name, stroke=colour, width=1.5) for name, colour in colours.items()]
        series.append(uplot.Series(label="now", stroke="#555555", width=1.0, points={"show": False}))
        scale = uplot.Scale(auto=False, range=self._plot_range)
        label = f"margin [{self.motion.margin_unit}]" if self.plotted == MARGIN else "torque / limit"
        with self._plot_folder:
            self._plot = self.server.gui.add_uplot(
                self._plot_data(self._plot_time[0]), tuple(series), aspect=1.35,
                scales={"x": uplot.Scale(time=False, auto=True), "y": scale},
                axes=(uplot.Axis(label="time [s]"), uplot.Axis(label=label)),
            )  # fmt: skip

    def _plot_data(self, time: float) -> tuple[FloatArray, ...]:
        """Time, values, and a last row that stands up at the instant shown, as a cursor."""
        low, high = self._plot_range
        cursor = np.full(PLOT_POINTS, low)
        cursor[int(np.argmin(np.abs(self._plot_time - time)))] = high
        return (self._plot_time, *self._plot_values, cursor)

    def _show_numbers(self, motion: Motion, index: int) -> None:
        self._slider.value = round(self.time, 3)
        self._plot.data = self._plot_data(self.time)
        held = zip(motion.contact_names, motion.support[index], strict=True)
        supports = ", ".join(readable(name) for name, on in held if on)
        load = float(motion.contact_force[index, :, 2].sum())
        self._text.content = f"""**{self.time:.3f} s**, {self.chosen}

- margin: **{motion.margin[index]:.1f} {motion.margin_unit}**
- supports: {supports or "none"}
- vertical contact force: {load:.0f} N
- CoM: {", ".join(f"{value:.3f}" for value in motion.com[index])} m"""


def _across(path: FloatArray) -> FloatArray:
    """(2,) unit vector over the ground, to the left of where a (n, 3) path leads."""
    way = path[-1, :2] - path[0, :2]
    length = float(np.linalg.norm(way))
    return np.array([-way[1], way[0]]) / length if length > 0.1 else np.array([0.0, 1.0])
