"""A body, the platform scene and its key stances ([Qiu2012]_ 5.4.4, Tables 5.2 to 5.4)."""

from dataclasses import dataclass

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import sole
from manikin.kinematics import PostureProblem, touching_pairs
from manikin.scene import Box, Obstacle, Proximity, Scene

LEFT = [(-0.1, 0, 0), (0.2, 0.4, 0), (0.5, 0.65, 0.2)]
RIGHT = [(0.1, 0, 0), (0.7, 0.65, 0.2)]
STANCES = [(0, 0), (0, 0), (1, 0), (1, 0), (1, 1), (1, 1), (2, 1), (2, 1)]
COM = [
    (0.0, 0.0, 0.92), (0.0586, 0.0259, 0.9365), (0.1311, 0.1653, 0.8559), (0.1654, 0.2833, 0.8743),
    (0.2651, 0.4157, 0.857), (0.649, 0.5725, 0.819), (0.6738, 0.6193, 0.8542), (0.6, 0.65, 0.86),
]  # fmt: skip


def foot(name, position, yaw=0.0):
    return sole(name, position, yaw, length=0.28, width=0.12, friction=0.7)


@dataclass(frozen=True)
class Platform:
    """The scene of the platform scenario and its key stances."""

    body: object
    proximity: Proximity

    def problem(self, key, **options):
        """Requirements at key instant 0 to 7."""
        left, right = STANCES[key]
        contacts = (foot("left_foot", LEFT[left], np.pi / 2), foot("right_foot", RIGHT[right], np.pi / 2))
        under = [(c.effector, "floor" if c.position[2] < 0.1 else "platform") for c in contacts]
        return PostureProblem(
            self.body,
            contacts,
            com=COM[key],
            proximity=self.proximity,
            clearance=0.02,
            ignore=touching_pairs(self.body, under),
            **options,
        )


@pytest.fixture(scope="session")
def body():
    return human()


@pytest.fixture(scope="session")
def platform(body):
    boxes = {
        "roof": ((1.1, 1.5, 0.05), (0.9, 0.75, 1.5)),
        "threshold": ((0.05, 1.5, 0.3), (0.35, 0.75, 0.15)),
        "platform": ((1.1, 1.5, 0.2), (0.9, 0.75, 0.1)),
    }
    scene = Scene([Obstacle(name, Box(size), translation=place) for name, (size, place) in boxes.items()])
    return Platform(body, Proximity(body, scene))


@pytest.fixture(scope="session")
def on_the_floor(body):
    """Both feet side by side on the floor, nothing around."""
    proximity = Proximity(body, Scene())
    contacts = (foot("left_foot", (0, 0.1, 0)), foot("right_foot", (0, -0.1, 0)))
    ignore = touching_pairs(body, [("left_foot", "floor"), ("right_foot", "floor")])

    def problem(**options):
        settings = {"contacts": contacts, "proximity": proximity, "ignore": ignore, **options}
        return PostureProblem(body, **settings)

    return problem
