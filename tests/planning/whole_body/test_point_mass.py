"""The motion of a point mass: forces that carry it, within friction and caps, on feet that weigh nothing."""

import numpy as np
import pytest

from manikin.balance import pseudo_wrench
from manikin.contact import ContactSchedule
from manikin.motion.file import read_motions
from manikin.motion.motion import LIFT, foot_positions
from manikin.numerics.spatial import rotation_from_quaternion
from manikin.pipeline.runner import run
from manikin.reports.export import write_outputs
from manikin.reports.figures import FIGURES
from manikin.scenarios import load_scenario


@pytest.fixture(scope="module")
def climbed(runs):
    return runs("walls@trial-2")


def in_world(run):
    """Schedule of a run in the world; the stages themselves work in the frame of the task."""
    return run.centroidal.trajectory.schedule.moved(run.transform_task_to_world)


def test_the_run_ends_with_its_certificate(climbed):
    summary = climbed.summary
    assert (summary["scenario"], summary["succeeded"]) == ("walls@trial-2", True)
    assert summary["wholebody"] is None
    assert summary["execution"] is None
    assert summary["centroidal"]["margin_unit"] == "N"
    assert climbed.executed is None


def test_the_forces_supply_the_pseudo_wrench(climbed):
    """Newton and Euler about the world origin, to the tolerance of the quadratic program."""
    motion, schedule = climbed.planned, in_world(climbed)
    feet = foot_positions(schedule, motion.time)
    total = np.zeros((len(motion.time), 6))
    for number, name in enumerate(motion.contact_names):
        force, moment = motion.contact_force[:, number, :3], motion.contact_force[:, number, 3:]
        assert np.all(force[~motion.support[:, number]] == 0.0)
        total += np.hstack([force, moment + np.cross(feet[name], force)])
    turn = rotation_from_quaternion(motion.q[:, 3:7])  # accelerations are in the frame of the root
    wanted = pseudo_wrench(120.0, motion.com, np.einsum("nij,nj->ni", turn, motion.a[:, :3]))
    np.testing.assert_allclose(total, wanted, atol=1e-3)


def test_the_forces_keep_friction_and_caps(climbed):
    """Normal force at most 500 N, each tangential component at most as large (friction 1)."""
    motion = climbed.planned
    for number, name in enumerate(motion.contact_names):
        force = motion.contact_force[:, number, :3]
        normal = force[:, 0] * (1.0 if name.startswith("left") else -1.0)
        assert normal.min() >= -1e-6
        assert normal.max() <= 500.0 + 1e-3
        assert np.all(np.abs(force[:, 1:]) <= normal[:, None] + 1e-3)


def test_the_margin_of_the_motion_is_that_of_the_certificate(climbed):
    motion = climbed.planned
    assert motion.margin_unit == "N"
    # The certificate looks every millisecond, the motion every five; both at the key instants.
    assert motion.margin.min() >= climbed.summary["centroidal"]["min_margin"] - 1e-6
    assert motion.margin.min() == pytest.approx(climbed.summary["centroidal"]["min_margin"], abs=2.0)


def test_feet_stand_on_their_contacts_and_swing_clear_of_the_walls(climbed):
    schedule = in_world(climbed)
    times = np.linspace(0.0, schedule.instants[-1], 2000)
    for name, places in foot_positions(schedule, times).items():
        held = schedule.support(times, (name,))[:, 0]
        assert np.all(np.abs(np.abs(places[held, 0]) - 1.0) < 1e-12)
        assert np.abs(places[:, 0]).max() <= 1.0 + 1e-12
        assert np.abs(places[:, 0]).min() == pytest.approx(1.0 - LIFT, abs=1e-3)
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        assert steps.max() < 0.01  # no jump: 0.5 m in 0.3 s, sampled every 2 ms


def test_a_foot_in_the_air_at_both_ends_waits_at_its_contact():
    sequence = load_scenario("walls").build_sequence()
    short = ContactSchedule(type(sequence)(list(sequence)[3:8]), np.arange(6.0))
    places = foot_positions(short, np.linspace(0.0, 5.0, 50))["left_hind_foot"]
    np.testing.assert_allclose(places[0], [-1.0, 0.0, 1.35])


def test_the_files_are_drawn_and_read_again(climbed, monkeypatch):
    for name in set(FIGURES) - {"com", "margin", "scene"}:
        monkeypatch.delitem(FIGURES, name)
    written = write_outputs(climbed.directory)
    assert {path.name for path in written} >= {"com.png", "margin.png", "scene.png"}
    content = read_motions(climbed.directory)
    assert content.body.is_point_mass
    assert content.body.mass == 120.0
    assert content.planned.margin_unit == "N"
    assert content.planned.contact_names == climbed.planned.contact_names


def test_the_viewer_shows_legs_and_forces(climbed):
    pytest.importorskip("viser")
    from manikin.viewer.door import Door
    from manikin.viewer.session import ViewerSession

    session = ViewerSession(read_motions(climbed.directory), Door(0))
    try:
        for time in (0.0, 1.3, climbed.planned.time[-1]):
            session.show(time)
        assert "N**" in session._text.content
    finally:
        session.close()


@pytest.mark.long
def test_the_resolved_scenario_and_other_seeds_give_the_same_bits(climbed):
    """Nothing is random for a point mass."""
    again = run(climbed.directory / "scenario.yaml", seed=9)
    assert np.array_equal(again.planned.com, climbed.planned.com)
    assert np.array_equal(again.planned.contact_force, climbed.planned.contact_force)
