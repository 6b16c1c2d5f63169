"""Walking under directives and along paths."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.errors import InputError
from manikin.motion.file import MotionFile, read_motions, write_motions
from manikin.walking import walking_path
from manikin.walking.gait.follow_path import ACCELERATION, WalkController, stance_slides, walk_along

RATE = 60.0


def drive(controller, *orders):
    """Frames of directives with durations [s]."""
    return [controller.step(1.0 / RATE, order) for order, time in orders for _ in range(round(time * RATE))]


def lowest_of_feet(body, q):
    """(n,) height of the lowest corner of the soles, toes included, by Pinocchio [m]."""
    data, heights = body.pinocchio.createData(), []
    for posture in q:
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        lowest = []
        for side in ("left", "right"):
            foot, toes = (data.oMf[body.segment_frame(f"{side}_{name}")] for name in ("foot", "toes"))
            sole, ball = body.effector(f"{side}_foot").translation, body.segment(f"{side}_toes").origin
            heel = sole[0] - 0.5 * body.sole_length
            tip = heel + body.sole_length - ball[0]
            for half in (-0.5 * body.sole_width, 0.5 * body.sole_width):
                lowest += [foot.act(np.array([x, half, sole[2]]))[2] for x in (heel, ball[0])]
                lowest.append(toes.act(np.array([tip, half, sole[2] - ball[2]]))[2])
        heights.append(min(lowest))
    return np.array(heights)


def test_standing_is_still():
    frames = drive(WalkController(place=(1.0, 2.0, 0.5)), ((0.0, 0.0, 0.0), 1.0))
    assert np.ptp([f.q for f in frames], axis=0).max() < 1e-12
    np.testing.assert_allclose(frames[-1].place, [1.0, 2.0, 0.5])
    assert frames[-1].support == (True, True)
    assert frames[-1].notice is None


def test_directives_are_walked():
    """Velocities are reached with the accelerations allowed, feet do not slide, it ends standing."""
    controller = WalkController()
    orders = [((1.2, 0.0, 0.0), 3.0), ((1.0, 0.0, 0.5), 2.0), ((0.3, 0.0, 0.0), 2.0), ((0.0, 0.4, 0.0), 3.0),
              ((0.0, 0.0, 1.2), 2.0), ((-0.6, 0.0, 0.0), 3.0), ((0.0, 0.0, 0.0), 3.0)]  # fmt: skip
    frames = drive(controller, *orders)
    q, velocity = np.array([f.q for f in frames]), np.array([f.velocity for f in frames])
    steps = np.abs(np.diff(velocity, axis=0)) * RATE
    assert np.all(steps <= np.array(ACCELERATION) + 1e-9)
    ends = np.cumsum([round(time * RATE) for _, time in orders]) - 1
    np.testing.assert_allclose(velocity[ends], [order for order, _ in orders], atol=1e-9)
    support = np.array([f.support for f in frames]).T
    slides = stance_slides(controller.body, q, support)
    assert len(slides) > 20
    assert np.sort(slides)[-2] < 0.005
    assert slides.max() < 0.01
    assert lowest_of_feet(controller.body, q).min() > -0.02
    # It ends as it began: standing, feet side by side.
    first = drive(WalkController(), ((0.0, 0.0, 0.0), 0.1))[-1]
    np.testing.assert_allclose(q[-1, 7:], first.q[7:], atol=0.05)
    assert np.ptp(q[-20:], axis=0).max() < 1e-9


def test_phase_goes_on():
    """P + dt / T at every step, whatever the directive does; the posture makes no leap."""
    controller = WalkController()
    frames = drive(controller, ((1.2, 0.0, 0.0), 2.0), ((2.5, 0.0, 0.0), 2.0), ((0.8, 0.0, -0.8), 2.0))
    phase = np.array([f.phase for f in frames])
    step = np.diff(phase) % 1.0
    assert step.min() > 1.0 / (RATE * 1.5)
    assert step.max() < 1.0 / (RATE * 0.4)
    q = np.array([f.q for f in frames])
    assert np.degrees(np.abs(np.diff(q[:, 7:], axis=0)).max()) < 30.0


def test_beyond_the_library_there_is_a_notice():
    frame = WalkController().step(0.01, (30.0, 0.0, 0.0))
    assert frame.notice is not None
    assert "beyond the motion library; nearest: 4." in frame.notice
    assert "\n" not in frame.notice


@pytest.mark.parametrize(
    ("dt", "directive"),
    [(0.0, (1, 0, 0)), (1.0, (1, 0, 0)), (np.nan, (1, 0, 0)), (0.01, (1, 0)), (0.01, (np.inf, 0, 0)),
     (0.01, "fast")],
)  # fmt: skip
def test_bad_directives(dt, directive):
    with pytest.raises(InputError):
        WalkController().step(dt, directive)


def test_bad_walkers():
    with pytest.raises(InputError, match="acceleration"):
        WalkController(acceleration=(1.0, -1.0, 1.0))
    with pytest.raises(InputError, match="place"):
        WalkController(place=(0.0, 0.0))


@pytest.mark.parametrize("goal", [(4.0, 0.0, 0.0), (3.0, 3.0, np.pi / 2), (0.0, 1.0, 0.0), (2.0, -1.0, 0.0)])
def test_walking_along_a_path(goal):
    """From standing to standing along the path: feet in place, on the floor, joints within the limits."""
    path = walking_path((0.0, 0.0, 0.0), goal, max_speed=1.4)
    found = walk_along(path)
    assert found.slides.max() < 0.005
    assert found.slides_before.max() > found.slides.max()
    assert np.all((found.q[:, 7:] >= found.body.lower) & (found.q[:, 7:] <= found.body.upper))
    assert lowest_of_feet(found.body, found.q).min() > -0.02
    assert found.support[[0, -1]].any(axis=1).all()
    np.testing.assert_allclose(found.q[-1, 7:], found.q[0, 7:], atol=1e-6)
    np.testing.assert_allclose(found.place[-1], [goal[0], goal[1], found.place[-1, 2]], atol=1e-3)
    # The pelvis sways around the path.
    assert np.hypot(*(found.q[:, :2] - found.place[:, :2]).T).max() < 0.12


def test_a_walk_as_a_motion():
    path = walking_path((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), max_speed=1.4)
    tall = human(1.9)
    found = walk_along(path, tall)
    motion = found.motion
    assert motion.contact_names == ("left_foot", "right_foot")
    speed = np.gradient(motion.com[:, 0], motion.time)
    np.testing.assert_allclose(
        np.trapezoid(speed, motion.time), motion.com[-1, 0] - motion.com[0, 0], atol=1e-2
    )
    assert motion.com[-1, 0] == pytest.approx(2.0, abs=0.1)
    body_velocity = motion.v[:, 0]
    assert body_velocity.max() == pytest.approx(path.velocity[:, 0].max(), rel=0.35)
    assert np.isnan(motion.margin).all()


def test_a_path_beyond_the_library_has_a_notice():
    """Two metres straight back, by a turn on the way that nobody was recorded to make."""
    path = walking_path((0.0, 0.0, 0.0), (-2.0, 0.0, 0.0), max_speed=1.4)
    found = walk_along(path)
    assert found.slides.max() < 0.005
    assert found.outside.any()
    assert found.notice is not None
    assert "beyond the motion library" in found.notice
    assert walk_along(walking_path((0.0, 0.0, 0.0), (2.0, 0.0, 0.0))).notice is None


def test_a_walk_can_be_kept_in_a_motion_file(tmp_path):
    walk = walk_along(walking_path((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    write_motions(tmp_path / "motion.h5", MotionFile(planned=walk.motion, body=walk.body))
    found = read_motions(tmp_path / "motion.h5").planned
    np.testing.assert_array_equal(found.q, walk.q)
    np.testing.assert_array_equal(found.support, walk.support)


def test_bad_paths():
    path = walking_path((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="WalkingPath"):
        walk_along([(0, 0), (1, 0)])
    with pytest.raises(InputError, match="rate"):
        walk_along(path, rate=1.0)
