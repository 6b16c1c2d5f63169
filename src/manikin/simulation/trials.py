"""Trials of a plan: executed in many worlds that differ from the believed one, as far as is stated."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.control import ControlSettings, ForceWish
from manikin.motion import Motion
from manikin.runtime.display import Displayed
from manikin.runtime.parallel import side_by_side
from manikin.scene import Scene
from manikin.scene.scene import FLOOR
from manikin.simulation.execute import execute
from manikin.simulation.execution import ARRIVED
from manikin.simulation.push_force import Push
from manikin.simulation.uncertainty import Uncertainty


@dataclass(frozen=True, eq=False)
class TrialTask:
    """A plan that is to be tried, and how it is controlled.

    Attributes:
        body, scene: As they are believed to be.
        padded: Obstacles that any part of the body may lean on.
        wishes: Forces that effectors in contact should feel.
        pushes: Forces that disturb every execution, beside those of its world.
        hold: Time to stand at the end [s].
    """

    body: BodyModel
    scene: Scene
    motion: Motion
    schedule: ContactSchedule
    settings: ControlSettings
    padded: tuple[str, ...] = ()
    wishes: tuple[ForceWish, ...] = ()
    pushes: tuple[Push, ...] = ()
    hold: float = 1.0

    def bare(self) -> "TrialTask":
        """The same without what was computed from body and scene, for other processes."""
        others = [item for item in self.scene if item.name != FLOOR]
        return replace(self, scene=Scene(others, self.scene.floor_height))


@dataclass(frozen=True)
class Trial:
    """One world and what became of the plan in it.

    Attributes:
        seed: Of the world.
        stood: Whether the body neither fell nor the simulation diverged.
        arrived: Whether it stood and came to the end of the plan, see :data:`.ARRIVED`.
        failure: What failed first; empty where the body arrived.
        failure_time_s: When [s], or None.
    """

    seed: int
    stood: bool
    arrived: bool
    failure: str
    failure_time_s: float | None


@dataclass(frozen=True, repr=False)
class Trials(Displayed):
    """Outcome of all worlds, in their order."""

    worlds: tuple[Trial, ...]

    @property
    def stood_share(self) -> float:
        """Share of the worlds in which the body stood to the end."""
        return sum(trial.stood for trial in self.worlds) / len(self.worlds)

    @property
    def arrived_share(self) -> float:
        """Share of the worlds in which it came to the end of its plan."""
        return sum(trial.arrived for trial in self.worlds) / len(self.worlds)

    def summary(self) -> dict[str, Any]:
        """The "trials" block of the run's summary."""
        failures = Counter(trial.failure for trial in self.worlds if trial.failure)
        return {
            "worlds": len(self.worlds), "stood_share": self.stood_share, "arrived_share": self.arrived_share,
            "first_failures": dict(sorted(failures.items(), key=lambda item: (-item[1], item[0]))),
        }  # fmt: skip


def run_trials(
    task: TrialTask, count: int, *, uncertainty: Uncertainty | None = None, seed: int = 0, workers: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Trials:  # fmt: skip
    """Execute a plan in worlds drawn from an uncertainty.

    Control knows of it how noisy the state is that it is told, and that torques act later than they are asked
    for: by half of the longest delay, until those that it feels tell better.

    Args:
        count: Worlds, at least one.
        uncertainty: How far they are from the believed one; the default uncertainty when omitted.
        seed: Of all worlds; the same seed gives the same worlds and outcomes, whatever the workers.
        workers: Processes.
        progress: Called with the share of the worlds that are done.
    """
    drawn = np.random.default_rng(seed).integers(2**32, size=count).tolist()
    uncertainty = uncertainty or Uncertainty()
    known = replace(task.settings, delay=0.5 * uncertainty.delay_s, noise=uncertainty.noise)
    told = replace(task.bare(), settings=known)
    items = [_World(told, uncertainty, number) for number in drawn]
    found: dict[int, Trial] = {}
    for number, trial in side_by_side(_tried, items, workers, "trials"):
        found[number] = trial
        if progress is not None:
            progress(len(found) / count)
    return Trials(tuple(found[number] for number in range(count)))


@dataclass(frozen=True, eq=False)
class _World:
    """One of the worlds in which a task is tried."""

    task: TrialTask
    uncertainty: Uncertainty
    seed: int


def _tried(world: _World) -> Trial:
    """Outcome of a plan in one world."""
    task = world.task
    truth = world.uncertainty.draw(task.body, task.scene, task.motion, world.seed)
    result = execute(
        task.body, task.scene, task.motion, task.schedule, settings=task.settings, padded=task.padded,
        wishes=task.wishes, pushes=task.pushes, hold=task.hold, truth=truth,
    )  # fmt: skip
    end = float(result.motion.time[-1])
    if result.fell or result.motion.time[-1] < task.motion.time[-1]:
        time = result.failure_time_s or end
        what = "fell" if result.fell else "the simulation diverged"
        schedule = result.schedule or task.schedule
        phase = int(schedule.phase_at(min(time, float(schedule.instants[-1]))))
        held = ", ".join(schedule.sequence[phase].stance.effectors)
        return Trial(world.seed, False, False, f"{what} in phase {phase} on {held}", time)
    off, moved = (result.final_com_error_m, result.final_foot_error_m), result.moved_m
    missed = _missed(("centre of mass", off[0] + moved), ("effector", off[1] + moved))
    return Trial(world.seed, True, not missed, missed, end if missed else None)


def _missed(*errors: tuple[str, float]) -> str:
    """What is away from its plan at the end; empty where nothing is."""
    far = [name for name, error in errors if not error <= ARRIVED]
    return f"{' and '.join(far)} away from the plan at the end" if far else ""
