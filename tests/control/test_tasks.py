from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.balance.friction import edges_in_world
from manikin.contact import grasp, sole
from manikin.control.build_qp import JointBounds, joint_acceleration_bounds
from manikin.control.dynamics import Dynamics
from manikin.control.edge_forces import contact_force_basis, contact_geometry
from manikin.control.reference import Reference


def frames_of(body):
    segments = {f"segment/{name}": body.segment_frame(name) for name in ("left_foot", "left_toes")}
    return {**segments, **{name: body.effector_frame(name) for name in ("left_foot", "right_hand")}}


def state_at(body, seed):
    rng = np.random.default_rng(seed)
    q = pin.integrate(body.pinocchio, body.standing_posture(), 0.2 * rng.normal(size=body.nv))
    return q, rng.normal(size=body.nv), rng.normal(size=body.nv)


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000))
def test_jacobian_and_drift_give_the_acceleration(body, seed):
    """``J a + drift`` is the second derivative of a frame and of the CoM along a motion."""
    q, v, a = state_at(body, seed)
    dynamics = Dynamics(body, frames_of(body))
    state = dynamics.evaluate(q, v)
    h, model = 1e-5, body.pinocchio

    def rates(t):
        # q(t) = q + v t + a t^2 / 2 on the group, to second order; v(t) = v + a t.
        later = dynamics.evaluate(pin.integrate(model, q, t * v + 0.5 * t * t * a), v + t * a)
        return later.frames["left_foot"].twist, later.momentum

    (twist_after, momentum_after), (twist_before, momentum_before) = rates(h), rates(-h)
    frame = state.frames["left_foot"]
    # Central differences at 1e-5: truncation 1e-8, rounding 1e-16 * 1e3 / 1e-5 = 1e-8.
    assert np.allclose(frame.jacobian @ a + frame.drift, (twist_after - twist_before) / (2 * h), atol=1e-5)
    assert np.allclose(
        state.centroidal_map @ a + state.momentum_drift,
        (momentum_after - momentum_before) / (2 * h),
        atol=1e-3,
    )


def test_dynamics_matches_inverse_dynamics(body):
    """``M a + bias`` is Pinocchio's inverse dynamics; ``J v`` is the twist."""
    q, v, a = state_at(body, 5)
    state = Dynamics(body, frames_of(body)).evaluate(q, v)
    expected = pin.rnea(body.pinocchio, body.pinocchio.createData(), q, v, a)
    assert np.allclose(state.mass_matrix @ a + state.bias, expected, atol=1e-9)
    frame = state.frames["right_hand"]
    assert np.allclose(frame.jacobian @ v, frame.twist, atol=1e-12)


@given(mu=st.floats(0.05, 1.5), seed=st.integers(0, 1000), model=st.sampled_from(["inner", "cone"]))
def test_pyramid_edges_lie_on_the_friction_cone(mu, seed, model):
    """Unit normal force, tangential part mu: the pyramids inside the cone, for any orientation."""
    rotation = pin.exp3(np.random.default_rng(seed).normal(size=3))
    contact = sole("left_foot", (0, 0, 0), length=0.2, width=0.1, friction=mu, rotation=rotation)
    edges = edges_in_world(contact, friction_model=model)
    assert np.allclose(edges @ contact.normal, 1.0)
    assert np.allclose(np.linalg.norm(edges - contact.normal, axis=1), mu)


def test_sole_points_are_shared_between_foot_and_toes(body, contacts):
    """Heel and toe-hinge points belong to the foot, tips to the toes, all inside the sole."""
    geometry = contact_geometry(body, contacts[0], inset=0.01)
    assert [segment for segment, _ in geometry.patches] == ["left_foot", "left_toes"]
    q = body.standing_posture()
    state = Dynamics(body, frames_of(body)).evaluate(q, np.zeros(body.nv))
    frames = state.frames
    points = np.concatenate([
        frames[f"segment/{name}"].position + local @ frames[f"segment/{name}"].rotation.T
        for name, local in geometry.patches
    ])  # fmt: skip
    local = points - contacts[0].position
    assert np.abs(points[:, 2]).max() < 1e-9
    assert np.ptp(local[:, 0]) == pytest.approx(body.sole_length - 0.02)
    assert np.abs(local[:, 1]).max() == pytest.approx(body.sole_width / 2 - 0.01)


def test_force_maps_have_the_same_power(body, contacts):
    """Generalised force times velocity is the power of the wrench at a rigid foot."""
    q, _, _ = state_at(body, 2)
    v = np.random.default_rng(1).normal(size=body.nv)
    v[6 + body.joint_index("left_toe_extension")] = 0.0
    state = Dynamics(body, frames_of(body)).evaluate(q, v)
    basis = contact_force_basis(contacts[0], contact_geometry(body, contacts[0], 0.01), state)
    assert np.allclose(basis.generalised.T @ v, basis.wrench.T @ state.frames["left_foot"].twist)


def test_grasp_forces_are_bounded_along_world_axes(body):
    """A grasp has three forces, and three moments where it can hold them."""
    q, v, _ = state_at(body, 2)
    state = Dynamics(body, frames_of(body)).evaluate(q, v)
    for moment, size in ((0.0, 3), (5.0, 6)):
        contact = grasp("right_hand", (0, 0, 0), max_force=80.0, max_moment=moment)
        basis = contact_force_basis(contact, contact_geometry(body, contact, 0.01), state)
        assert basis.generalised.shape == (body.nv, size)
        assert np.allclose(basis.upper, [80.0] * 3 + [5.0] * (size - 3))
        assert np.allclose(basis.lower, -basis.upper)


@given(angle=st.floats(-2, 2), speed=st.floats(-20, 20))
def test_acceleration_bounds_are_never_contradictory(angle, speed):
    """Lower never exceeds upper, and a joint inside its range is sent to neither end."""
    one, coming = np.ones(1), angle + 0.05 * speed
    least, greatest = joint_acceleration_bounds(
        coming * one, speed * one, 0.0 * one, -one, one, 10.0 * one, 0.05, 500.0
    )
    assert least <= greatest
    if abs(coming) < 1 and abs(speed) < 10:
        assert least <= 0.0 <= greatest


@pytest.mark.parametrize("away", [0.0, 0.03])
def test_a_joint_may_follow_a_quick_plan_to_the_end_of_its_range_and_is_stopped_off_it(body, away):
    """20 degrees in 0.15 s by minimum jerk, to 1 degree from the end: 90 rad/s^2 in two directions.

    From its speed alone it would be expected beyond its range, and be held back by more than 20 rad/s^2.
    """
    joint, horizon, duration = body.joint_index("left_ankle_dorsiflexion"), 0.05, 0.15
    time, amplitude = np.linspace(-0.05, 0.25, 601), np.radians(20.0)
    share = np.clip(time / duration, 0.0, 1.0)
    q, v, a = (np.zeros((len(time), body.nv + 1 - k)) for k in (0, 1, 1))
    q[:, 6] = 1.0
    q[:, 7 + joint] = (
        body.upper[joint] - np.radians(21.0) + amplitude * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    )
    v[:, 6 + joint] = amplitude * 30.0 * share**2 * (1.0 - share) ** 2 / duration
    a[:, 6 + joint] = amplitude * 60.0 * share * (1.0 - share) * (1.0 - 2.0 * share) / duration**2
    within, held_back = True, 0.0
    for k in np.flatnonzero((time >= 0.0) & (time <= duration)).tolist():
        later = k + round(horizon / 5e-4)
        planned = SimpleNamespace(q=q[k], v=v[k], a=a[k], later=(q[later, 7:], v[later, 6:]))
        there = q[k].copy()
        there[7 + joint] += away
        state = SimpleNamespace(q=there, v=v[k])
        greatest = JointBounds.of(body, state, horizon, 500.0, planned=planned).acceleration_upper[joint]
        within &= greatest >= a[k, 6 + joint]
        alone = JointBounds.of(body, state, horizon, 500.0).acceleration_upper[joint]
        held_back = max(held_back, a[k, 6 + joint] - alone)
    assert within == (away == 0.0)  # 1.7 degrees off it would end beyond the range
    assert held_back > 20.0


def test_reference_averages_accelerations_over_the_hold(body, still):
    """The mean acceleration is the change of the planned velocity over the hold."""
    frames = {"left_foot": body.effector_frame("left_foot")}
    reference = Reference(body, still, frames, 0.005, 0.05)
    sample = reference.sample(0.5)
    assert np.allclose(sample.q, body.standing_posture())
    assert np.abs(sample.com_acceleration).max() < 1e-12
    assert np.array_equal(reference.sample(-1.0).q, still.q[0])
    assert np.array_equal(reference.sample(7.0).q, still.q[-1])
