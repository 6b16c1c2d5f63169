"""Obstacles that any part of the body may lean on."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.planning.whole_body import WholeBodyRequirements, WholeBodySettings, plan_whole_body
from manikin.scene import Box, Obstacle, Scene
from manikin.scene.distance import Proximity

REQUIRED = 0.03
"""Clearance asked of the motion [m]."""

BACKREST = Obstacle("backrest", Box((0.05, 0.3, 0.2)), translation=(-0.12, 0.0, 1.1))
"""The chest, whose place the centre of mass decides, comes closer to it than that."""

ARMREST = Obstacle("armrest", Box((0.3, 0.05, 0.05)), translation=(-0.05, -0.37, 1.03))
"""The right arm would pass through it, but need not."""


def least_distance(body, obstacle, motion):
    """Signed distance between the body and an obstacle over a motion [m]."""
    proximity = Proximity(body, Scene([obstacle], floor_height=None), self_collision=False)
    return min(proximity.minimum(q).distance for q in motion.q[::10])


@pytest.fixture(scope="module")
def leaning(person, step_com):
    settings = replace(WholeBodySettings(), requirements=WholeBodyRequirements(clearance=REQUIRED))
    return plan_whole_body(
        person, Scene([BACKREST, ARMREST]), step_com, rng=np.random.default_rng(0), settings=settings,
        padded=("backrest", "armrest"),
    )  # fmt: skip


@pytest.mark.long
def test_the_certificate_does_not_count_what_may_be_leant_on(leaning, person):
    assert least_distance(person, BACKREST, leaning.motion) < REQUIRED - 0.001
    assert leaning.succeeded, leaning.failure
    assert leaning.certificate.value("min_clearance_m") >= REQUIRED


@pytest.mark.long
def test_the_fit_keeps_off_it_where_it_can(leaning, step_motion, person):
    """The same step without the armrest passes through its place."""
    assert least_distance(person, ARMREST, step_motion.motion) < -0.03
    assert least_distance(person, ARMREST, leaning.motion) > 0.02
