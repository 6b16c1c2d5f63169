"""Hands that hold on and let go during an execution."""

import importlib
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp
from manikin.scene import Obstacle, Scene, Sphere
from manikin.simulation import execute
from manikin.simulation.world import World

INSTANTS = (0.0, 0.1, 0.2, 0.4, 0.5, 0.6)
GRASPED = (1, 3)
"""Phases in which the hand holds on."""


@pytest.fixture
def grips(monkeypatch):
    """Where each hand holds on (3,), by effector, with the time of each step of the engine [s]."""
    found = []

    class Watched(World):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            self.held = {}

        def grip(self, grip):
            self.held[grip.effector] = grip.position
            super().grip(grip)

        def release(self, effector):
            self.held.pop(effector, None)
            super().release(effector)

        def advance(self, tau, steps):
            found.append((self.time, dict(self.held)))
            super().advance(tau, steps)

    monkeypatch.setattr(importlib.import_module("manikin.simulation.execute"), "World", Watched)
    return found


def test_a_hand_that_grasps_twice_holds_on_both_times_and_only_then(body, stand, grips):
    plan = stand(INSTANTS[-1])
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, plan.motion.q[0])
    hand = data.oMf[body.effector_frame("right_hand")].translation
    places = {1: hand, 3: hand + 0.001 * np.array([0.0, 0.0, 1.0])}
    feet = plan.schedule.sequence.phases[0].stance.contacts
    stances = [
        [*feet, grasp("right_hand", places[phase], max_force=50.0)] if phase in GRASPED else [*feet]
        for phase in range(len(INSTANTS) - 1)
    ]
    schedule = ContactSchedule(StanceSequence([Phase(Stance(held)) for held in stances]), INSTANTS)
    n = len(plan.motion.time)
    motion = replace(
        plan.motion, support=schedule.support(plan.motion.time, schedule.sequence.effectors),
        contact_names=schedule.sequence.effectors, contact_force=np.zeros((n, 3, 6)),
    )  # fmt: skip
    scene = Scene([Obstacle("knob", Sphere(0.002), translation=hand)])
    result = execute(body, scene, motion, schedule, hold=0.0)
    assert not result.fell
    for time, held in grips:
        phase = int(schedule.phase_at(np.array([time + 1e-9]))[0])
        if phase in GRASPED and time >= 0.0:
            assert held["right_hand"] == pytest.approx(places[phase]), time
        else:
            assert held == {}, time
    force = result.motion.contact_force[:, result.motion.contact_names.index("right_hand"), 2]
    second = (result.motion.time > INSTANTS[3] + 0.02) & (result.motion.time < INSTANTS[4] - 0.01)
    # One millimetre above the hand, the grip pulls it up: by 50 N at first, less as the hand gives way.
    assert np.all(force[second] > 1.0)
