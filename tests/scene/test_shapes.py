import numpy as np
import pytest

from manikin.errors import SceneError
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Plane, Sphere


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Box((1.0, 0.0, 1.0)), "box size along y"),
        (lambda: Box((1.0, -1.0, 1.0)), "> 0"),
        (lambda: Box((1.0, np.nan, 1.0)), "finite"),
        (lambda: Box((1.0, 1.0)), "shape (3)"),
        (lambda: Box("big"), "numbers"),
        (lambda: Box((1500.0, 1.0, 1.0)), "<= 1000"),
        (lambda: Sphere(0.0), "sphere radius"),
        (lambda: Sphere(True), "sphere radius"),
        (lambda: Sphere("1"), "sphere radius"),
        (lambda: Cylinder(0.1, np.inf), "cylinder length"),
        (lambda: Cylinder(-0.1, 1.0), "cylinder radius"),
        (lambda: Capsule(0.1, 0.0), "capsule length"),
        (lambda: Plane((0.0, 0.0, 0.0)), "plane normal"),
        (lambda: HalfSpace((0.0, 0.0, 1.0), np.nan), "half-space offset"),
    ],
)
def test_nonsense_is_refused_in_one_line(make, said):
    with pytest.raises(SceneError) as caught:
        make()
    message = str(caught.value)
    assert said in message
    assert "valid: " in message
    assert "\n" not in message


def test_normals_are_made_unit_and_sizes_cannot_be_written():
    assert np.allclose(Plane((0.0, 0.0, 5.0), 1.0).normal, (0.0, 0.0, 1.0))
    box = Box((1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="read-only"):
        box.size[0] = 4.0
