"""Execute walks of several speeds and directions in the physics engine: writes ``executed-walks.md``.

Run ``python docs/executed_walks.py``: some twenty minutes on one core. With names of walks, such as
``"ahead 0.8"``, it prints their rows alone.
"""

import sys
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from manikin.body import human
from manikin.control import ControlSettings, ReturnSettings, ShiftSettings
from manikin.scenarios import load_scenario
from manikin.scene import Scene
from manikin.simulation import Execution, execute
from manikin.simulation.trials import TrialTask, run_trials
from manikin.simulation.uncertainty import Uncertainty
from manikin.walking import SteppedPath, step_along
from manikin.walking.footprints import Footprint
from manikin.walking.gait.balanced_walk import balanced_walk
from manikin.walking.path.steady_walk import SteadyWalk

PAGE = Path(__file__).with_name("executed-walks.md")
RAMP = 0.8
"""Acceleration, as the speed over the time in which it is reached [m/s^2]; that time is 0.8 s at least."""
HOLD = 1.0
"""Time at the full speed [s]."""
WORLDS, SEED = 20, 31
"""Number of other worlds, and the seed that they are drawn with."""
LOADED = 0.02
"""A foot is on the floor from this force on [body weights]."""

WALKS = {
    "ahead 0.8 m/s": (0.8, 0.0, 0.0),
    "ahead 1.2 m/s": (1.2, 0.0, 0.0),
    "ahead 1.5 m/s": (1.5, 0.0, 0.0),
    "circle of 2 m, 1.0 m/s": (1.0, 0.0, 0.5),
    "aside 0.4 m/s": (0.0, 0.4, 0.0),
    "back 0.5 m/s": (-0.5, 0.0, 0.0),
    "turning on the spot 46 deg/s": (0.0, 0.0, 0.8),
}
"""Velocity forward, left [m/s], angular [rad/s]."""

TEXT = """# Executed walks

From standing to standing, the velocity held for {hold:g} s in between, by a man of 1.75 m and 79 kg in the
physics engine ([execution](execution.md)), undisturbed. By `docs/executed_walks.py`.

*Margin* is the share of the control steps in which the contacts that touch have a positive margin, *slide*
the farthest that a flat foot moves over the floor, *peaks* are the two largest vertical forces of a foot in a
step at full speed, with the trough between them. *Torque* is the largest share of a joint's strength that the
plan asks for. *Other worlds* is the share of {worlds} worlds, drawn with seed {seed} from the
[uncertainties](execution.md#trials), in which the body does not fall and arrives; there control returns to
its plan and shifts footprints.

| walk | end | margin | slide [mm] | penetration [mm] | foot off [mm] | torque | other worlds |
|---|---|---|---|---|---|---|---|
"""
FAST = """
A walk that asks for more than the strength of a joint, as that at 1.5 m/s in each step, is followed only
nearly; the faster it is, the fewer worlds it stands.
"""
STEPS = """
Steps at full speed, beside those of people: step length and cadence of 43 people ($0.559\\,v^{0.523}$ m,
$107.3\\,v^{0.477}$ per minute; Fukuchi et al. 2018); forces of one person at 1.43 m/s: 1.09, 0.65,
1.10 (Winter 2009).

| walk | step [m] | people | steps/min | people | both feet | peaks and trough [body weights] |
|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Walked:
    """An executed walk."""

    velocity: tuple[float, float, float]
    path: SteadyWalk
    stepped: SteppedPath
    execution: Execution
    torque_share: float
    arrived: float

    def landed(self) -> list[Footprint]:
        """Footprints on which feet land at full speed, in order."""
        full = np.array([self.path.ramp - 0.1, self.path.ramp + self.path.hold + 0.1])
        begin, end = np.interp(full, self.stepped.clock[:, 1], self.stepped.clock[:, 0])
        steps = sorted(self.stepped.footprints.steps, key=lambda step: step.lands)
        return [step for step in steps if begin <= step.lands <= end]


def walked(velocity: tuple[float, float, float], scene: Scene) -> Walked:
    """Walk with a velocity from rest to rest."""
    body, fastest = human(), float(np.abs(velocity).max())
    path = SteadyWalk(np.array(velocity), HOLD, max(0.8, fastest / RAMP))
    stepped = step_along(path)
    walk, settings = balanced_walk(body, stepped), ControlSettings(watch_toes=True)
    found = execute(body, scene, walk.motion, walk.schedule, settings=settings, hold=0.3)
    trials = run_trials(
        TrialTask(body, scene, walk.motion, walk.schedule, replace(
            settings, returning=ReturnSettings(), stepping=ShiftSettings())),
        WORLDS, uncertainty=Uncertainty.of(body), seed=SEED, workers=1,
    )  # fmt: skip
    return Walked(velocity, path, stepped, found, float(walk.torque_share.max()), trials.arrived_share)


def outcome(name: str, walk: Walked) -> str:
    """Row of the first table."""
    run = walk.execution
    end = run.failure or "stands"
    share = 100.0 * float(np.mean(run.motion.margin > 0.0))
    slide, deep, off = (1e3 * x for x in (run.max_slip_m, run.max_penetration_m, run.max_foot_error_m))
    told = f"{slide:.1f} | {deep:.1f} | {off:.1f} | {walk.torque_share:.2f} | {100.0 * walk.arrived:.0f} %"
    return f"| {name} | {end} | {share:.1f} % | {told} |"


def steps(name: str, walk: Walked) -> str | None:
    """Row of the second table, of a walk straight ahead."""
    speed, motion = walk.velocity[0], walk.execution.motion
    if speed <= 0.0 or walk.velocity[1] or walk.execution.failure:
        return None
    landed = walk.landed()
    times = np.array([step.lands for step in landed])
    ways = [np.hypot(*(b.position - a.position)[:2]) for a, b in pairwise(landed)]
    force = motion.contact_force[..., 2] / (human().mass * 9.81)
    cycle = (motion.time >= times[0]) & (motion.time < times[-1])
    both = float(np.mean((force[cycle] > LOADED).all(axis=1)))
    peaks = np.array([loads(force, motion.time, step) for step in landed[:-1]])
    first, trough, second = np.median(peaks, axis=0) if len(peaks) else np.full(3, np.nan)
    cadence = 60.0 / float(np.mean(np.diff(times)))
    lengths = f"{np.mean(ways):.2f} | {0.559 * speed**0.523:.2f}"
    rates, forces = f"{cadence:.0f} | {107.3 * speed**0.477:.0f}", f"{first:.2f}, {trough:.2f}, {second:.2f}"
    return f"| {name} | {lengths} | {rates} | {100.0 * both:.0f} % | {forces} |"


def loads(force: np.ndarray, time: np.ndarray, step: Footprint) -> list[float]:
    """Means of 40 ms: largest force early in a support, least in its middle, largest late [body weights]."""
    column = 0 if step.effector == "left_foot" else 1
    smooth = np.convolve(force[:, column], np.full(8, 1.0 / 8.0), mode="same")
    share = (time - step.lands) / (step.leaves - step.lands)
    early, middle, late = ((share > a) & (share < b) for a, b in ((0.05, 0.45), (0.3, 0.7), (0.55, 0.95)))
    return [float(smooth[early].max()), float(smooth[middle].min()), float(smooth[late].max())]


def main() -> None:
    """Execute all walks, or those whose names begin with an argument."""
    scene, asked = load_scenario("stroll").build_scene(), tuple(sys.argv[1:])
    first, second = [], []
    for name, velocity in WALKS.items():
        if asked and not name.startswith(asked):
            continue
        walk = walked(velocity, scene)
        first.append(outcome(name, walk))
        second.append(steps(name, walk))
        print(first[-1], second[-1] or "", sep="\n", flush=True)
    if not asked:
        rows = [row for row in second if row is not None]
        text = TEXT.format(hold=HOLD, worlds=WORLDS, seed=SEED)
        page = text + "\n".join(first) + "\n" + FAST + STEPS + "\n".join(rows) + "\n"
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
