"""Treads shorter than a sole: supports that hang over an edge, from the file to the plan of the CoM."""

import numpy as np
import pytest
from scipy.optimize import linprog

from manikin.balance.motion_forces import _force_points
from manikin.contact import sole
from manikin.control.edge_forces import contact_geometry, points_along
from manikin.errors import ScenarioError
from manikin.numerics.polytope import signed_distance
from manikin.numerics.spatial import GRAVITY
from manikin.planning.com import plan_com
from manikin.scenarios import Scenario, load_scenario
from manikin.scenarios.world import stance_sequence

TREAD = 0.25
RISE = 0.15
SOLE = np.array([[0.14, 0.06], [0.14, -0.06], [-0.14, -0.06], [-0.14, 0.06]])


def supports(polygon):
    """A step of one tread onto a landing: the foot on the tread has its toes 15 mm before the riser."""
    tread = {"position": [0.395, -0.09, RISE]} | ({} if polygon is None else {"polygon": polygon})
    return {
        "friction": 0.7,
        "sole": {"length_m": 0.28, "width_m": 0.12},
        "planning_sole": {"length_m": 0.22, "width_m": 0.09},
        "phases": [
            {"left_foot": {"position": [0.0, 0.09, 0.0]}, "right_foot": {"position": [0.0, -0.09, 0.0]}},
            {"left_foot": "same", "min_duration_s": 0.6},
            {"left_foot": "same", "right_foot": tread, "min_duration_s": 0.3},
            {"right_foot": "same", "min_duration_s": 0.6},
            {"left_foot": {"position": [0.75, 0.09, 2 * RISE]}, "right_foot": "same", "min_duration_s": 0.3},
        ],
    }


def stair_scenario(polygon) -> Scenario:
    base = load_scenario("stairs")
    return base.replaced(
        scene=[
            {"name": "tread", "box": [TREAD, 1.2, RISE], "position": [0.30 + TREAD / 2, 0.0, RISE / 2]},
            {"name": "landing", "box": [1.0, 1.2, 2 * RISE], "position": [0.55 + 0.5, 0.0, RISE]},
        ],
        contacts=None,
        supports=supports(polygon),
        task={"start": {"com": [0.0, 0.0, 0.96]}, "goal": {"com": [0.6, 0.02, 0.93 + 1.6 * RISE]}},
        com_constraints=[{"max_support_distance_m": 1.15}],
    )


@pytest.fixture(scope="module")
def scenario():
    plain = stair_scenario(None)
    contact = stance_sequence(plain)[2].stance["right_foot"]
    polygon, share = plain.build_scene().contact_polygon(contact)
    assert share == pytest.approx((0.535 - 0.30) / 0.28)
    return stair_scenario(polygon.tolist())


def test_a_sole_longer_than_its_tread_is_refused_whole_and_accepted_in_part(scenario):
    with pytest.raises(ScenarioError, match=r"45.0 mm beyond its edge.*84 % of it that does, polygon: "):
        stair_scenario(None).check_contacts(stair_scenario(None).build_scene())
    scenario.check_contacts(scenario.build_scene())
    again = type(scenario)(scenario.file, "again", scenario.folder, {})
    own, other = (stance_sequence(item)[2].stance["right_foot"] for item in (scenario, again))
    assert np.array_equal(own.points, other.points)


def test_what_planning_balances_on_is_inside_what_touches(scenario):
    real = stance_sequence(scenario)[2].stance["right_foot"]
    planned = stance_sequence(scenario, planning=True)[2].stance["right_foot"]
    shares = np.ptp(planned.points, axis=0)[:2] / np.ptp(real.points, axis=0)[:2]
    assert np.allclose(shares, [0.22 / 0.28, 0.09 / 0.12])
    assert np.allclose(planned.centre, real.centre)
    assert np.array_equal(planned.position, real.position)


@pytest.mark.parametrize(
    ("low", "high", "segments"),
    [(-0.095, 0.14, ["left_foot", "left_toes"]), (-0.14, 0.03, ["left_foot"]), (0.08, 0.13, ["left_toes"])],
)
def test_control_and_force_sharing_press_only_on_what_touches(scenario, low, high, segments):
    """Points of a heel or toes over an edge carry nothing; the toes' part is that before their hinge."""
    body = scenario.build_body()
    ring = [(low, -0.06), (high, -0.06), (high, 0.06), (low, 0.06)]
    contact = sole("left_foot", (0, 0, 0), length=0.28, width=0.12, friction=0.7, polygon=ring)
    geometry = contact_geometry(body, contact, inset=0.01)
    assert [segment for segment, _ in geometry.patches] == segments
    along = points_along(body, geometry)
    assert along.min() == pytest.approx(low + 0.01)
    assert along.max() == pytest.approx(high - 0.01)
    points = _force_points(body, contact)
    assert signed_distance(points[:, :2], contact.outline).min() >= -1e-12
    assert len(points) == 4 + 2 * (len(segments) == 2)


def test_the_centre_of_mass_is_planned_over_what_touches(scenario):
    """Forces at corners of soles, cut at the tread's edge by hand, supply every sample of the plan."""
    result = plan_com(scenario.build_centroidal_problem())
    assert result.succeeded
    trajectory = result.trajectory
    schedule = trajectory.schedule
    times = np.linspace(schedule.instants[0], schedule.instants[-1], 80)
    com, acceleration = (
        np.array(list(map(f, times))) for f in (trajectory.position, trajectory.acceleration)
    )
    edges = np.array([[x, y, 1.0] for x in (0.7, -0.7) for y in (0.7, -0.7)])
    alone = 0
    for time, place, second in zip(times, com, acceleration, strict=True):
        force = scenario.mass * (second + np.array([0.0, 0.0, GRAVITY]))
        stance = schedule.stance_at(time)
        generators = []
        for contact in stance:
            # The soles head along the task's x, which is the world's here.
            corners = contact.position[:2] + SOLE
            if abs(contact.position[2] - RISE) < 1e-9:
                corners[:, 0] = np.clip(corners[:, 0], contact.position[0] - 0.395 + 0.30, None)
            for x, y in corners:
                point = np.array([x, y, contact.position[2]]) - place
                generators += [np.concatenate([edge, np.cross(point, edge)]) for edge in edges]
        wrench = np.concatenate([force, np.zeros(3)])
        found = linprog(np.zeros(len(generators)), A_eq=np.transpose(generators), b_eq=wrench)
        assert found.status == 0
        alone += len(stance) == 1 and abs(next(iter(stance)).position[2] - RISE) < 1e-9
    assert alone > 5
