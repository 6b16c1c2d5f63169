"""Small runs of every kind that the figures and comparisons have to cope with."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.numerics.spline import BSpline
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.planning.com import CentroidalTrajectory
from manikin.scene import Box, Obstacle, Scene


@pytest.fixture(scope="session")
def run(finished_run):
    """The platform scenario with made-up motions."""
    summary = {"scenario": "platform", "succeeded": True, "failure": None}
    return RunRecord("platform", finished_run, summary, finished_run.body.mass)


def wall_foot(name, side, height):
    """A sole on the wall at x = side (1 or -1), its long edge level."""
    across = np.array([0.0, 1.0, 0.0])
    normal = np.array([-float(side), 0.0, 0.0])
    rotation = np.column_stack([across, np.cross(normal, across), normal])
    return sole(
        name, (side, 0.0, height), rotation=rotation, length=0.4, width=0.1, friction=1.0,
        normal_force_cap=500.0,
    )  # fmt: skip


def climbing():
    """A 120 kg point mass rising between two walls, four feet, two of them moving at a time."""
    feet = ("low_left_foot", "low_right_foot", "high_left_foot", "high_right_foot")
    heights = {"low": 0.85, "high": 1.15}
    phases = []
    for lifted, at in (("", 0), ("low", 0), ("", 1), ("high", 1), ("", 2)):
        contacts = []
        for name in feet:
            pair = name.split("_")[0]
            step = {0: 0, 1: int(pair == "low"), 2: 1}[at]
            if pair != lifted:
                contacts.append(wall_foot(name, -1 if "left" in name else 1, heights[pair] + 0.5 * step))
        phases.append(Phase(Stance(contacts), 0.3))
    sequence = StanceSequence(phases)
    schedule = ContactSchedule(sequence, [0.0, 0.5, 0.8, 1.6, 1.9, 2.5])
    knots = [0.0] * 5 + [0.25, 0.5, 0.75] + [1.0] * 5
    points = np.column_stack([np.zeros((8, 2)), [1.0, 1.0, 1.05, 1.2, 1.3, 1.45, 1.5, 1.5]])
    trajectory = CentroidalTrajectory(120.0, BSpline(4, knots, points), schedule)
    time = np.linspace(0.0, 2.5, 501)
    plan = ComTrack(
        time, trajectory.position(time), trajectory.velocity(time), trajectory.acceleration(time),
        300.0 + 50.0 * np.cos(3.0 * time), "N",
    )  # fmt: skip
    walls = [
        Obstacle(f"wall {side}", Box([0.1, 2.0, 3.0]), None, [1.05 * side, 0.0, 1.5]) for side in (-1, 1)
    ]
    content = MotionFile(scene=Scene(walls, floor_height=0.0), schedule=schedule)
    return RunRecord("walls", content, {"scenario": "walls", "succeeded": True, "failure": None}, 120.0, plan)


@pytest.fixture(scope="session")
def walls():
    """A point mass between two walls: no body, no motion file, a margin in newtons."""
    return climbing()


@pytest.fixture(scope="session")
def seated(finished_run):
    """Two feet, then a hand on a bar, then the pelvis on a seat as well; planned only."""
    body = finished_run.body
    feet = [
        sole("left_foot", (0.0, 0.1, 0.0), length=0.28, width=0.12, friction=0.7),
        sole("right_foot", (0.0, -0.1, 0.0), length=0.28, width=0.12, friction=0.7),
    ]
    hand = grasp("right_hand", (0.4, -0.3, 1.0), max_force=100.0)
    seat = sole("pelvis", (-0.25, 0.0, 0.5), length=0.2, width=0.3, friction=0.5)
    stances = [feet, [feet[0]], feet, [*feet, hand], [*feet, hand, seat]]
    sequence = StanceSequence([Phase(Stance(stance, 1500.0), 0.2) for stance in stances])
    schedule = ContactSchedule(sequence, [0.0, 0.3, 0.7, 1.0, 1.6, 2.0])
    time = np.linspace(0.0, 2.0, 201)
    names = sequence.effectors
    support = schedule.support(time, names)
    force = np.zeros((len(time), len(names), 6))
    force[:, :, 2] = support * (body.mass * 9.81 / support.sum(axis=1))[:, None]
    q = np.tile(body.standing_posture(), (len(time), 1))
    q[:, 2] -= 0.15 * time
    zero = np.zeros((len(time), body.nv))
    com = np.column_stack([0 * time, 0 * time, 0.9 - 0.15 * time])
    motion = Motion(
        time=time, q=q, v=zero, a=zero, tau=zero, com=com,
        angular_momentum=np.zeros((len(time), 3)), margin=20.0 + 200.0 * (time > 1.6), support=support,
        contact_force=force, contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip
    scene = Scene([Obstacle("seat", Box([0.4, 0.5, 0.1]), None, [-0.3, 0.0, 0.45])], floor_height=0.0)
    return RunRecord(
        "seated", MotionFile(motion, None, body, scene, schedule), {"scenario": "seated"}, body.mass
    )


@pytest.fixture(scope="session")
def failed():
    """A run that ended before it had a centre of mass."""
    failure = {"stage": "centroidal", "reason": "no margin", "time_s": 0.0, "where": "phase 3"}
    return RunRecord("failed", MotionFile(), {"scenario": "platform", "succeeded": False, "failure": failure})


@pytest.fixture(scope="session")
def planned_only(run):
    """The platform run without its execution."""
    return replace(run, content=replace(run.content, executed=None))
