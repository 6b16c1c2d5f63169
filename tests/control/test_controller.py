from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from manikin.body import Configuration
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.control import Controller, ControlSettings, SupportMode, TaskWeights
from manikin.control.controller import PRESSED, RAISED
from manikin.control.edge_forces import contact_geometry, points_along
from manikin.errors import InputError
from manikin.numerics.qp import QPSolution, solve_sparse_qp
from manikin.numerics.spatial import GRAVITY


def disturbed(body, seed, position=2e-3, speed=2e-2):
    rng = np.random.default_rng(seed)
    q = pin.integrate(body.pinocchio, body.standing_posture(), position * rng.normal(size=body.nv))
    return q, speed * rng.normal(size=body.nv)


def force_per_point(problem, solution, controller):
    """(point in the world, its segment's joint, force) of every contact point."""
    start = problem.acceleration(solution).size
    for loaded in problem.contacts:
        basis = loaded.basis
        edges = solution[start : start + basis.normal.size].reshape(-1, 4)
        start += basis.normal.size
        geometry = controller.geometry(basis.contact)
        number = 0
        for segment, points in geometry.patches:
            frame = problem.state.frames[f"segment/{segment}"]
            for point in points:
                # Rows of the edge map's force part are the same for every point.
                force = basis.wrench[:3, 4 * number : 4 * number + 4] @ edges[number]
                yield segment, frame.position + frame.rotation @ point, force, basis.contact
                number += 1


def solve(controller, q, v, time=0.0):
    output = controller.step(time, q, v)
    solution = controller._solver.solve(output.problem.program)
    return output, solution.x


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000))
def test_solution_obeys_the_equation_of_motion(body, still, schedule, seed):
    """Torques, accelerations and point forces satisfy Pinocchio's inverse dynamics to 1e-6."""
    controller = Controller(body, still, schedule)
    q, v = disturbed(body, seed)
    output, x = solve(controller, q, v)
    model, data = body.pinocchio, body.pinocchio.createData()
    pin.forwardKinematics(model, data, q)
    external = [pin.Force.Zero() for _ in range(model.njoints)]
    for segment, point, force, _ in force_per_point(output.problem, x, controller):
        joint = model.frames[body.segment_frame(segment)].parentJoint
        world = pin.Force(force, np.cross(point, force))
        external[joint] = external[joint] + data.oMi[joint].actInv(world)
    needed = pin.rnea(model, data, q, v, output.acceleration, pin.StdVec_Force(external))
    assert np.abs(needed[:6]).max() < 1e-6
    assert np.abs(needed[6:] - output.tau).max() < 1e-6


def test_torques_move_inertia_beside_that_of_the_body(body, still, schedule):
    """2 kg.m^2 more at the toes take twice their accelerations on top of inverse dynamics, to 1e-6 N.m."""
    added = np.array([2.0 if "toe" in name else 0.0 for name in body.joint_names])
    controller = Controller(body, still, schedule, joint_inertia=added)
    q, v = disturbed(body, 0)
    output, x = solve(controller, q, v)
    problem = output.problem
    forces = sum(
        loaded.basis.generalised @ x[part]
        for loaded, part in zip(problem.contacts, problem.variables, strict=True)
    )
    data = body.pinocchio.createData()
    needed = pin.rnea(body.pinocchio, data, q, v, output.acceleration) - forces
    assert np.abs(output.acceleration[6:][added > 0.0]).max() > 0.1
    assert output.tau == pytest.approx(needed[6:] + added * output.acceleration[6:], abs=1e-6)


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), speed=st.floats(0.0, 1.0))
def test_forces_stay_in_friction_cones_and_torques_within_limits(body, still, schedule, seed, speed):
    """Every point pushes, within its cone; torques stay within limits even when hit hard."""
    controller = Controller(body, still, schedule)
    q, v = disturbed(body, seed, speed=speed)
    output, x = solve(controller, q, v)
    assert np.all(output.tau >= body.torque_lower - 1e-3)
    assert np.all(output.tau <= body.torque_upper + 1e-3)
    for _, _, force, contact in force_per_point(output.problem, x, controller):
        normal = force @ contact.normal
        tangent = np.linalg.norm(force - normal * contact.normal)
        # The solver keeps constraints to 1e-6 relative to forces of 1e3 N.
        assert normal >= -1e-3
        assert tangent <= contact.friction * normal + 1e-3


def test_tasks_are_met_where_nothing_limits_them(body, still, schedule):
    """A body at rest on its plan wants no acceleration and gets next to none.

    The regularised forces take a little from the lightest task, the posture.
    """
    controller = Controller(body, still, schedule)
    output = controller.step(0.0, body.standing_posture(), np.zeros(body.nv))
    weight = np.array([output.wrenches[name][2] for name in output.wrenches]).sum()
    assert weight == pytest.approx(9.81 * body.mass, rel=1e-3)
    for task in output.problem.tasks:
        tolerance = 0.2 if task.name == "posture" else 0.02
        assert np.abs(task.residual(output.acceleration)).max() < tolerance


@pytest.mark.parametrize("inwards", [0.0, 30.0])
def test_contacts_carry_as_planned_what_the_motion_leaves_open(body, still, schedule, inwards):
    """Feet that stand may press against each other as they like: they do as the plan has them.

    Without planned forces they do as costs least, which is not that.
    """
    free = Controller(body, still, schedule).step(0.0, body.standing_posture(), np.zeros(body.nv)).wrenches
    planned = np.array([free[name] for name in still.contact_names])
    planned[:, 1] += np.where([name == "left_foot" for name in still.contact_names], -inwards, inwards)
    moving = replace(still, contact_force=np.tile(planned, (len(still.time), 1, 1)))
    controller = Controller(body, moving, schedule)
    output = controller.step(0.0, body.standing_posture(), np.zeros(body.nv))
    weights = controller.settings.weights
    share = weights.planned_force / (weights.planned_force + weights.force)
    assert share > 0.8
    for name, wanted in zip(still.contact_names, planned, strict=True):
        # The regularisation takes its share of the difference.
        between = free[name][:3] + share * (wanted[:3] - free[name][:3])
        assert output.wrenches[name][:3] == pytest.approx(between, abs=0.5)
    assert abs(free["left_foot"][1] - planned[still.contact_names.index("left_foot"), 1]) >= inwards - 1e-9


def test_com_feedback_is_realised(body, still, schedule):
    """A CoM that is 1 mm off is accelerated back by stiffness times error, within 3 %."""
    controller = Controller(body, still, schedule)
    q = body.standing_posture()
    shifted = pin.integrate(body.pinocchio, q, np.r_[1e-3, np.zeros(body.nv - 1)])
    output = controller.step(0.0, shifted, np.zeros(body.nv))
    task = next(task for task in output.problem.tasks if task.name == "com")
    assert task.target[0] == pytest.approx(-225.0 * 1e-3, rel=1e-6)
    assert task.matrix[0] @ output.acceleration == pytest.approx(-225.0 * 1e-3, rel=0.03)


def test_toes_are_followed_as_their_foot_is_in_flight(body, contacts, still):
    """Toes 0.05 rad off are turned back by the stiffness of a foot in flight times that.

    Followed as other joints are, they were 2.4 degrees down when their foot landed, and chattered.
    """
    phases = [Phase(Stance(contacts)), Phase(Stance(contacts[:1])), Phase(Stance(contacts))]
    schedule = ContactSchedule(StanceSequence(phases), [0.0, 0.3, 0.7, 1.0])
    controller = Controller(body, still, schedule)
    toes = body.joint_index("right_toe_extension")
    q = np.array(body.standing_posture())
    q[7 + toes] = 0.05
    output = controller.step(0.55, q, np.zeros(body.nv))
    assert output.supports["right_foot"].mode is SupportMode.SWING
    wanted = {task.name: task.target for task in output.problem.tasks}
    assert wanted["toes of right_foot"] == pytest.approx(-400.0 * 0.05)
    assert wanted["toes of left_foot"] == pytest.approx(0.0)
    # In flight nothing is in the way.
    assert output.acceleration[6 + toes] == pytest.approx(-20.0, rel=0.03)


def test_solvers_agree(body, still, schedule):
    """The interior-point method finds the torques of the active-set method, to its own tolerance."""
    output = Controller(body, still, schedule).step(0.0, *disturbed(body, 3))
    program = output.problem.program
    other = solve_sparse_qp(
        sparse.csc_array(program.hessian), program.gradient, sparse.csc_array(program.rows),
        program.rows_lower, program.rows_upper, (program.lower, program.upper), equalities=program.equalities,
    )  # fmt: skip
    assert other.solved
    assert not output.fallback
    assert np.abs(output.problem.torque(other.x) - output.tau).max() < 0.05


def test_same_steps_give_the_same_bits(body, still, schedule):
    """Two controllers that see the same states give identical torques."""
    runs = []
    for _ in range(2):
        controller = Controller(body, still, schedule)
        runs.append([controller.step(0.005 * k, *disturbed(body, k)).tau for k in range(10)])
    assert np.array_equal(runs[0], runs[1])


def test_without_contact_nothing_pushes_and_the_body_falls(body, still, schedule):
    """Feet that are felt to hang in the air carry nothing; the CoM falls with g."""
    controller = Controller(body, still, schedule)
    hanging = dict.fromkeys(("left_foot", "right_foot"), False)
    q, v = body.standing_posture(), np.zeros(body.nv)
    outputs = [controller.step(0.005 * k, q, v, hanging) for k in range(10)]
    assert outputs[0].supports["left_foot"].mode is SupportMode.STANCE
    last = outputs[-1]
    assert last.supports["left_foot"].mode is SupportMode.LANDING
    assert not last.wrenches
    com = next(task for task in last.problem.tasks if task.name == "com")
    assert com.matrix[2] @ last.acceleration == pytest.approx(-9.81, abs=1e-6)


class Failing:
    """A solver that finds nothing."""

    def solve(self, program):
        return QPSolution(np.zeros(len(program.gradient)), False, "asked to fail", 0)


def test_failed_program_falls_back_and_says_so(body, still, schedule):
    """First the joint bounds are dropped, then the previous torques are held."""
    controller = Controller(body, still, schedule)
    q, v = body.standing_posture(), np.zeros(body.nv)
    first = controller.step(0.0, q, v)
    controller._solver = Failing()
    second = controller.step(0.005, q, v)
    assert second.fallback.startswith("without joint bounds")
    assert np.allclose(second.tau, first.tau, atol=1e-6)
    controller._spare_solver = Failing()
    third = controller.step(0.010, q, v)
    assert third.fallback.startswith("previous torques")
    assert np.array_equal(third.tau, second.tau)


def test_angular_momentum_task_is_optional(body, still, schedule):
    """It is there exactly when it has a weight."""
    weights = TaskWeights(angular_momentum=1.0)
    plain = Controller(body, still, schedule)
    extra = Controller(body, still, schedule, ControlSettings(weights=weights))
    q, v = disturbed(body, 1)
    names = [{task.name for task in c.step(0.0, q, v).problem.tasks} for c in (plain, extra)]
    assert names[1] - names[0] == {"angular_momentum"}


def test_bad_input_is_refused(body, still, schedule):
    with pytest.raises(InputError, match="joint_damping"):
        Controller(body, still, schedule, joint_damping=[1.0])
    with pytest.raises(InputError, match="task weight 'com'"):
        TaskWeights(com=-1.0)


def test_a_tilted_seat_carries_on_its_low_side_and_turns_the_pelvis(body, contacts, still):
    """Points raised by more than 2 x RAISED get no force while it slides; the pelvis' own task gives way."""
    seat = sole("buttocks", (0.0, 0.0, 0.7), length=0.14, width=0.24, friction=0.4, settle=0.5)
    phases = [Phase(Stance(contacts)), Phase(Stance([*contacts, seat]))]
    controller = Controller(body, still, ContactSchedule(StanceSequence(phases), [0.0, 0.5, 1.0]))
    q = body.standing_posture()
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.2, 0.0, 0.0)).coeffs()
    before = controller.step(0.4, q, np.zeros(body.nv), {})
    assert "pelvis" in {task.name for task in before.problem.tasks}
    output, x = solve(controller, q, np.zeros(body.nv), 0.6)
    assert "pelvis" not in {task.name for task in output.problem.tasks}
    forces = [
        (point[2], np.linalg.norm(force))
        for _, point, force, contact in force_per_point(output.problem, x, controller)
        if contact.effector == "buttocks"
    ]
    lowest = min(height for height, _ in forces)
    raised = [force for height, force in forces if height > lowest + 2.0 * RAISED]
    assert len(raised) == 2
    assert max(raised) < 1e-9
    assert max(force for _, force in forces) > 1.0


def test_feet_that_are_points_turn_and_leave_the_body_free(on_points):
    """An insect beside its plan moves back over six points that stay where they are, to 1 % of the CoM.

    Held against turning as well, they would hold the body, and the program would move the points instead.
    """
    body, schedule, still = on_points
    controller = Controller(body, still, schedule)
    q = still.q[0].copy()
    q[0] -= 0.01
    output = controller.step(0.0, q, np.zeros(body.nv))
    moved = output.state.centroidal_map[:3] @ output.acceleration / output.state.mass
    tips = [
        frame.jacobian[:3] @ output.acceleration
        for name, frame in output.state.frames.items()
        if name in schedule.sequence.effectors
    ]
    assert moved[0] > 0.9 * controller.settings.impedances.com.stiffness * 0.01
    assert np.abs(tips).max() < 0.01 * moved[0]


def test_a_foot_carries_on_what_touches_where_it_stands(body, contacts, still):
    """A whole sole first, then one whose front hangs over an edge: no force acts beyond that edge."""
    left, right = contacts
    edge = [[0.02, 0.05], [-0.12, 0.05], [-0.12, -0.05], [0.02, -0.05]]
    over = sole(
        "left_foot", left.position, length=left.length, width=left.width, friction=0.7, polygon=edge
    )  # fmt: skip
    phases = [Phase(Stance(stance)) for stance in ([left, right], [right], [over, right])]
    controller = Controller(body, still, ContactSchedule(StanceSequence(phases), [0.0, 0.2, 0.4, 1.0]))
    q, v = body.standing_posture(), np.zeros(body.nv)
    farthest = {}
    for time in (0.1, 0.6):
        output, x = solve(controller, q, v, time)
        along = [
            point[0] - left.position[0]
            for _, point, _, contact in force_per_point(output.problem, x, controller)
            if contact.effector == "left_foot"
        ]
        farthest[time] = max(along)
    assert farthest[0.1] > 0.1
    assert farthest[0.6] <= 0.02


@pytest.mark.parametrize("middle", [0.0, 0.05])
def test_a_foot_on_a_rod_carries_at_a_line_of_its_own_segment(body, middle):
    """Wherever the rod is below the foot: a moment about the line, or force of the toes, is not there."""
    edge = [[x + middle, y] for x, y in ((0.007, 0.05), (-0.007, 0.05), (-0.007, -0.05), (0.007, -0.05))]
    rung = sole("left_foot", np.zeros(3), length=0.26, width=0.1, friction=0.7, polygon=edge)
    geometry = contact_geometry(body, rung, 0.01)
    assert [segment for segment, _ in geometry.patches] == ["left_foot"]
    assert points_along(body, geometry) == pytest.approx([middle, middle])


@pytest.mark.parametrize("pitch", [-0.2, 0.1])
def test_a_foot_that_tilts_on_a_rod_carries_where_it_has_rolled_to(body, contacts, still, pitch):
    """On a rod of 16 mm, 1.6 mm from where the sole lay flat at 0.1 rad: the force acts there."""
    _, right = contacts
    radius, half = 0.016, np.sqrt(0.0015 * (0.032 - 0.0015))
    edge = [[x, y] for x, y in ((half, 0.05), (-half, 0.05), (-half, -0.05), (half, -0.05))]
    q = body.standing_posture()
    q[7 + body.joint_index("left_ankle_dorsiflexion")] += pitch
    turn, origin = Configuration(body, q).effector_placement("left_foot")
    # Rolled to its tilt, the sole touches the rod's side, as far along the sole as around the rod.
    touching = origin + turn @ [-radius * pitch, 0.0, 0.0]
    top = touching - radius * turn[:, 2] + [0.0, 0.0, radius]
    rung = sole("left_foot", top, length=0.26, width=0.1, friction=0.7, polygon=edge)
    schedule = ContactSchedule(StanceSequence([Phase(Stance([rung, right]))]), [0.0, 1.0])
    output, _ = solve(Controller(body, still, schedule), q, np.zeros(body.nv), 0.5)
    (basis,) = (item.basis for item in output.problem.contacts if item.basis.contact is rung)
    force, moment = basis.wrench[:3], basis.wrench[3:]
    # About the line itself there is no moment along it.
    about = moment - np.cross(touching - origin, force.T).T
    assert np.abs(about[1]).max() < 1e-9
    planned = moment - np.cross(top - origin, force.T).T
    assert np.abs(planned[1]).max() > 0.5 * radius * abs(pitch)


def test_a_foot_carries_nothing_beyond_the_rung_below_its_middle(body):
    """A rung 8 cm deep ends before the toes, which carry nothing there."""
    edge = [[0.04, 0.05], [-0.04, 0.05], [-0.04, -0.05], [0.04, -0.05]]
    rung = sole("left_foot", np.zeros(3), length=0.26, width=0.1, friction=0.7, polygon=edge)
    geometry = contact_geometry(body, rung, 0.01)
    assert [segment for segment, _ in geometry.patches] == ["left_foot"]
    assert np.abs(points_along(body, geometry)).max() <= 0.03 + 1e-9


def test_no_point_of_a_human_on_points_is_let_go(body, on_three_points):
    """Where a body that rolls to one side is to be stopped, the third point presses with its least force."""
    schedule, plan = on_three_points
    v = np.zeros(body.nv)
    v[3] = 2.0
    output = Controller(body, plan, schedule).step(0.1, body.standing_posture(), v)
    weight = body.mass * GRAVITY
    # The solver keeps inequalities to a millionth of the weight.
    assert output.wrenches["left_wrist"][2] == pytest.approx(PRESSED * weight, abs=1e-6 * weight)
    assert min(wrench[2] for wrench in output.wrenches.values()) > (PRESSED - 1e-6) * weight
