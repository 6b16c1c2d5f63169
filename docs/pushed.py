"""Measure the pushes that a body on its way survives, beside what its margin predicts.

``python docs/pushed.py`` writes ``docs/pushed.json``, of which ``docs/generate.py`` makes the tables, and
``docs/images/pushed.png``; with ``--figure`` the figure alone. It takes some 20 minutes on two idle
cores, and goes on where it was interrupted.
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

from manikin.balance.zmp import predict_impulse
from manikin.body import BodyModel, Configuration
from manikin.contact import ContactSchedule
from manikin.control import ControlSettings, ReturnSettings
from manikin.motion import Motion
from manikin.motion.file import read_motions
from manikin.pipeline.runner import run
from manikin.pipeline.stages import ExecutionRequirements
from manikin.reports.figures.style import dress, new_figure
from manikin.reports.figures.write_figures import save_figure
from manikin.runtime.files import atomic_path
from manikin.runtime.palette import COLOURS, CYCLE
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
