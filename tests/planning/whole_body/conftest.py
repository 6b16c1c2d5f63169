"""A short step on flat ground, planned once for all tests of the whole-body room."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from manikin.body import BodyModel, human
from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.planning.com import CentroidalProblem, CentroidalTrajectory, Weights, plan_com
from manikin.planning.whole_body import WholeBodyResult, plan_whole_body
from manikin.scene import Scene

SIZE = {"length": 0.28, "width": 0.12, "friction": 0.7}


def step_sequence() -> StanceSequence:
    """Both feet, the right one alone, both feet with the left one 0.25 m ahead."""
    right = sole("right_foot", (0.0, -0.1, 0.0), **SIZE)
    behind, ahead = (sole("left_foot", (x, 0.1, 0.0), **SIZE) for x in (0.0, 0.25))
    stances = ([behind, right], [right], [ahead, right])
    return StanceSequence([Phase(Stance(contacts, 1500.0), 0.5, 1.2) for contacts in stances])


@pytest.fixture(scope="session")
def person() -> BodyModel:
    return human(1.75, 79.0, "male", sole_length=0.28, sole_width=0.12)


@pytest.fixture(scope="session")
def flat_ground() -> Scene:
    return Scene()


@pytest.fixture(scope="session")
def step_com(person) -> CentroidalTrajectory:
    result = plan_com(
        CentroidalProblem(
            person.mass, step_sequence(), (-0.02, 0.0, 0.93), (0.1, 0.0, 0.93),
            start_acceleration=(0.0, 0.0, 0.0), goal_acceleration=(0.0, 0.0, 0.0), required_margin=10.0,
            max_duration=3.5, weights=Weights(0.3, 10.0, 0.0, acceleration=(1.0, 1.0, 1.0)),
        )
    )  # fmt: skip
    assert result.trajectory is not None, result.failure
    return result.trajectory


@pytest.fixture(scope="session")
def step_motion(person, flat_ground, step_com) -> WholeBodyResult:
    return plan_whole_body(person, flat_ground, step_com, rng=np.random.default_rng(0))


@pytest.fixture(scope="session")
def cases():
    """Inputs of the refinement, see ``refine_cases.py`` beside this file."""
    spec = importlib.util.spec_from_file_location("refine_cases", Path(__file__).parent / "refine_cases.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["refine_cases"] = module
    spec.loader.exec_module(module)
    return module
