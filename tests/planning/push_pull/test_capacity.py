import numpy as np
import pinocchio as pin
import pytest

from manikin.balance.contact_forces import friction_share
from manikin.body import Configuration
from manikin.body.segments import HANDS
from manikin.contact import FRICTION_MODELS, ContactKind
from manikin.numerics.spatial import GRAVITY
from manikin.planning.push_pull import Act, largest_force, share_force
from manikin.planning.push_pull.act import RESERVE


@pytest.mark.parametrize("measure", [largest_force, share_force])
def test_forces_and_torques_keep_the_body_at_rest(body, brace, push, measure):
    """Inverse dynamics with the forces of the program, each contact as one wrench, gives its torques.

    The toes carry what lies before their hinge, so that a foot's wrench on its segment alone leaves an
    error in the toes' own torque and none anywhere else.
    """
    contacts = list(brace.contacts.values())
    forces = measure(body, brace.q, contacts, push)
    model, data = body.pinocchio, body.pinocchio.createData()
    pin.forwardKinematics(model, data, brace.q)
    external = [pin.Force.Zero() for _ in range(model.njoints)]
    for contact, wrench in zip(contacts, forces.contact_force, strict=True):
        joint = model.frames[body.segment_frame(body.effector(contact.effector).segment)].parentJoint
        _, place = Configuration(body, brace.q).effector_placement(contact.effector)
        world = pin.Force(wrench[:3], wrench[3:] + np.cross(place, wrench[:3]))
        external[joint] = external[joint] + data.oMi[joint].actInv(world)
    zero = np.zeros(model.nv)
    needed = pin.rnea(model, data, brace.q, zero, zero, pin.StdVec_Force(external))
    # Contacts of the posture are exact to 2e-4 m.
    assert np.abs(needed[:6]).max() < 2e-4 * 3.0 * body.mass * GRAVITY
    toes = np.array(["toe" in name for name in body.joint_names])
    assert np.abs(needed[6:] - forces.tau)[~toes].max() < 2e-4 * 3.0 * body.mass * GRAVITY
    assert body.torque_share(forces.tau).max() == pytest.approx(forces.torque_share)
    assert body.joint_names[int(np.argmax(body.torque_share(forces.tau)))] == forces.tightest
    assert forces.residual < 1e-6


def test_forces_keep_a_reserve_of_friction_and_sum_to_the_act(body, brace, push):
    forces = share_force(body, brace.q, list(brace.contacts.values()), push)
    total = np.zeros(3)
    for contact, wrench in zip(brace.contacts.values(), forces.contact_force, strict=True):
        normal = float(wrench[:3] @ contact.normal)
        assert normal >= -1e-6
        assert np.linalg.norm(wrench[:3] - normal * contact.normal) <= RESERVE * 0.7 * normal + 1e-6
        total += wrench[:3] if contact.effector in HANDS else 0.0
    np.testing.assert_allclose(total, (-push.force, 0.0, 0.0), atol=1e-6)


@pytest.mark.parametrize("model", FRICTION_MODELS)
def test_an_act_keeps_to_the_friction_model_and_to_the_circular_cone(body, brace, push, model):
    """With the outer pyramid an act has eight sides in the circle; 1e-6 per newton by the linear program."""
    forces = share_force(body, brace.q, list(brace.contacts.values()), push, 0.7, model)
    inner = "cone" if model == "outer" else model
    for contact, wrench in zip(brace.contacts.values(), forces.contact_force, strict=True):
        if contact.kind is not ContactKind.GRASP:
            for held in (model, inner):
                assert friction_share(contact, wrench[None, :3], held)[0] <= 1.0 + 1e-6


def test_no_posture_exerts_more_than_tipping_over_the_rear_edge_allows(body, brace, push):
    """``F h <= m g d``: about the rear edge of the soles the weight has to hold what the hands exert."""
    found = largest_force(body, brace.q, list(brace.contacts.values()), push)
    rear = min(contact.points_in_world[:, 0].min() for contact in brace.feet.values())
    com = Configuration(body, brace.q).com
    forces = dict(zip(brace.contacts, found.contact_force, strict=True))
    moment = sum(
        -forces[name][0] * contact.position[2] + forces[name][2] * (contact.position[0] - rear)
        for name, contact in brace.hands.items()
    )
    assert moment <= body.mass * GRAVITY * (com[0] - rear) * (1.0 + 1e-3)
    assert found.force >= push.force


def test_a_standing_body_without_hands_has_no_force(body, brace, push):
    assert largest_force(body, brace.q, list(brace.feet.values()), push).force == pytest.approx(0.0, abs=1e-6)


def test_the_share_of_strength_is_a_convex_function_of_the_force(body, brace):
    """Half way between two forces, half way between their solutions is one: no more than the mean share."""
    contacts = list(brace.contacts.values())
    acts = [Act("push", "cupboard", (1.0, 0.0, 0.0), force) for force in (60.0, 120.0, 180.0)]
    low, middle, high = (share_force(body, brace.q, contacts, act).torque_share for act in acts)
    assert middle <= 0.5 * (low + high) + 1e-6
