"""A person and an insect with samples of their limbs; plans checked by means that are not the planner's."""

import warnings

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from manikin.body import human, insect, with_knees_and_elbows
from manikin.kinematics.limb_samples import sample_limbs
from manikin.numerics.spatial import IDENTITY
from manikin.pipeline.stages.context import plan_in_world
from manikin.scenarios import load_scenario
from manikin.scene import Box
from manikin.scene.scene import FLOOR
from manikin.verification import check_contact_plan


@pytest.fixture(scope="session")
def person():
    return with_knees_and_elbows(human(1.75, 79.0, "male"))


@pytest.fixture(scope="session")
def person_samples(person):
    return sample_limbs(person, np.random.default_rng(0), 10_000)


@pytest.fixture(scope="session")
def creature():
    return insect()


@pytest.fixture(scope="session")
def creature_samples(creature):
    return sample_limbs(creature, np.random.default_rng(0), 3000)


@pytest.fixture
def checked(tmp_path):
    """Checks a plan of a person on feet at both ends, in a scene of boxes and cylinders along z."""

    def entry(item):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of angles that are not unique, of which any will do
            turn = Rotation.from_matrix(item.rotation).as_euler("xyz", degrees=True)
        shape = item.shape
        size = (
            {"box": list(map(float, shape.size))} if isinstance(shape, Box)
            else {"cylinder": {"radius_m": shape.radius, "length_m": shape.length}}
        )  # fmt: skip
        return {"name": item.name, "position": item.translation.tolist(), "rpy_deg": turn.tolist(), **size}

    def end(q):
        forward = Rotation.from_quat(q[3:7]).as_matrix()[:2, 0]
        return {"at": q[:2].tolist(), "heading_deg": float(np.degrees(np.arctan2(forward[1], forward[0])))}

    def check(body, scene, plan):
        content = {
            "name": "plan",
            "body": {
                "model": "human", "stature_m": body.stature, "mass_kg": body.mass, "sex": body.sex,
            },
            "scene": [entry(item) for item in scene if item.name != FLOOR],
            "task": {"start": end(plan.stages[0].q), "goal": end(plan.goal)},
        }  # fmt: skip
        file = tmp_path / "plan.yaml"
        file.write_text(yaml.safe_dump(content))
        return check_contact_plan(load_scenario(file), plan_in_world(plan, IDENTITY))

    return check
