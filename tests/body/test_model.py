"""The neutral description, its checks and the models built from it."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import BodyModel, Effector, Hinge, Segment, Shape, human
from manikin.errors import BodyError, InputError


@pytest.fixture(scope="module")
def body():
    return human()


def segment(name="base", parent=None, hinges=(), **changes):
    values = {
        "origin": np.zeros(3), "mass": 1.0, "com": np.zeros(3), "inertia": np.eye(3) * 0.1, "shapes": (),
    }  # fmt: skip
    return Segment(name, parent, hinges=hinges, **{**values, **changes})


def hinge(name="knee", axis=(0, 1, 0), **changes):
    values = {
        "lower": -1.0,
        "upper": 1.0,
        "velocity_limit": 5.0,
        "torque_lower": -80.0,
        "torque_upper": 100.0,
    }
    return Hinge(name, np.array(axis, dtype=float), **{**values, **changes})


def test_collision_pairs_leave_out_neighbours_and_soft_pairs(body):
    pairs = {frozenset(pair) for pair in body.segment_pairs}
    for part in body.segments:
        if part.parent:
            assert frozenset((part.name, part.parent)) not in pairs
    assert not pairs & body.soft_pairs
    assert len(pairs) == 19 * 18 // 2 - 18 - len(body.soft_pairs)
    assert frozenset(("left_thigh", "right_thigh")) in pairs
    assert frozenset(("left_hand", "head")) in pairs


def test_geometry_holds_the_shapes_and_the_pairs(body):
    names = [item.name for item in body.geometry.geometryObjects]
    assert names == [f"{part.name}/{shape.name}" for part in body.segments for shape in part.shapes]
    pairs = [(names[pair.first], names[pair.second]) for pair in body.geometry.collisionPairs]
    assert {frozenset(pair) for pair in pairs} == {frozenset(pair) for pair in body.collision_pairs}


def test_models_are_built_once(body):
    assert body.pinocchio is body.pinocchio
    assert body.geometry is body.geometry


def test_description_cannot_be_changed(body):
    with pytest.raises(dataclasses.FrozenInstanceError):
        body.name = "other"
    with pytest.raises(ValueError, match="read-only"):
        body.segments[1].com[0] = 1.0
    with pytest.raises(TypeError):
        body.effectors["tail"] = None
    with pytest.raises(ValueError, match="read-only"):
        body.lower[0] = 0.0


def test_segment_and_effector_frames_are_told_apart(body):
    """The foot's segment frame is in the ankle, its effector frame under the sole."""
    model = body.pinocchio
    assert model.frames[body.effector_frame("left_foot")].placement.translation[2] < -0.05
    np.testing.assert_allclose(model.frames[body.segment_frame("left_foot")].placement.translation, 0.0)


def test_rigid_chain_keeps_every_offset():
    """A segment on a rigid segment on a hinged one: places and inertia add up."""
    parts = (
        segment("base"),
        segment("arm", "base", (hinge(),), origin=np.array([0.0, 0.0, 1.0])),
        segment("plate", "arm", origin=np.array([0.1, 0.0, 0.0]), com=np.array([0.0, 0.3, 0.0])),
        segment("tool", "plate", (hinge("turn"),), origin=np.array([0.0, 0.2, 0.0])),
    )
    body = BodyModel("machine", parts, {"tip": Effector("tip", "tool", np.array([0.0, 0.0, 0.5]))})
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, body.zero_posture())
    np.testing.assert_allclose(data.oMf[body.effector_frame("tip")].translation, [0.1, 0.2, 1.5])
    com = pin.centerOfMass(body.pinocchio, data, body.zero_posture())
    np.testing.assert_allclose(com, np.mean([[0, 0, 0], [0, 0, 1], [0.1, 0.3, 1], [0.1, 0.2, 1]], axis=0))


@pytest.mark.parametrize("make", [
    lambda: segment(mass=-1.0),
    lambda: segment(mass=float("nan")),
    lambda: segment(com=np.array([0.0, np.inf, 0.0])),
    lambda: segment(inertia=np.diag([1.0, 1.0, 3.0])),
    lambda: segment(inertia=np.diag([1.0, -1.0, 1.0])),
    lambda: segment(inertia=np.array([[1.0, 0.1, 0], [0, 1, 0], [0, 0, 1]])),
    lambda: hinge(axis=(0, 0, 0)),
    lambda: hinge(lower=1.0, upper=-1.0),
    lambda: hinge(torque_lower=0.0),
    lambda: hinge(torque_upper=0.0),
    lambda: hinge(velocity_limit=-1.0),
    lambda: Shape("x", "cone", (1.0,)),
    lambda: Shape("x", "box", (1.0, 2.0)),
    lambda: Shape("x", "sphere", (-1.0,)),
    lambda: Shape("x", "sphere", (1.0,), rotation=np.ones((3, 3))),
    lambda: Shape("x", "sphere", (1.0,), translation=(0.0, np.nan, 0.0)),
    lambda: Effector("x", "base", np.array([0.0, np.nan, 0.0])),
    lambda: BodyModel("x", (), {}),
    lambda: BodyModel("x", (segment("a"), segment("b")), {}),
    lambda: BodyModel("x", (segment("a", "b"), segment("b")), {}),
    lambda: BodyModel("x", (segment("a"), segment("a", "a")), {}),
    lambda: BodyModel("x", (segment("a"), segment("b", "c")), {}),
    lambda: BodyModel("x", (segment("a"), segment("b", "a", (hinge(), hinge()))), {}),
    lambda: BodyModel("x", (segment("a"),), {"e": Effector("e", "tail", np.zeros(3))}),
    lambda: BodyModel("x", (segment("a"),), {}, standing_angles={"knee": 1.0}),
    lambda: BodyModel("x", (segment("a"),), {}, nominal_mass=2.0),
    lambda: human().segment("tail"),
    lambda: human().effector("tail"),
    lambda: human().effector_frame("tail"),
    lambda: human().segment_frame("tail"),
    lambda: human().posture({"tail": 1.0}),
])  # fmt: skip
def test_broken_description_is_refused_with_one_line(make):
    with pytest.raises(InputError) as caught:
        make()
    assert isinstance(caught.value, BodyError)
    assert "valid" in str(caught.value)
    assert "\n" not in str(caught.value)
