"""Models of the way that somebody walks between two places, behind one interface, to be compared.

Models of optimal control differ in the weights of one objective (:class:`WalkObjective`) only: that of Truong
(5.6), minimum jerk (2.1), minimum jerk with even speed (2.3) and the unicycle, which never goes aside. Beside
them stand the steering of Fajen and Warren (2.7) and the clothoid words of chapter 3. All are told the same:
where a walk begins and ends, and the velocities there.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from manikin.errors import SolverError
from manikin.numerics.spatial import FloatArray
from manikin.walking.path.path_plan import walking_path
from manikin.walking.path.walking_model import (
    PROSE_ORDER,
    TERMS,
    WalkObjective,
    body_motion,
    runge_kutta,
)
from manikin.walking.path.walking_path import SampledWalk, WalkingTask
from manikin.walking.words import word_path

NEXT_TO_NOTHING = 1e-4
"""Weight of a term that only keeps a problem well posed."""

MINIMUM_JERK = WalkObjective(
    forward=NEXT_TO_NOTHING, lateral=NEXT_TO_NOTHING, angular=NEXT_TO_NOTHING, goal=0.0, jerk=1.0
)
"""Minimum jerk of the place ([Truong2010]_ 2.1, after Flash and Hogan 1985), with a price of time: without
one, the longest walk has the least jerk. The heading turns by itself and means nothing."""

EVEN_MINIMUM_JERK = replace(MINIMUM_JERK, tangential=1.0)
"""With a price of changes of speed ([Truong2010]_ 2.3, after Pham and Hicheur 2009). The print has second
derivatives under the root; the text says variations of the velocity, and first ones are meant."""

UNICYCLE = WalkObjective(forward=4.0, lateral=1e3, angular=1.0, goal=0.0)
"""Time and accelerations of a body that does not go aside; a walk begins and ends along its heading."""


class PathModel(Protocol):
    """Something that predicts how a task is walked."""

    def walk(self, task: WalkingTask) -> SampledWalk:
        """The walk between the places and velocities of a task, whose objective is not looked at.

        Raises:
            SolverError: If there is none.
        """
        ...


@dataclass(frozen=True)
class OptimalModel:
    """The walk that is best under an objective.

    Attributes:
        objective: What is minimised.
        names: Weights that recorded walks may say, the others are part of the model.
        along: Whether the body goes along its heading only: velocities aside at the ends are left out.
        heading: Whether the heading is predicted.
    """

    objective: WalkObjective
    names: tuple[str, ...] = TERMS[1:]
    along: bool = False
    heading: bool = True

    def walk(self, task: WalkingTask) -> SampledWalk:
        """See :class:`PathModel`."""
        start_velocity, goal_velocity = (
            velocity * [1.0, 0.0, 1.0] if self.along else velocity
            for velocity in (task.start_velocity, task.goal_velocity)
        )
        path = walking_path(
            task.start, task.goal, self.objective, start_velocity=start_velocity, goal_velocity=goal_velocity
        )
        if path.failure is not None:
            raise SolverError(f"no optimal path to {task.goal.tolist()}: {path.failure}")
        return path


@dataclass(frozen=True)
class SteeringModel:
    """Goals attract the heading of a walker of constant speed (Fajen and Warren 2003, [Truong2010]_ 2.7).

    ``phi'' = -b phi' - k (phi - psi) (exp(-c1 d) + c2)`` with the direction ``psi`` and the distance ``d`` of
    the goal. The print of the thesis leaves out the factor of the distance, which is that of the source. The
    walk begins along its velocity, or its heading at rest, and ends where it is nearest to the goal. The
    speed is the mean of those at the ends that are not at rest.

    Attributes:
        damping: b [1/s].
        stiffness: k [1/s^2].
        decay: c1 [1/m].
        far: c2 [-].
        speed: Where both ends are at rest [m/s].
    """

    damping: float = 3.25
    stiffness: float = 7.5
    decay: float = 0.4
    far: float = 0.4
    speed: float = 1.0

    def walk(self, task: WalkingTask) -> SampledWalk:
        """See :class:`PathModel`."""
        ends = [np.hypot(*velocity[:2]) for velocity in (task.start_velocity, task.goal_velocity)]
        moving = [speed for speed in ends if speed > 0.0]
        speed = float(np.mean(moving)) if moving else self.speed
        direction, turning = task.start[2], task.start_velocity[2]
        if ends[0] > 0.0:
            direction = direction + np.arctan2(task.start_velocity[1], task.start_velocity[0])
        goal = task.goal[:2]

        def derivative(state: FloatArray, _: FloatArray) -> FloatArray:
            away = goal - state[:2]
            angle = (state[2] - np.arctan2(away[1], away[0]) + np.pi) % (2.0 * np.pi) - np.pi
            pull = self.stiffness * angle * (np.exp(-self.decay * np.hypot(*away)) + self.far)
            heading = np.array([np.cos(state[2]), np.sin(state[2])])
            return np.array([*(speed * heading), state[3], -self.damping * state[3] - pull])

        step = 0.02
        count = int(np.ceil(4.0 * np.hypot(*(goal - task.start[:2])) / (speed * step))) + 50
        begin = np.array([*task.start[:2], direction, turning])
        states = runge_kutta(derivative, begin, np.zeros((2 * count + 1, 1)), step)
        last = max(3, int(np.argmin(np.hypot(*(states[:, :2] - goal).T))))
        return PlacedWalk(np.linspace(0.0, step * last, last + 1), states[: last + 1, :3])


@dataclass(frozen=True)
class WordModel:
    """The clothoid words of chapter 3 at constant speed: ahead along the heading, from and to no curvature.

    Attributes:
        speed: Along the path [m/s].
    """

    speed: float = 1.0

    def walk(self, task: WalkingTask) -> SampledWalk:
        """See :class:`PathModel`."""
        path = word_path(task.goal, task.start)
        places = path.states()[:, :3]
        return PlacedWalk(np.linspace(0.0, path.length / self.speed, len(places)), places)


@dataclass(frozen=True, eq=False)
class PlacedWalk(SampledWalk):
    """A walk through places, with a smooth curve between them.

    Attributes:
        times: (n,) instants from 0 [s].
        places: (n, 3) x, y [m] and continuous heading [rad].
    """

    times: FloatArray
    places: FloatArray
    failure: str | None = None

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Of the walk [s]."""
        return float(self.times[-1])

    def place_at(self, time: ArrayLike) -> FloatArray:
        """See :class:`SampledWalk`."""
        return self._curve(np.asarray(time, dtype=np.float64))

    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """See :class:`SampledWalk`."""
        instants = np.asarray(time, dtype=np.float64)
        return body_motion(*(self._curve(instants, order) for order in range(3)))

    @property
    def _curve(self) -> CubicSpline:
        return CubicSpline(self.times, self.places)


COMPARED: dict[str, PathModel] = {
    "criterion": OptimalModel(PROSE_ORDER),
    "minimum jerk": OptimalModel(MINIMUM_JERK, ("jerk",), heading=False),
    "minimum jerk, even speed": OptimalModel(EVEN_MINIMUM_JERK, ("jerk", "tangential"), heading=False),
    "unicycle": OptimalModel(UNICYCLE, ("forward", "angular"), along=True),
    "Fajen and Warren": SteeringModel(),
    "clothoid words": WordModel(),
}
"""Models that are compared with recorded walks, as published; of some, the weights are still to be said."""
