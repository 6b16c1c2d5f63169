"""The platform scene of [Qiu2012]_ 5.4.4 and its published solution, the car of chapter 7."""

from collections.abc import Callable

import numpy as np
import pytest

from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.numerics.spline import BSpline
from manikin.planning.com import (
    BentSurface,
    CentroidalProblem,
    CentroidalResult,
    CentroidalTrajectory,
    height_band,
    plan_com,
)


def foot(
    name: str,
    position,
    yaw: float = np.pi / 2,
    length: float = 0.28,
    width: float = 0.12,
    friction: float = 0.7,
) -> Contact:
    return sole(name, position, yaw, length=length, width=width, friction=friction)


def platform_sequence(
    min_durations=(0.15, 0.4, 0.15, 0.8, 0.15, 0.8, 0.15), lift: float = 0.2
) -> StanceSequence:
    """Table 5.3; the feet look along +y (DOUBTS Q-11)."""
    left = [foot("left_foot", p) for p in ((-0.1, 0, 0), (0.2, 0.4, 0), (0.5, 0.65, lift))]
    right = [foot("right_foot", p) for p in ((0.1, 0, 0), (0.7, 0.65, lift))]
    stances = [
        [left[0], right[0]], [right[0]], [left[1], right[0]], [left[1]],
        [left[1], right[1]], [right[1]], [left[2], right[1]],
    ]  # fmt: skip
    return StanceSequence([Phase(Stance(s, 1500.0), d) for s, d in zip(stances, min_durations, strict=True)])


def platform_problem(**changes) -> CentroidalProblem:
    """Start, goal, band (5.29) and bounds of the scenario for the 79 kg body."""
    band = height_band(BentSurface(0.89, 0.08, 10.0, 0.2), BentSurface(0.91, 0.08, 10.0, 0.2))
    given = {
        "mass": 79.0, "sequence": platform_sequence(),
        "start_com": (0.0, 0.0, 0.92), "goal_com": (0.6, 0.65, 0.86),
        "required_margin": 20.0, "support_distance": 1.0, "geometric": band, "max_duration": 5.0,
    }  # fmt: skip
    return CentroidalProblem(**(given | changes))


def car_sequence() -> StanceSequence:
    """Tables 7.3 and 7.4, first six phases; sole 0.24 x 0.09 m, mu 0.5, caps 1000 N and 100 N."""

    def car_foot(name: str, position, yaw_deg: float) -> Contact:
        # The thesis' feet look along their local +y (DOUBTS Q-11).
        return foot(name, position, np.deg2rad(yaw_deg + 90.0), 0.24, 0.09, 0.5)

    left = [
        car_foot("left_foot", (0.191, -1.064, -0.485), 50),
        car_foot("left_foot", (-0.24, -0.737, -0.485), 90),
    ]
    right = [
        car_foot("right_foot", (0.283, -0.937, -0.485), 50),
        car_foot("right_foot", (-0.624, -0.012, -0.232), 90),
    ]
    hand = grasp("right_hand", (-0.46, -0.056, 0.569), max_force=100.0)
    stances = [
        [left[0], right[0]], [right[0]], [left[1], right[0]], [left[1]],
        [left[1], hand], [left[1], right[1], hand],
    ]  # fmt: skip
    durations = (0.15, 0.4, 0.1, 0.5, 0.6, 0.6)
    return StanceSequence([Phase(Stance(s, 1000.0), d) for s, d in zip(stances, durations, strict=True)])


TABLE_5_4_POINTS = (
    (0.0, 0.0, 0.92), (0.0, 0.0, 0.92), (0.024, 0.007, 0.972), (0.091, 0.027, 0.942),
    (0.118, 0.117, 0.752), (0.268, 0.643, 1.076), (0.132, 0.16, 0.64), (0.842, 0.761, 1.002),
    (0.658, 0.523, 0.66), (0.687, 0.656, 0.95), (0.6, 0.65, 0.86), (0.6, 0.65, 0.86),
)  # fmt: skip
TABLE_5_4_INNER_KNOTS = (0.0766, 0.172, 0.222, 0.413, 0.677, 0.867)
TABLE_5_4_INSTANTS = (0.0, 0.321, 0.721, 0.93, 1.73, 2.837, 3.637, 4.193)

TABLE_7_6_POINTS = np.column_stack([
    [0.235, 0.235, 0.2492, 0.2763, 0.1825, -0.3005, -0.2687, -0.2684, -0.3894, -0.1642, -0.0454],
    [-1.0112, -1.0112, -0.986, -0.935, -0.8688, -0.6894, -0.7915, -0.5306, -0.5296, -0.2661, -0.1463],
    [0.4659, 0.4659, 0.4635, 0.4505, 0.426, 0.3694, 0.3299, 0.2706, 0.2336, 0.2153, 0.2104],
])  # fmt: skip
TABLE_7_6_INNER_KNOTS = (0.1574, 0.2451, 0.4536, 0.5632, 0.8684)
TABLE_7_6_INSTANTS = (0.0, 0.7176, 1.1176, 2.0679, 2.5679, 3.9592, 4.5592)


def published(sequence: StanceSequence, points, inner_knots, instants) -> CentroidalTrajectory:
    knots = np.concatenate([np.zeros(6), inner_knots, np.ones(6)])
    return CentroidalTrajectory(79.0, BSpline(5, knots, points), ContactSchedule(sequence, instants))


@pytest.fixture(scope="session")
def platform() -> Callable[..., CentroidalProblem]:
    return platform_problem


@pytest.fixture(scope="session")
def planned() -> CentroidalResult:
    """The platform scenario, planned once."""
    return plan_com(platform_problem())


@pytest.fixture(scope="session")
def platform_stances() -> StanceSequence:
    return platform_sequence()


@pytest.fixture(scope="session")
def car_stances() -> StanceSequence:
    return car_sequence()


@pytest.fixture(scope="session")
def table_5_4() -> CentroidalTrajectory:
    return published(platform_sequence(), TABLE_5_4_POINTS, TABLE_5_4_INNER_KNOTS, TABLE_5_4_INSTANTS)


@pytest.fixture(scope="session")
def table_7_6() -> CentroidalTrajectory:
    return published(car_sequence(), TABLE_7_6_POINTS, TABLE_7_6_INNER_KNOTS, TABLE_7_6_INSTANTS)
