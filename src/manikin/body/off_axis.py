"""How far the masses of segments lie off the lines between joints.

The scans behind de Leva's table give one number a segment, a place on the line from joint to joint. Tables
measured in three dimensions say that thighs, shanks, trunk and head have their masses a little behind that
line: together they move the centre of mass of the whole body back by a good centimetre, which a force plate
sees.

Source: Dumas, Chèze and Verriest, "Adjustments to McConville et al. and Young et al. body segment inertial
parameters", J. Biomech. 40(3), 2007, Table 2, the anterior and lateral parts only; along the segments de
Leva's places are kept. Arms, hands and feet are left as they are: their offsets move the body by less than a
millimetre. The reference lines of the trunk end at the lumbosacral joint and at C7/T1, ours at the hips and
at C7; the pelvis, whose offset is told from the lumbosacral joint alone, keeps its mass on the line.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from manikin.body.anthropometry import Anthropometry, Sex
from manikin.spatial import FloatArray


@dataclass(frozen=True)
class Offset:
    """Of a centre of mass from the line between the joints of its segment.

    Attributes:
        forward: Per length of the segment.
        outward: To the side away from the body's middle, per length; 0 in the trunk.
    """

    forward: float
    outward: float = 0.0


TORSO_LENGTH = {Sex.FEMALE: 0.429 / 1.61, Sex.MALE: 0.477 / 1.77}
"""Lumbosacral joint to C7/T1 in the sample, per stature."""

HEAD_LENGTH = {Sex.FEMALE: 0.243 / 1.61, Sex.MALE: 0.277 / 1.77}
"""C7/T1 to vertex, per stature."""

OFFSETS: Mapping[Sex, Mapping[str, Offset]] = MappingProxyType({
    Sex.FEMALE: MappingProxyType({
        "torso": Offset(-0.016), "head_and_neck": Offset(-0.070),
        "thigh": Offset(-0.077, 0.009), "shank": Offset(-0.049, 0.031),
    }),
    Sex.MALE: MappingProxyType({
        "torso": Offset(-0.036), "head_and_neck": Offset(-0.062),
        "thigh": Offset(-0.041, 0.033), "shank": Offset(-0.048, 0.007),
    }),
})  # fmt: skip
"""Dumas et al. (2007), Table 2."""

_TRUNK = ("middle_trunk", "upper_trunk")


def off_axis(size: Anthropometry, name: str, side: str = "") -> FloatArray:
    """(3,) offset of the centre of mass of a part in the frame of its segment, x forward, y left [m].

    Args:
        size: The person.
        name: A row of de Leva's table; those without an offset have none.
        side: ``"left"`` or ``"right"`` of a limb, empty for the trunk.
    """
    row = "torso" if name in _TRUNK else name
    offset = OFFSETS[size.sex].get(row)
    if offset is None:
        return np.zeros(3)
    sign = {"left": 1.0, "right": -1.0, "": 0.0}[side]
    lengths = {
        "torso": TORSO_LENGTH[size.sex] * size.stature,
        "head_and_neck": HEAD_LENGTH[size.sex] * size.stature,
    }
    length = lengths.get(row) or size.length(row)
    return length * np.array([offset.forward, sign * offset.outward, 0.0])
