"""Share of people who have the strength that a motion asks of each joint.

The strength of a group of one sex and age is taken as normally distributed about the mean of
:mod:`manikin.body.strength`, with the standard deviation of :func:`manikin.body.strength.variation`. The
people have the stature and the mass of the body that made the motion, as its torques come from its own
weight; for people of other sizes the motion has to be made with such a body. Both directions of a joint
count.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr

from manikin.body import BodyModel
from manikin.body.strength import DEFAULT_AGE, HUMAN_STRENGTH, hinge_strength, variation
from manikin.errors import BodyError
from manikin.limits import AGE_RANGE
from manikin.numerics.spatial import FloatArray, finite_number

SEXES = ("male", "female")


@dataclass(frozen=True, eq=False)
class CapableShare:
    """Shares of one group of people.

    Attributes:
        sex: ``"male"`` or ``"female"``.
        age: [years].
        joint_names: Joints whose strength is published.
        share: (j,) of the people who have the torques of each joint at its peaks, from 0 to 1.
    """

    sex: str
    age: float
    joint_names: tuple[str, ...]
    share: FloatArray

    @property
    def weakest(self) -> tuple[str, float]:
        """The joint that fewest people have the strength for, and their share."""
        index = int(self.share.argmin())
        return self.joint_names[index], float(self.share[index])

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        joint, least = self.weakest
        joints = dict(zip(self.joint_names, map(float, self.share), strict=True))
        return {"min_share": least, "joint": joint, "age": self.age, "joints": joints}


def capable_share(torque: float, mean: float, deviation: float) -> float:
    """Share of people whose normally distributed strength is at least a torque [N.m]."""
    return float(ndtr((mean - torque) / deviation))


def capable_shares(
    body: BodyModel, tau: FloatArray, *, age: float | None = None
) -> Mapping[str, CapableShare]:
    """Shares of men and of women who have the strength for torques (n, j), by sex.

    Args:
        body: A human; its joints, its size, and its age where none is given.
        tau: Torques of the joints, in the order of its joint names [N.m].
        age: Of the people [years].

    Raises:
        BodyError: If no joint of the body has a published strength.
        InputError: If the age is not from 18 to 90.
    """
    years = age if age is not None else body.age if body.age is not None else DEFAULT_AGE
    finite_number(years, "age of the people [years]", at_least=AGE_RANGE[0], at_most=AGE_RANGE[1])
    hinges = {name: name.removeprefix("left_").removeprefix("right_") for name in body.joint_names}
    known = [name for name, hinge in hinges.items() if hinge in HUMAN_STRENGTH]
    stature, mass = body.stature, body.own_mass
    if not known or stature is None:
        raise BodyError(f"no joint of body {body.name!r} has a published strength; valid: a human")
    columns = tau[:, [body.joint_index(name) for name in known]]
    against, along = np.maximum(-columns.min(axis=0), 0.0), np.maximum(columns.max(axis=0), 0.0)
    found = {}
    for sex in SEXES:
        share = np.ones(len(known))
        for number, name in enumerate(known):
            means = hinge_strength(hinges[name], mass, stature, sex, years)
            spread = variation(hinges[name])
            share[number] = min(
                capable_share(torque, mean, spread * mean) if torque > 0.0 else 1.0
                for torque, mean in zip((against[number], along[number]), means, strict=True)
            )
        found[sex] = CapableShare(sex, years, tuple(known), share)
    return found
