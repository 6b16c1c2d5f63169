"""The weights of the walking criterion that explain several recorded walks best ([Truong2010]_ 5.5.1).

The thesis solves this as a bilevel problem without saying how ([Truong2010]_ 5.2, 5.5.1). Here the outer
level is a least-squares fit over the logarithms of the weights, and the inner one the programme of the paths.
How an optimal path moves with a weight follows from the implicit function theorem on its stationarity,
``dz/da_i = - (d^2 J / dz^2)^-1 dJ_i/dz``, so the outer slopes are exact and cost one linear system.

A recorded walk is seen as the criterion sees it: the places and headings of a body without the sway of its
steps (:func:`recorded_walk`). ``docs/inverse.py`` applies both to recordings.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.stats import t as student

from manikin.errors import InputError, SolverError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.numerics.spline import BSpline, basis_matrix
from manikin.walking.path.path_cost import DEGREE, path_cost, path_knots
from manikin.walking.path.path_program import Guess, ends_of, solve, structure_of
from manikin.walking.path.walk_obstacles import Walker
from manikin.walking.path.walking_model import TERMS, WalkObjective, to_body, to_world
from manikin.walking.path.walking_path import SampledWalk, WalkingPath, WalkingTask
from manikin.walking.segmentation import ShoulderPaths

SWAY = 0.5
"""Frequency above which a trunk sways with its steps and strides, which the model does not [Hz]."""

WALKING = 0.1
"""Speed of the shoulders' middle from which somebody walks [m/s]."""


@dataclass(frozen=True, eq=False)
class RecordedWalk:
    """A walk, recorded, or a part of one: from rest to rest unless velocities at its ends are given.

    Attributes:
        time: (n,) increasing, the walk starts at 0 [s].
        place: (n, 3) x, y [m] and continuous heading [rad].
        start: (3,) the place started from; if not given, the first recorded one.
        goal: (3,) the place asked for, its heading within half a turn of the last one; if not given, that.
        start_velocity: (3,) forward, left [m/s], angular [rad/s] at the start; if not given, at rest.
        goal_velocity: (3,) the same at the goal.
    """

    time: FloatArray
    place: FloatArray
    start: FloatArray
    goal: FloatArray
    start_velocity: FloatArray
    goal_velocity: FloatArray

    def __init__(
        self,
        time: ArrayLike,
        place: ArrayLike,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        start_velocity: ArrayLike = (0.0, 0.0, 0.0),
        goal_velocity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        instants = frozen_array(time, "recorded walk time [s]", (None,))
        places = frozen_array(place, "recorded walk place [m, m, rad]", (len(instants), 3))
        if len(instants) < 10 or np.any(np.diff(instants) <= 0) or instants[0] < 0.0:
            raise InputError(
                f"recorded walk has {len(instants)} instants from {instants.min(initial=np.inf):g} s; "
                "valid: at least 10, increasing, none before 0 s"
            )
        ends = []
        for name, value, default in (("start", start, places[0]), ("goal", goal, places[-1])):
            end = np.array(frozen_array(default if value is None else value, f"recorded walk {name}", (3,)))
            end[2] += 2.0 * np.pi * np.round((default[2] - end[2]) / (2.0 * np.pi))
            ends.append(frozen_array(end, f"recorded walk {name}"))
        if np.hypot(*(ends[1] - ends[0])[:2]) < 0.1:
            raise InputError("recorded walk ends where it starts; valid: at least 0.1 m away")
        for key, value in zip(("time", "place", "start", "goal"), (instants, places, *ends), strict=True):
            object.__setattr__(self, key, value)
        for name, value in (("start_velocity", start_velocity), ("goal_velocity", goal_velocity)):
            object.__setattr__(self, name, frozen_array(value, f"recorded walk {name}", (3,)))


def recorded_walk(
    paths: ShoulderPaths, window: tuple[int, int] | None = None, sway: float | None = SWAY
) -> RecordedWalk:
    """The middle of the shoulders and the heading of a walk, with the velocities at its ends.

    Low-passed twice: as the thesis does (:meth:`ShoulderPaths.low_passed`), and below ``sway``, which takes
    the steps out. Standing before and after is cut off. Velocities at the ends are those without sway.

    Args:
        paths: Shoulders of a whole recording.
        window: First frame and the one after the last; None for all.
        sway: Frequency above which changes are taken for steps [Hz]; None to keep the steps, at the ends too
            where place and velocities are still those without.

    Raises:
        InputError: If nobody walks in the window, or the frequency is not below half the rate.
    """
    cutoff = finite_number(SWAY if sway is None else sway, "sway [Hz]", above=0.0)
    if cutoff >= 0.5 * paths.rate:
        raise InputError(f"sway is {cutoff:g} Hz; valid: below half the rate, {0.5 * paths.rate:g} Hz")
    kept = paths.low_passed(0.5)
    calm = kept.low_passed(2.0 * cutoff / paths.rate)
    place = _place(calm)
    rate = np.asarray(np.gradient(place, 1.0 / paths.rate, axis=0))
    first, stop = (0, len(paths)) if window is None else window
    moving = first + np.flatnonzero(np.hypot(*rate[first:stop, :2].T) > WALKING)
    if moving.size < 10:
        raise InputError(
            f"nobody walks in frames {first} to {stop}; valid: ten frames faster than {WALKING} m/s"
        )
    walked = slice(int(moving[0]), int(moving[-1]) + 1)
    velocity = to_body(place[:, 2], rate)[walked]
    shown = place if sway is not None else _place(kept)
    shown = shown[walked] + 0.0
    shown[:, 2] += 2.0 * np.pi * np.round((place[walked.start, 2] - shown[0, 2]) / (2.0 * np.pi))
    time = np.arange(walked.stop - walked.start) / paths.rate
    ends = place[walked][[0, -1]]
    return RecordedWalk(time, shown, ends[0], ends[1], velocity[0], velocity[-1])


def _place(paths: ShoulderPaths) -> FloatArray:
    return np.column_stack([paths.middle, paths.heading])


IDENTIFIED = TERMS[1:]
"""The weights of (5.6) that can be identified; only their ratios to that of time matter to a path."""

FIRST_GUESS = WalkObjective(forward=1.0, lateral=1.0, angular=1.0, goal=1.0)
"""Where the fit starts: all weights equal."""

HEADING_LENGTH = 0.5
"""Error of position that weighs as much as an error of heading of one radian [m]."""

_RANGE = (1e-3, 1e3)
"""Of the weights that are tried."""

_WIDEST = 20.0
"""Half width of an interval of a logarithm that means nothing is known."""

_SHARES = 101

_EFFECT = 1e-6
"""Change of a place [m] for a change of a weight by its own size below which the weight has no effect."""


@dataclass(frozen=True, eq=False)
class IdentifiedObjective:
    """The cost that explains recorded walks best.

    Attributes:
        objective: With the identified weights; that of time is 1.
        low: (k,) lower ends of the confidence intervals of the identified weights.
        high: (k,) upper ends.
        confidence: Of the intervals.
        correlation: (k, k) of the logarithms of the weights.
        position_errors: (walks,) mean distance between recorded and optimal places at the same instants [m].
        share_errors: (walks,) mean distance between them at equal shares of their durations [m].
        heading_errors: (walks,) root mean square at the same instants [rad].
        paths: Optimal path of each walk.
        evaluations: Of the outer level.
    """

    objective: WalkObjective
    low: FloatArray
    high: FloatArray
    confidence: float
    correlation: FloatArray
    position_errors: FloatArray
    share_errors: FloatArray
    heading_errors: FloatArray
    paths: tuple[WalkingPath, ...]
    evaluations: int


def identify_objective(
    walks: Sequence[RecordedWalk],
    first: WalkObjective = FIRST_GUESS,
    *,
    names: Sequence[str] = IDENTIFIED,
    heading_length: float = HEADING_LENGTH,
    tolerance: float = 1e-6,
    confidence: float = 0.95,
    independent_samples: bool = True,
) -> IdentifiedObjective:
    """Find the weights under which the optimal paths are nearest to all recorded walks at once.

    Args:
        walks: At least one; a single one leaves some weights vague, which the intervals show.
        first: Where to start; what is not identified is kept. The weight of time is 1.
        names: Weights that are identified, none of them 0 in ``first``.
        heading_length: Error of position that weighs as much as one of heading of one radian [m]; 0 for
            models that predict no heading.
        tolerance: Of the logarithms of the weights, where the fit ends.
        confidence: Of the intervals, between 0 and 1.
        independent_samples: Whether the errors of one walk are independent from sample to sample, as noise
            is. Those of people are not: their intervals are cluster-robust, only the walks are independent
            (Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73
            (1986)). That takes more walks than weights.

    Raises:
        InputError: If there is no walk, or too few, the confidence is not usable, or no walk depends on some
            weight.
        SolverError: If a path cannot be optimised.
    """
    if not walks:
        raise InputError("no recorded walk to identify weights from; valid: at least one")
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence is {confidence!r}; valid: between 0 and 1")
    if not independent_samples and len(walks) <= len(names):
        raise InputError(
            f"{len(walks)} recorded walks for intervals between walks; valid: more than {len(names)}"
        )
    fits = [_Fit(walk, first, names, heading_length) for walk in walks]
    start = np.log(np.clip([getattr(first, name) / first.time for name in names], *_RANGE))

    def residuals(logs: FloatArray) -> FloatArray:
        return np.concatenate([fit.at(_objective(first, logs, names)).residuals for fit in fits])

    def slopes(logs: FloatArray) -> FloatArray:
        return np.vstack([fit.at(_objective(first, logs, names)).slopes for fit in fits])

    _check_effects(slopes(start), names)
    exact: Any = slopes  # the stubs know names of difference rules only
    bounds = tuple(np.log(_RANGE))
    found = least_squares(residuals, start, exact, bounds, xtol=tolerance, ftol=0.01 * tolerance)
    objective = _objective(first, found.x, names)
    matches = [fit.at(objective) for fit in fits]
    covariance, freedom = _covariance(matches, independent_samples)
    error = np.sqrt(np.diag(covariance))
    width = np.minimum(error * student.ppf(0.5 + confidence / 2.0, freedom), _WIDEST)
    return IdentifiedObjective(
        objective=objective,
        low=np.exp(found.x - width),
        high=np.exp(found.x + width),
        confidence=confidence,
        correlation=covariance / np.maximum(np.outer(error, error), 1e-300),
        position_errors=np.array([one.position_error for one in matches]),
        share_errors=share_errors(walks, [one.path for one in matches]),
        heading_errors=np.array([one.heading_error for one in matches]),
        paths=tuple(one.path for one in matches),
        evaluations=int(found.nfev),
    )


@dataclass(frozen=True, eq=False)
class _Match:
    """An optimal path beside a recording: (3 n,) errors [m] and (3 n, k) slopes over the log weights."""

    path: WalkingPath
    residuals: FloatArray
    slopes: FloatArray
    heading_errors: FloatArray

    @property
    def position_error(self) -> float:
        errors = self.residuals.reshape(-1, 3)
        return float(np.hypot(errors[:, 0], errors[:, 1]).mean())

    @property
    def heading_error(self) -> float:
        return float(np.sqrt(np.mean(self.heading_errors**2)))


class _Fit:
    """One recorded walk and its optimal path, which is kept to start the next one from."""

    def __init__(
        self, walk: RecordedWalk, first: WalkObjective, names: Sequence[str] = IDENTIFIED,
        heading_length: float = HEADING_LENGTH,
    ) -> None:  # fmt: skip
        self._walk, self._names = walk, names
        self._scales = np.array([1.0, 1.0, heading_length])
        self._task = task_of(walk, first)
        self._pieces = structure_of(self._task).pieces
        self._guess = _guess_of(walk, self._pieces)
        self._match: _Match | None = None

    def at(self, objective: WalkObjective) -> _Match:
        """The optimal path under an objective."""
        if self._match is None or self._match.path.task.objective != objective:
            self._match = self._solved(objective)
        return self._match

    def _solved(self, objective: WalkObjective) -> _Match:
        task = replace(self._task, objective=objective)
        path = solve(task, self._guess)
        if not path.succeeded:
            raise SolverError(
                f"no optimal path to {task.goal.tolist()} for weights {objective.weights.tolist()}: "
                f"{path.failure}"
            )
        self._guess = Guess("recording", path.spline.control_points, path.duration)
        unknowns = np.append(path.spline.control_points[2:-2].ravel(order="F"), path.duration)
        hessian, terms = path_cost(self._pieces, objective.further).sensitivities(
            unknowns, ends_of(task, task.goal), objective.goal_fade, objective.weights
        )
        chosen = [objective.terms.index(name) for name in self._names]
        moved = -np.linalg.solve(hessian, terms[:, chosen] * objective.weights[chosen])
        errors = self._errors(path)
        slopes = self._place_slopes(path) @ moved
        return _Match(path, (errors * self._scales).ravel(), slopes, errors[:, 2])

    def _errors(self, path: WalkingPath) -> FloatArray:
        time = np.minimum(self._walk.time, path.duration)
        return path.place_at(time) - self._walk.place

    def _place_slopes(self, path: WalkingPath) -> FloatArray:
        """(3 n, unknowns) slopes of the scaled places at the recorded instants over the unknowns."""
        share = np.minimum(self._walk.time / path.duration, 1.0)
        whole = basis_matrix(DEGREE, path.spline.knots, share)
        basis = whole[:, 2:-2]
        running = (self._walk.time < path.duration)[:, None]
        # The last unknown is the duration: a longer walk is at an earlier share of it.
        later = -np.where(running, share[:, None] * path.spline(share, 1), 0.0) / path.duration
        # The control points beside the ends follow from the velocities there, times the duration.
        step = 1.0 / (DEGREE * self._pieces)
        task = path.task
        rates = (
            to_world(task.start[2], task.start_velocity),
            to_world(task.goal[2], task.goal_velocity),
        )
        ends = step * (np.outer(whole[:, 1], rates[0]) - np.outer(whole[:, -2], rates[1]))
        count = basis.shape[1]
        slopes = np.zeros((len(share), 3, 3 * count + 1))
        for axis, scale in enumerate(self._scales):
            slopes[:, axis, axis * count : (axis + 1) * count] = scale * basis
            slopes[:, axis, -1] = scale * (later[:, axis] + ends[:, axis])
        return slopes.reshape(3 * len(share), -1)


def task_of(walk: RecordedWalk, objective: WalkObjective) -> WalkingTask:
    """What was asked of a recorded walk."""
    return WalkingTask(
        walk.start, walk.goal, objective, (), Walker(), 0.0, None, walk.start_velocity, walk.goal_velocity
    )


def predicted(walks: Sequence[RecordedWalk], objective: WalkObjective) -> tuple[WalkingPath, ...]:
    """Optimal paths of recorded walks under a given objective, searched from the recordings.

    Raises:
        SolverError: If a path cannot be optimised.
    """
    return tuple(_Fit(walk, objective).at(objective).path for walk in walks)


def share_errors(walks: Sequence[RecordedWalk], paths: Sequence[SampledWalk]) -> FloatArray:
    """(walks,) mean distance between recorded and predicted places at equal shares of their durations [m].

    A walk against one predicted path, as [Truong2010]_ (4.8) measures walks against their mean.
    """
    return np.array([_share_error(path, walk) for path, walk in zip(paths, walks, strict=True)])


def _share_error(path: SampledWalk, walk: RecordedWalk) -> float:
    share = np.linspace(0.0, 1.0, _SHARES)
    first, last = walk.time[0], walk.time[-1]
    recorded = np.column_stack([
        np.interp(first + share * (last - first), walk.time, walk.place[:, axis]) for axis in range(2)
    ])  # fmt: skip
    return float(np.hypot(*(path.place_at(share * path.duration)[:, :2] - recorded).T).mean())


def _covariance(matches: Sequence[_Match], independent_samples: bool) -> tuple[FloatArray, int]:
    """(k, k) of the logarithms of the weights, and the degrees of freedom of their intervals."""
    slopes = np.vstack([one.slopes for one in matches])
    residuals = np.concatenate([one.residuals for one in matches])
    bread = np.linalg.pinv(slopes.T @ slopes)
    if independent_samples:
        freedom = len(residuals) - slopes.shape[1]
        return bread * (residuals @ residuals / freedom), freedom
    scores = np.array([one.slopes.T @ one.residuals for one in matches])
    freedom = len(matches) - slopes.shape[1]
    return bread @ (scores.T @ scores) @ bread * (len(matches) / freedom), freedom


def _check_effects(slopes: FloatArray, names: Sequence[str]) -> None:
    without = [
        name for name, effect in zip(names, np.abs(slopes).max(axis=0), strict=True) if effect < _EFFECT
    ]
    if without:
        raise InputError(
            f"the recorded walks do not depend on the weights {', '.join(without)}; "
            "valid: walks that also turn and go aside"
        )


def _objective(
    first: WalkObjective, logs: FloatArray, names: Sequence[str] = IDENTIFIED
) -> WalkObjective:
    return replace(first, time=1.0, **dict(zip(names, np.exp(logs).tolist(), strict=True)))


def _guess_of(walk: RecordedWalk, pieces: int) -> Guess:
    """A smooth path through a recording."""
    share = walk.time / walk.time[-1]
    # A recording may have fewer instants than the spline has pieces.
    even = np.linspace(0.0, 1.0, 10 * pieces)
    places = np.column_stack([np.interp(even, share, walk.place[:, axis]) for axis in range(3)])
    ends = (np.tile(walk.start, (2, 1)), np.tile(walk.goal, (2, 1)))
    spline = BSpline.fit(DEGREE, path_knots(pieces), even, places, first=ends[0], last=ends[1])
    return Guess("recording", spline.control_points, float(walk.time[-1]))
