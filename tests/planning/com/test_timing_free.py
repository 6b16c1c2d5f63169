"""The timing-free method on the scenarios of the thesis."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.com import (
    BentSurface,
    CentroidalProblem,
    GeometricConstraint,
    Weights,
    height_band,
    plan_com,
)
from manikin.planning.com.com_certificate import phase_margins


def peak_acceleration(trajectory) -> float:
    times = np.linspace(0.0, trajectory.duration, 2001)
    return float(np.linalg.norm(trajectory.acceleration(times), axis=1).max())


def test_platform_keeps_20_Nm_at_every_millisecond_within_5_s(planned):
    """[Qiu2012]_ 5.4.4: margin larger than 20 N.m, height band 5.29, minimum durations."""
    assert planned.succeeded
    assert planned.d_min >= 20.0
    assert planned.key_instants[-1] <= 5.0
    residuals = planned.residuals()
    assert residuals.within(1e-6)
    assert residuals.min_margin == planned.d_min


def test_platform_has_the_published_number_of_control_points(planned):
    """Degree 5 and 7 phases: 12 control points, 18 knots, internal knots at the key instants."""
    spline = planned.trajectory.spline
    assert spline.control_points.shape == (12, 3)
    assert len(spline.knots) == 18
    instants = planned.key_instants
    assert np.allclose(spline.knots[6:12], instants[1:-1] / instants[-1], atol=1e-15)


def test_acceleration_is_continuous_across_the_key_instants(planned):
    """Simple knots: derivatives up to the fourth are continuous."""
    trajectory = planned.trajectory
    for instant in planned.key_instants[1:-1]:
        before, after = trajectory.jerk(instant - 1e-9), trajectory.jerk(instant + 1e-9)
        # Two nanoseconds of a fourth derivative below 1e4.
        assert np.allclose(before, after, atol=1e-4)


def test_limiting_contact_is_one_of_the_limiting_phase(planned):
    stance = planned.problem.sequence[planned.limiting_phase].stance
    assert planned.limiting_contact in stance.effectors
    assert planned.limiting.margin == pytest.approx(planned.d_min)


def test_same_problem_gives_the_same_bits(platform, planned):
    again = plan_com(platform())
    assert np.array_equal(again.trajectory.spline.control_points, planned.trajectory.spline.control_points)
    assert np.array_equal(again.key_instants, planned.key_instants)
    assert again.d_min == planned.d_min


def test_rest_at_both_ends_can_include_the_acceleration(platform):
    rest = (0.0, 0.0, 0.0)
    result = plan_com(platform(start_acceleration=rest, goal_acceleration=rest))
    assert result.succeeded
    assert np.abs(result.trajectory.acceleration([0.0, result.trajectory.duration])).max() < 1e-9


def test_weights_trade_margin_against_acceleration(platform, planned):
    """A heavier smoothness gives a gentler motion with a smaller margin, still above the required."""
    gentle = Weights(
        margin=0.01, smoothness=1.0, duration=0.0,
        velocity=(0, 0, 0), acceleration=(1, 1, 1), jerk=(0.01, 0.01, 0.01),
    )  # fmt: skip
    result = plan_com(platform(weights=gentle, max_duration=4.8))
    assert result.succeeded
    assert 20.0 <= result.d_min < planned.d_min
    assert peak_acceleration(result.trajectory) < 0.7 * peak_acceleration(planned.trajectory)


def test_duration_weight_shortens_the_motion(platform, planned):
    result = plan_com(platform(weights=Weights(margin=0.1, smoothness=1.0, duration=20.0)))
    assert result.succeeded
    assert result.key_instants[-1] < planned.key_instants[-1] - 0.3


@pytest.mark.parametrize(
    ("stature", "mass", "required"),
    [(1.60, 58.0, 13.0), pytest.param(1.90, 95.0, 20.0, marks=pytest.mark.long)],
)
def test_other_bodies_find_their_way(platform, stature, mass, required):
    """Heights above the supports and reach scale with the stature.

    A 58 kg, 1.60 m body reaches about 17 N.m: its weight and its reach are smaller.
    """
    scale = stature / 1.75

    def level(x):
        # Supports rise from 0 to 0.2 m between x = 0.1 and x = 0.7.
        return 0.1 + 0.1 * np.tanh(8.0 * (x - 0.35))

    def surface(constant):
        def height(x, y, z):  # noqa: ARG001
            published = constant - 0.08 * np.arctan(10.0 * (x - 0.2)) / np.pi
            return level(x) + scale * (published - level(x))

        return height

    result = plan_com(
        platform(
            mass=mass,
            start_com=(0.0, 0.0, level(0.0) + scale * (0.92 - level(0.0))),
            goal_com=(0.6, 0.65, level(0.6) + scale * (0.86 - level(0.6))),
            geometric=height_band(surface(0.89), surface(0.91)),
            support_distance=scale,
            required_margin=required,
        )
    )
    assert result.succeeded, result.failure
    assert result.residuals().within(1e-6)


def test_car_reaches_the_published_margin_with_a_free_final_velocity(car_stances):
    """Table 7.6: d_min 19.4 N.m below the radius of 32.63 N.m, minimum durations of Table 7.5."""
    result = plan_com(
        CentroidalProblem(
            79.0, car_stances, (0.235, -1.0112, 0.4659), (-0.045, -0.1463, 0.21),
            goal_velocity=None, support_distance=1.08, required_margin=19.4,
            margin_space="wrench_about_origin",
        )
    )  # fmt: skip
    assert result.succeeded
    assert 19.4 <= result.d_min <= 32.63
    assert np.linalg.norm(result.trajectory.velocity(result.trajectory.duration)) > 0.1


def walk(steps: int, friction: float = 0.7, slope: float = 0.0) -> StanceSequence:
    """Feet of a straight walk along x, on a plane that climbs with ``slope``."""
    normal = (-np.sin(slope), 0.0, np.cos(slope))

    def contact(name: str, x: float, y: float):
        return sole(
            name, (x * np.cos(slope), y, x * np.sin(slope)),
            length=0.24, width=0.12, friction=friction, normal=normal,
        )  # fmt: skip

    feet = {"left_foot": contact("left_foot", 0.0, 0.1), "right_foot": contact("right_foot", 0.0, -0.1)}
    phases = [Phase(Stance(tuple(feet.values()), 1500.0), 0.15)]
    for step in range(steps):
        name, other, side = (
            ("left_foot", "right_foot", 0.1) if step % 2 == 0 else ("right_foot", "left_foot", -0.1)
        )
        phases.append(Phase(Stance([feet[other]], 1500.0), 0.4))
        x = 0.35 * (step + 1) if step < steps - 1 else 0.35 * step
        feet[name] = contact(name, x, side)
        phases.append(Phase(Stance(tuple(feet.values()), 1500.0), 0.15))
    return StanceSequence(phases)


@pytest.mark.parametrize("slope", [0.0, np.deg2rad(15.0)])
def test_biped_walks_four_steps_on_flat_ground_and_on_a_ramp(slope):
    """[Qiu2012]_ 5.4.4: 70 kg, degree 4, nine phases, 13 control points; ramp of 15 degrees."""
    up = 0.96
    goal_x = 1.05
    result = plan_com(
        CentroidalProblem(
            70.0, walk(4, slope=slope), (0.0, 0.0, up),
            (goal_x * np.cos(slope), 0.0, goal_x * np.sin(slope) + up),
            degree=4, support_distance=1.15, required_margin=10.0, max_duration=6.0,
        )
    )  # fmt: skip
    assert result.succeeded, result.failure
    assert result.trajectory.spline.control_points.shape == (13, 3)
    assert result.residuals().within(1e-6)


def test_force_space_plans_a_margin_in_newtons(platform):
    """The certificate measures the same margin that the programme maximised."""
    result = plan_com(platform(margin_space="force", required_margin=20.0))
    assert result.succeeded, result.failure
    margins = phase_margins(result.problem, result.trajectory, result.polytopes)
    assert result.d_min == min(float(m.min()) for m in margins)
    assert result.residuals()["balance margin"].unit == "N"


def test_a_single_phase_needs_no_internal_knot(platform_stances):
    """Shifting the weight on two feet: degree + 1 control points, no intersection to limit it."""
    sequence = StanceSequence([Phase(platform_stances[0].stance, 0.5, 1.0)])
    result = plan_com(CentroidalProblem(79.0, sequence, (-0.05, 0, 0.92), (0.05, 0, 0.9), max_duration=2.0))
    assert result.succeeded
    assert result.trajectory.spline.control_points.shape == (6, 3)
    assert result.feasibility_radius == np.inf
    assert 0.5 <= result.trajectory.duration <= 1.0


@pytest.mark.parametrize(
    ("changes", "requirement", "words"),
    [
        ({"required_margin": 60.0}, "balance margin", "required 60.00 N.m"),
        pytest.param({"max_duration": 3.0}, "balance margin", "largest margin found", marks=pytest.mark.long),
        pytest.param({"support_distance": 0.94}, "balance margin", "phase", marks=pytest.mark.long),
    ],
)
def test_what_the_optimisation_cannot_reach_is_explained(platform, changes, requirement, words):
    """The largest margin that was found is named with its phase, instant and contact."""
    result = plan_com(platform(**changes))
    assert not result.succeeded
    assert result.trajectory is None
    assert result.failure.requirement == requirement
    assert words in result.failure.reason
    assert result.failure.phase is not None
    assert result.failure.time is not None
    assert result.failure.where in ("left_foot", "right_foot")
    with pytest.raises(ValueError, match="no trajectory"):
        result.residuals()


def test_contradicting_geometric_constraints_are_named(platform):
    """The way leads through x = 0.3, where a second constraint wants the CoM above the band."""
    band = platform().geometric
    hump = GeometricConstraint("hump", lambda x, y, z: 1.2 - 40.0 * (x - 0.3) ** 2 - z + 0.0 * y)
    result = plan_com(platform(geometric=(*band, hump), required_margin=0.0), guesses=1)
    assert not result.succeeded
    assert result.failure.requirement in ("hump", "height below the upper surface")
    assert "no trajectory found" in result.failure.reason
    assert result.certificate.largest.requirement == result.failure.requirement


def test_maximum_phase_durations_are_kept(platform_stances):
    phases = [Phase(p.stance, p.min_duration, p.min_duration + 0.4) for p in platform_stances]
    result = plan_com(
        CentroidalProblem(79.0, StanceSequence(phases), (0, 0, 0.92), (0.6, 0.65, 0.86), required_margin=5.0)
    )
    assert result.succeeded
    durations = result.trajectory.schedule.durations
    assert np.all(durations <= result.problem.max_durations + 1e-9)
    assert np.all(durations >= result.problem.min_durations - 1e-9)


def test_a_start_on_the_edge_of_the_height_band_is_no_obstacle():
    """The planner keeps 0.3 mm from the band, but not where the problem itself begins closer to it."""
    from manikin.scenarios import load_scenario

    scenario = load_scenario("platform")
    problem = scenario.build_centroidal_problem()
    x, y, _ = problem.start_com
    edge = float(scenario.height_band.lower(x, y, 0.0)) + 1e-5
    changed = dict(vars(problem), start_com=np.array([x, y, edge]))
    arguments = {key: changed.pop(key) for key in ("mass", "sequence", "start_com", "goal_com")}
    result = plan_com(CentroidalProblem(**arguments, **changed))
    assert result.succeeded, result.failure
    assert result.d_min >= 20.0


def moved(problem: CentroidalProblem, turn, shift) -> CentroidalProblem:
    """The same problem elsewhere and turned about the vertical; its constraints look at heights alone."""

    def contact(item):
        rotation = turn @ item.rotation_contact_to_world
        return replace(item, position=turn @ item.position + shift, rotation_contact_to_world=rotation)

    phases = [
        replace(phase, stance=phase.stance.with_contacts([contact(item) for item in phase.stance]))
        for phase in problem.sequence
    ]
    ends = {name: turn @ getattr(problem, name) + shift for name in ("start_com", "goal_com")}
    return CentroidalProblem(
        problem.mass, StanceSequence(phases), **ends, required_margin=14.7, support_distance=1.0,
        geometric=height_band(BentSurface(0.8, 0.0, 1.0, 0.0), BentSurface(1.0, 0.0, 1.0, 0.0)),
        max_duration=5.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def at_origin(platform):
    return plan_com(moved(platform(), np.eye(3), np.zeros(3)))


@pytest.mark.parametrize("yaw", [0.0, 37.0])
def test_a_plan_does_not_depend_on_where_the_scene_stands(platform, at_origin, yaw):
    """Durations, margins and path of the platform's problem moved by (10, -7, 0) m and turned.

    Moved alone, the programme has the same numbers but for rounding (5e-13 of the margin). Turned, its
    iterates have other components and end elsewhere within the solver's tolerance (3e-8).
    """
    tolerance = 1e-6
    turn, shift = rotation_from_yaw(np.deg2rad(yaw)), np.array([10.0, -7.0, 0.0])
    first, second = at_origin, plan_com(moved(platform(), turn, shift))
    assert first.succeeded, first.failure
    assert second.succeeded, second.failure
    assert second.d_min == pytest.approx(first.d_min, rel=tolerance)
    assert second.feasibility_radius == pytest.approx(first.feasibility_radius, rel=1e-6)
    np.testing.assert_allclose(second.key_instants, first.key_instants, rtol=tolerance)
    share = np.linspace(0.0, 1.0, 101)
    path = first.trajectory.position(share * first.trajectory.duration) @ turn.T + shift
    np.testing.assert_allclose(
        second.trajectory.position(share * second.trajectory.duration), path, atol=tolerance
    )
