"""Measure the pushes that a body on its way survives, beside what its margin predicts.

``python docs/pushed.py`` writes ``docs/pushed.json``, of which ``docs/generate.py`` makes the tables, and
``docs/images/pushed.png``; with ``--figure`` the figure alone. It takes some 20 minutes on two idle
cores, and goes on where it was interrupted.

A push changes the momentum of the body by its impulse `J`. With the frequency ``w = sqrt(g / h)`` of a linear
inverted pendulum of height `h`, the capture point ``c = s + s' / w`` jumps by ``J / (m w)``, and its
deviation ``e`` from the plan then obeys

    ``e' = w (e - d)``

where ``d`` is how far the ZMP goes beyond its planned place. It can go no farther than to the edge of the
support polygon, which is ``D`` away in the direction of the push. Hence, with less and less known:

``plan``
    ``e`` stays bounded if and only if it begins below ``integral_0^inf w exp(-w t) D(t) dt``, the mean of the
    room that the plan leaves from now on, what comes soon counting most. This sees the next lift-off and the
    next landing.
``capture``
    A plan that could be stopped at once leaves the room between the capture point and the edge:
    ``e < D_c``. Negative where the capture point is already outside, as in the middle of a stride.
``margin``
    All that is known is the margin `r` of the wrench polytope [N.m], the least over all directions: a moment
    `r` more moves the ZMP by about ``r / (m g)``, and ``J = m w r / (m g) = r w / g``.

In each case ``J = m w e``. Two corrections hold for all: a force that lasts `T` does its first part of the
work early, and its last part, which is seen by a ZMP that has long moved, counts with ``exp(-w T)``, so that
``J`` may be ``w T / (1 - exp(-w T))`` larger; and a push at the height `z` over the ground instead of `h`
also turns the body, and stopping the turning costs room, so that ``J`` is ``h / z`` of it.

Left out are: arms and trunk that turn, and so take more than the ZMP can; a plan that waits; friction,
joint strength, what a swinging arm or a bowing head meets; a foot that lands elsewhere; and the part of the
polygon that is lost when the body also moves sideways.
"""

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from manikin.balance.zmp import SupportPlane, contact_wrench, projection_plane
from manikin.body import BodyModel, Configuration
from manikin.contact import ContactSchedule
from manikin.control import ControlSettings, ReturnSettings
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.file import read_motions
from manikin.numerics.spatial import GRAVITY, FloatArray, finite_number, frozen_array
from manikin.pipeline.runner import run
from manikin.pipeline.stages import ExecutionRequirements
from manikin.reports.figures import save_figure
from manikin.reports.figures.style import dress, new_figure
from manikin.runtime.display import COLOURS, CYCLE
from manikin.runtime.files import atomic_path
from manikin.runtime.parallel import side_by_side
from manikin.scene import Scene
from manikin.simulation import Push, execute, push_on_the_way

DOCS = Path(__file__).parent
RESULTS = DOCS / "pushed.json"
FIGURE = DOCS / "images" / "pushed.png"
TIMES = {"platform": (0.2, 0.65, 1.65, 2.7), "walk": (0.1, 0.55, 0.95)}
"""When the pushes begin [s]: standing, in double and in single supports."""
DIRECTIONS = tuple(range(0, 360, 45))
DURATION = 0.1
RESOLUTION = 2.0
"""Of the bisection [N.s]."""
SHARES = (0.25, 0.5, 0.75)
"""Of what was found that are tried as well."""
LARGEST = 100.0
"""No more is tried [N.s]."""
PREDICTIONS = {
    "best": "going on, or standing still",
    "plan": "going on: room of the plan",
    "capture": "standing still: capture point",
    "margin": "wrench margin",
}
"""What is drawn; ``best`` is the larger of the next two where the plan can wait, and else ``plan``."""


HORIZON = 5.0
"""Room this many time constants ``1 / w`` ahead counts; of what comes later, less than 1 % would."""

STEP = 0.01
"""Steps in which the room ahead is looked at [s]."""


@dataclass(frozen=True)
class ImpulsePrediction:
    """Impulses that a body can take in one direction at one time [N.s]; the module says what they mean.

    Attributes:
        plan: From the room that the plan leaves from then on.
        capture: From the capture point's distance to the edge of the support polygon.
        margin: From the wrench margin, the same in all directions.
        frequency: ``w`` [1/s].
    """

    plan: float
    capture: float
    margin: float
    frequency: float


def predict_impulse(
    motion: Motion,
    schedule: ContactSchedule,
    mass: float,
    time: float,
    direction: ArrayLike,
    *,
    duration: float = 0.0,
    height: float | None = None,
) -> ImpulsePrediction:
    """Predict the impulse that a body can take at a time of its motion, as a point mass would.

    Args:
        motion: What it does, with contact forces.
        schedule: Its contacts in time.
        mass: [kg].
        time: When the push begins [s].
        direction: (2,) level direction of the push; its length does not matter.
        duration: Of the push [s].
        height: In the world at which it acts [m]; that of the centre of mass when omitted.

    Raises:
        InputError: If a number is not usable, or nothing carries the body at that time.
    """
    finite_number(mass, "mass [kg]", above=0.0)
    finite_number(duration, "push duration [s]", at_least=0.0)
    finite_number(time, "push time [s]", at_least=float(motion.time[0]), at_most=float(motion.time[-1]))
    way = frozen_array(direction, "push direction", (2,))
    if not np.any(way):
        raise InputError("push direction is [0, 0]; valid: a direction")
    way = way / np.linalg.norm(way)
    planes = tuple(projection_plane(phase.stance) for phase in schedule.sequence)
    plane = planes[int(schedule.phase_at(time))]
    if plane is None:
        raise InputError(f"nothing carries the body at {time:g} s; valid: a time with a foot on the ground")

    com = np.array([np.interp(time, motion.time, column) for column in motion.com.T])
    ground = float(plane.origin[2])
    frequency = float(np.sqrt(GRAVITY / (com[2] - ground)))
    velocity = np.gradient(motion.com, motion.time, axis=0)
    speed = np.array([np.interp(time, motion.time, column) for column in velocity.T])
    captured = _room(plane, com[:2] + speed[:2] / frequency, way)
    ahead = _discounted_room(motion, schedule, planes, time, way, frequency)
    margin = float(np.interp(time, motion.time, motion.margin))

    lasting = frequency * duration
    gain = 1.0 if lasting == 0.0 else lasting / (1.0 - np.exp(-lasting))
    if height is not None:
        gain *= (com[2] - ground) / finite_number(height - ground, "height of the push [m]", above=0.0)
    impulse = float(gain) * mass * frequency
    return ImpulsePrediction(
        plan=impulse * ahead,
        capture=impulse * captured,
        margin=impulse * margin / (mass * GRAVITY),
        frequency=frequency,
    )


def _discounted_room(
    motion: Motion,
    schedule: ContactSchedule,
    planes: tuple[SupportPlane | None, ...],
    time: float,
    way: FloatArray,
    frequency: float,
) -> float:
    """``integral w exp(-w t) D(t) dt`` from ``time`` on [m]; after its end the motion stands still."""
    since = np.arange(0.0, HORIZON / frequency, STEP)
    rows = np.searchsorted(motion.time, np.minimum(time + since, motion.time[-1]))
    used, back = np.unique(rows, return_inverse=True)
    wrench = contact_wrench(motion, schedule)[used]
    phases = schedule.phase_at(motion.time[used])
    room = np.zeros(len(used))
    for number, (phase, row) in enumerate(zip(phases, wrench, strict=True)):
        plane = planes[int(phase)]
        if plane is not None and plane.carries(row[None])[0]:
            room[number] = _room(plane, plane.in_world(plane.zero_moment_point(row[None]))[0, :2], way)
    weight = np.exp(-frequency * since)
    return float(weight @ room[back] / weight.sum())


def _room(plane: SupportPlane, point: FloatArray, way: FloatArray) -> float:
    """How far a point (2,) of the ground is from the edge of the polygon along a direction [m].

    Seen from above. Negative outside: the way back to where the direction's edge is.
    """
    corners = plane.in_world(plane.polygon)[:, :2]
    if len(corners) < 3:
        return float(max((corners - point) @ way, default=0.0)) if len(corners) else 0.0
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((along[:, 1], -along[:, 0]))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    facing = normals @ way
    ahead = facing > 1e-9
    offsets = np.sum(normals * (corners - point), axis=1)
    return float(np.min(offsets[ahead] / facing[ahead]))


class Job(NamedTuple):
    """One bisection: where, when, in which direction, and whether with the return to the plan or without."""

    scenario: str
    time_s: float
    direction_deg: int
    returning: bool


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned run."""

    body: BodyModel
    scene: Scene
    motion: Motion
    schedule: ContactSchedule

    @classmethod
    def of(cls, path: Path) -> "Plan":
        """Read the plan of a run directory."""
        file = read_motions(path)
        if file.planned is None or file.body is None or file.scene is None or file.schedule is None:
            raise SystemExit(f"{path} holds no plan")
        return cls(file.body, file.scene, file.planned, file.schedule)


def survives(plan: Plan, push: Push, returning: bool) -> bool:
    """Whether the body comes back on its plan and to its goal."""
    settings = ControlSettings(returning=ReturnSettings() if returning else None)
    result = execute(plan.body, plan.scene, plan.motion, plan.schedule, pushes=[push], settings=settings)
    return result.succeeded and ExecutionRequirements().table(result).held


def largest_impulse(plan: Plan, job: Job, guess: float) -> float:
    """Impulse up to which pushes are survived [N.s], by bisection from a guess.

    Not every push weaker than one that is survived is survived itself. Those at shares of what was found are
    tried, too, and the first of them that is not takes its place.
    """

    def good(impulse: float) -> bool:
        force = impulse / DURATION
        push = push_on_the_way(plan.motion, force, job.direction_deg, job.time_s, DURATION)
        return survives(plan, push, job.returning)

    return without_gaps(good, between(good, *bracket(good, min(max(guess, RESOLUTION), LARGEST))))


def bracket(good: Callable[[float], bool], guess: float) -> tuple[float, float]:
    """One impulse that is survived, or too small to tell, and one that is not or is the largest [N.s]."""
    low = high = guess
    if good(guess):
        while (low := high) < LARGEST and good(high := 1.5 * low):
            pass
        return low, high
    while (high := low) > RESOLUTION and not good(low := high / 1.5):
        pass
    return low, high


def between(good: Callable[[float], bool], low: float, high: float) -> float:
    """Bisect between an impulse that is survived and one that is not [N.s]."""
    while high - low > RESOLUTION:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return low


def without_gaps(good: Callable[[float], bool], found: float) -> float:
    """The same, or less where a weaker push is not survived [N.s]."""
    last = 0.0
    for share in SHARES:
        if not good(share * found):
            return between(good, last, share * found)
        last = share * found
    return found


def measured(folder: str, job: Job) -> dict[str, Any]:
    """Largest impulse of one job, and what was predicted."""
    plan = Plan.of(Path(folder) / job.scenario)
    motion = plan.motion
    push = push_on_the_way(motion, 1.0, job.direction_deg, job.time_s, DURATION)
    at = motion.q[min(np.searchsorted(motion.time, job.time_s), len(motion.q) - 1)]
    height = Configuration(plan.body, at).point(push.segment, plan.body.segment(push.segment).com)[2]
    velocity = np.gradient(motion.com[:, :2], motion.time, axis=0)
    speed = float(np.linalg.norm([np.interp(job.time_s, motion.time, column) for column in velocity.T]))
    found = predict_impulse(
        motion, plan.schedule, plan.body.mass, job.time_s, push.force[:2],
        duration=DURATION, height=float(height),
    )  # fmt: skip
    feet, brisk = len(plan.schedule.stance_at(job.time_s)), ReturnSettings().brisk
    values = {key: round(getattr(found, key), 1) for key in ("plan", "capture", "margin")}
    values["best"] = max(values["plan"], values["capture"]) if feet == 2 and speed < brisk else values["plan"]
    values["measured_Ns"] = round(largest_impulse(plan, job, found.plan), 1)
    return {**job._asdict(), "feet": feet, **values}


def jobs() -> list[Job]:
    """All directions with the return, and the four main ones also without; the main ones come first."""
    main, oblique = DIRECTIONS[::2], DIRECTIONS[1::2]
    turns = [(main, True), (main, False), (oblique, True)]
    return [
        Job(name, time, direction, returning)
        for directions, returning in turns
        for name, times in TIMES.items()
        for time in times
        for direction in directions
    ]


def measure() -> None:
    """Measure what is missing; everything is kept as soon as it is known."""
    found = json.loads(RESULTS.read_text()) if RESULTS.exists() else []
    done = {Job(*(item[name] for name in Job._fields)) for item in found}
    wanted = [job for job in jobs() if job not in done]
    with tempfile.TemporaryDirectory() as folder:
        for name in sorted({job.scenario for job in wanted}):
            run(name, out=Path(folder) / name)
        for _, answer in side_by_side(partial(measured, folder), wanted, 2, "pushes"):
            found.append(answer)
            found.sort(key=lambda item: tuple(item[name] for name in Job._fields))
            with atomic_path(RESULTS) as path:
                path.write_text(json.dumps(found, indent=1) + "\n")


def draw() -> None:
    """Predicted against measured, one panel per prediction."""
    found = json.loads(RESULTS.read_text())
    figure = new_figure(13.0, 3.9, "Largest impulse that a body on its way can take: predicted and measured")
    panels = figure.subplots(1, len(PREDICTIONS), sharex=True, sharey=True)
    for axes, (key, words) in zip(panels, PREDICTIONS.items(), strict=True):
        _panel(axes, found, key)
        dress(axes, "measured [N.s]" if key == "best" else "", "predicted [N.s]", words)
    panels[-1].legend(fontsize=8, loc="lower right", framealpha=0.9, edgecolor="none")
    save_figure(figure, FIGURE)


def _panel(axes: Axes, found: list[dict[str, Any]], key: str) -> None:
    top = max(push["measured_Ns"] for push in found) + 5.0
    axes.plot([0, top], [0, top], color=COLOURS["ink"], linewidth=0.9)
    axes.axvline(0.0, color=COLOURS["soft"], linewidth=0.6)
    groups = [(name, feet) for name in TIMES for feet in (2, 1)]
    for number, (name, feet) in enumerate(groups):
        pushes = [p for p in found if (p["scenario"], p["feet"], p["returning"]) == (name, feet, True)]
        axes.plot(
            [p[key] for p in pushes], [p["measured_Ns"] for p in pushes], linestyle="none",
            marker="o" if feet == 2 else "^", markersize=4.5, color=CYCLE[number], alpha=0.8,
            label=f"{name}, {'both feet' if feet == 2 else 'one foot'}",
        )  # fmt: skip
    axes.set_xlim(-35.0, top)
    axes.set_ylim(0.0, top)


if __name__ == "__main__":
    if "--figure" not in sys.argv:
        measure()
    draw()
