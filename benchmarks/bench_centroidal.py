"""CoM planning of the platform scenario ([Qiu2012]_ 5.4.4; the thesis took < 3 minutes), by both methods."""

import numpy as np
import pytest

from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.planning.com import (
    BentSurface,
    CentroidalProblem,
    KeyframeProblem,
    RecordedCom,
    assess_feasibility,
    height_band,
    plan_com,
    plan_com_through_key_frames,
)
from manikin.planning.com.feasibility import polytopes_of
from manikin.planning.com.transcription import transcribe


@pytest.fixture(scope="module")
def problem() -> CentroidalProblem:
    def foot(name, position):
        return sole(name, position, np.pi / 2, length=0.28, width=0.12, friction=0.7)

    left = [foot("left_foot", p) for p in ((-0.1, 0, 0), (0.2, 0.4, 0), (0.5, 0.65, 0.2))]
    right = [foot("right_foot", p) for p in ((0.1, 0, 0), (0.7, 0.65, 0.2))]
    stances = [
        [left[0], right[0]], [right[0]], [left[1], right[0]], [left[1]],
        [left[1], right[1]], [right[1]], [left[2], right[1]],
    ]  # fmt: skip
    durations = (0.15, 0.4, 0.15, 0.8, 0.15, 0.8, 0.15)
    return CentroidalProblem(
        79.0,
        StanceSequence([Phase(Stance(s, 1500.0), d) for s, d in zip(stances, durations, strict=True)]),
        (0.0, 0.0, 0.92),
        (0.6, 0.65, 0.86),
        required_margin=20.0,
        support_distance=1.0,
        geometric=height_band(BentSurface(0.89, 0.08, 10.0, 0.2), BentSurface(0.91, 0.08, 10.0, 0.2)),
        max_duration=5.0,
    )


def test_plan_platform_cold(benchmark, problem):
    """Everything, the symbolic programme and its derivatives built anew."""
    result = benchmark.pedantic(plan_com, (problem,), setup=transcribe.cache_clear, rounds=5)
    assert result.succeeded


def test_plan_platform_warm(benchmark, problem):
    """With the programme of the same structure at hand, as in a sweep over bodies or goals."""
    result = benchmark.pedantic(plan_com, (problem,), warmup_rounds=1, rounds=5)
    assert result.succeeded


def test_feasibility(benchmark, problem):
    polytopes = polytopes_of(problem)
    assert benchmark(assess_feasibility, problem, polytopes).failure is None


def test_certificate(benchmark, problem):
    """Every requirement measured at every millisecond."""
    result = plan_com(problem)
    assert benchmark(result.residuals).within()


def test_through_key_frames(benchmark, problem):
    """Polytopes, quadratic programme and certificate, on the timing-free trajectory as a recording."""
    trajectory = plan_com(problem).trajectory
    time = np.linspace(0.0, trajectory.duration, 501)
    recording = RecordedCom(time, trajectory.position(time), problem.sequence, trajectory.schedule.instants)
    asked = KeyframeProblem(79.0, recording)
    assert benchmark(plan_com_through_key_frames, asked).succeeded
