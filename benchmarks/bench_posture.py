"""Postures of the platform scenario: cold, from a neighbour, and the parts of one iteration."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import sole
from manikin.kinematics import PostureProblem, SolverSettings, generate_posture, touching_pairs
from manikin.kinematics.posture_search import PostureSolver
from manikin.scene import Box, Obstacle, Proximity, Scene

BODY = human()
BOXES = {
    "roof": ((1.1, 1.5, 0.05), (0.9, 0.75, 1.5)),
    "threshold": ((0.05, 1.5, 0.3), (0.35, 0.75, 0.15)),
    "platform": ((1.1, 1.5, 0.2), (0.9, 0.75, 0.1)),
}
SCENE = Scene([Obstacle(name, Box(size), translation=place) for name, (size, place) in BOXES.items()])
STANCES = {
    "stand": ((-0.1, 0, 0), (0.1, 0, 0), (0, 0, 0.92)),
    "straddle": ((0.2, 0.4, 0), (0.7, 0.65, 0.2), (0.649, 0.5725, 0.819)),
    "crouch": ((0.5, 0.65, 0.2), (0.7, 0.65, 0.2), (0.6, 0.65, 0.86)),
}


def problem(stance):
    left, right, com = STANCES[stance]
    feet = [("left_foot", left), ("right_foot", right)]
    return PostureProblem(
        BODY,
        tuple(sole(n, p, np.pi / 2, length=0.28, width=0.12, friction=0.7) for n, p in feet),
        com=np.array(com, dtype=float),
        proximity=Proximity(BODY, SCENE),
        ignore=touching_pairs(BODY, [(n, "floor" if p[2] < 0.1 else "platform") for n, p in feet]),
    )


@pytest.mark.parametrize("stance", list(STANCES))
def test_cold(benchmark, stance):
    """From the standing posture placed over the feet."""
    asked = problem(stance)
    assert benchmark(generate_posture, asked).succeeded


@pytest.mark.parametrize("stance", list(STANCES))
def test_from_a_neighbour(benchmark, stance):
    """The centre of mass moved by 5 mm, as between two samples of a motion."""
    asked = problem(stance)
    first = generate_posture(asked)
    moved = replace(asked, com=np.add(asked.com, (0.003, 0.003, -0.003)))
    assert benchmark(generate_posture, moved, first.q).succeeded


def test_failure_with_explanation(benchmark):
    """A centre of mass out of reach."""
    asked = replace(problem("stand"), com=np.array([0.0, 0.0, 1.4]))
    assert not benchmark(generate_posture, asked).succeeded


def test_one_linearisation(benchmark):
    """Kinematics, Jacobians and distances of one iterate."""
    asked = problem("crouch")
    solver, q = PostureSolver(asked, SolverSettings()), generate_posture(asked).q
    benchmark(solver.linearise, q)
