"""A crawl is fitted in parts, from rest to rest in known postures."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.body.configuration import Configuration
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, point, sole
from manikin.numerics.spline import BSpline, clamped_knots
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body import WholeBodySettings
from manikin.planning.whole_body.certificate import WholeBodyFailure
from manikin.planning.whole_body.plan_whole_body import SLOWER, _in_parts, _Planner, resting_keys
from manikin.planning.whole_body.posture_style import Guide
from manikin.scene import Scene

BODY = human()
INSTANTS = np.array([0.0, 0.4, 0.8])


@pytest.fixture(scope="module")
def standing():
    return np.array(BODY.standing_posture())


def still(q, extra=()):
    """The centre of mass of a posture, at rest over its feet for two phases."""
    state, feet = Configuration(BODY, q), []
    for name in ("left_foot", "right_foot"):
        rotation, place = state.effector_placement(name)
        feet.append(sole(name, place, length=0.24, width=0.08, friction=0.7, rotation=rotation))
    phases = StanceSequence([Phase(Stance([*feet, *extra], 2000.0))] * 2)
    spline = BSpline(5, clamped_knots(5, [0.0, 1.0]), np.tile(state.com, (6, 1)))
    return CentroidalTrajectory(BODY.mass, spline, ContactSchedule(phases, INSTANTS))


def test_a_part_begins_in_a_given_posture_and_comes_to_rest_where_it_likes(standing):
    """It does not snap into the posture that is known there; the one that follows begins where it ended."""
    trajectory = still(standing)
    given, known = standing.copy(), standing.copy()
    given[7 + BODY.joint_index("left_elbow_flexion")] += 0.2  # an arm that moves no contact
    known[7 + BODY.joint_index("left_elbow_flexion")] += 0.6
    guide = Guide(INSTANTS, np.array([standing, known, standing]), ())
    rng = np.random.default_rng(0)
    planner = _Planner(BODY, Scene([]), trajectory, rng, WholeBodySettings(), known=guide)
    spline = planner.part(0, 1, (given, None)).run((), 0.0, lambda _: None).spline
    begin, end = (spline.evaluate(INSTANTS[k : k + 1]) for k in (0, 1))
    np.testing.assert_allclose(begin.q[0], given, atol=1e-9)
    for rate in (begin.v, begin.a):
        np.testing.assert_allclose(rate, 0.0, atol=1e-6)  # rounding over the squared spacing of the knots
    assert np.abs(end.v).max() < 2e-3
    assert np.abs(end.a).max() < 0.05
    assert np.abs(end.q[0] - known).max() > 1e-3
    assert spline.knots[-1] == INSTANTS[1]


def test_a_guide_at_rest_at_some_instants_has_no_speed_there_and_does_not_overshoot(standing):
    bent = standing.copy()
    bent[7:] += 0.3
    guide = Guide(INSTANTS, np.array([standing, bent, standing + 1.5 * (bent - standing)]), ())
    smooth, time = guide.resting(INSTANTS[[0, 2]]), np.linspace(0.0, INSTANTS[-1], 801)
    rows = smooth.at(time)[:, 7:] - standing[7:]
    np.testing.assert_allclose(smooth.at(INSTANTS), guide.at(INSTANTS), atol=1e-12)
    speed = np.gradient(rows, time, axis=0)
    assert np.abs(speed[[0, -1]]).max() < 0.01
    assert speed[400].min() > 0.3  # it passes the middle one
    assert np.diff(rows, axis=0).min() > -1e-12


def test_a_crawl_may_be_cut_where_it_rests_and_a_walk_is_not(standing):
    """A still body on its feet is fitted as a whole, one on a knee is cut where postures are known."""
    knee = point("left_knee", (0.3, 0.1, 0.0), friction=0.7)
    known = np.array([standing, standing, standing])
    assert resting_keys(BODY, still(standing), Guide(INSTANTS, known, ())) == []
    assert resting_keys(BODY, still(standing, [knee]), Guide(INSTANTS, known, ())) == [0, 1, 2]
    away = known.copy()
    away[1, 0] += 0.01  # the posture in the middle has its centre of mass elsewhere
    assert resting_keys(BODY, still(standing, [knee]), Guide(INSTANTS, away, ())) == [0, 2]


def test_joined_parts_are_one_motion_with_one_certificate(standing):
    """Measured over the whole, the instant where the parts meet included."""
    guide = Guide(INSTANTS, np.array([standing] * 3), ())
    rng = np.random.default_rng(0)
    planner = _Planner(BODY, Scene([]), still(standing), rng, WholeBodySettings(), known=guide)
    shares = []
    result = _in_parts(planner, [0, 1, 2], 0.0, shares.append)
    assert result.succeeded, result.failure
    assert result.motion.time[-1] == INSTANTS[-1]
    assert result.guide.time[-1] == INSTANTS[-1]
    meeting = result.spline.evaluate(INSTANTS[1] + np.array([-1e-6, 0.0]))
    np.testing.assert_allclose(meeting.q[0], meeting.q[1], atol=1e-6)
    assert np.abs(meeting.v).max() < 2e-3
    assert np.abs(meeting.a).max() < 0.05
    assert shares[-1] == 1.0


def test_a_part_that_fails_is_given_more_time_and_what_follows_comes_later(standing, monkeypatch):
    """The second part only: its first attempts are refused here as if a limb had been too fast."""
    known = Guide(INSTANTS, np.array([standing] * 3), ())
    rng = np.random.default_rng(0)
    planner = _Planner(BODY, Scene([]), still(standing), rng, WholeBodySettings(), known=known)
    run, lengths = _Planner.run, []

    def in_a_hurry(self, *args):
        begin, end = self.instants
        lengths.append(end - begin)
        result = run(self, *args)
        hurried = begin > 0.0 and end - begin < 0.6
        return replace(result, failure=WholeBodyFailure("too fast", begin, "")) if hurried else result

    monkeypatch.setattr(_Planner, "run", in_a_hurry)
    result = _in_parts(planner, [0, 1, 2], 0.0, lambda _: None)
    assert result.succeeded, result.failure
    np.testing.assert_allclose(lengths, 0.4 * np.array([1.0, 1.0, *SLOWER]))
    np.testing.assert_allclose(result.trajectory.schedule.instants, [0.0, 0.4, 0.4 + 0.4 * SLOWER[1]])
    assert result.motion.time[-1] == pytest.approx(result.trajectory.duration)
    assert result.guide.time[-1] == pytest.approx(result.trajectory.duration)


def test_a_motion_ends_with_the_part_that_fails(standing, monkeypatch):
    """What follows would only take time: its failure is the motion's, which lasts as long as it is known."""
    known = Guide(INSTANTS, np.array([standing] * 3), ())
    rng = np.random.default_rng(0)
    planner = _Planner(BODY, Scene([]), still(standing), rng, WholeBodySettings(), known=known)
    run, begins = _Planner.run, []

    def refused(self, *args):
        begins.append(self.instants[0])
        return replace(run(self, *args), failure=WholeBodyFailure("refused", self.instants[0], ""))

    monkeypatch.setattr(_Planner, "run", refused)
    result = _in_parts(planner, [0, 1, 2], 0.0, lambda _: None)
    assert result.failure is not None
    assert result.failure.reason == "refused"
    assert begins == [0.0] * (1 + len(SLOWER))
    assert result.motion.time[-1] == pytest.approx(INSTANTS[1])


def test_a_guide_through_another_posture_has_it_at_that_time_and_rests_there_still(standing):
    """What leads a part begins where the body is: the way from there does not jump to what was planned."""
    bent = standing.copy()
    bent[7:] += 0.3
    known = Guide(INSTANTS, np.array([standing, standing, bent]), ()).resting(INSTANTS[:2])
    away = standing.copy()
    away[7:] -= 0.1
    guide = known.through(INSTANTS[1], away)
    np.testing.assert_allclose(guide.at(INSTANTS), [standing, away, bent], atol=1e-12)
    near = guide.at(INSTANTS[1] + np.array([0.0, 1e-4]))
    assert np.abs(np.diff(near, axis=0)).max() < 1e-4 * 0.1  # no faster than 0.1 rad/s just after the rest
    planner = _Planner(
        BODY, Scene([]), still(standing), np.random.default_rng(0), WholeBodySettings(), known=known
    )
    np.testing.assert_allclose(planner.part(1, 2, (away, None)).known.at(INSTANTS), guide.at(INSTANTS))
    np.testing.assert_allclose(planner.part(0, 1, (None, away)).known.at(INSTANTS), known.at(INSTANTS))


def test_a_retimed_guide_has_its_postures_later_and_rests_where_it_did(standing):
    bent = standing.copy()
    bent[7:] += 0.3
    smooth = Guide(INSTANTS, np.array([standing, bent, standing]), ()).resting(INSTANTS[[0, 2]])
    later = smooth.retimed(INSTANTS, 2.0 * INSTANTS)
    time = np.linspace(0.0, INSTANTS[-1], 50)
    np.testing.assert_allclose(later.at(2.0 * time), smooth.at(time), atol=1e-9)
