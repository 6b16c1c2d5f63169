"""Which joints and segments of a standing body are its ankles, hips, arms and so on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limb import end_segments
from manikin.contact import ContactKind
from manikin.errors import BodyError


@dataclass(frozen=True, eq=False)
class JointGroups:
    """Parts of a body that stands on two soles.

    Attributes:
        feet: Effectors of the two legs, the left one first.
        joints: Hinge indices by group: ``"ankle"`` (with what hangs on the foot), ``"knee"``, ``"hip"``,
            ``"trunk"`` and ``"arm"``; each hinge is in one group.
        segments: Segment names by group: ``"arms"``, ``"trunk"`` and ``"legs"``; each is in one group.
    """

    feet: tuple[str, str]
    joints: dict[str, NDArray[np.int64]]
    segments: dict[str, tuple[str, ...]]

    def locked(self, names: tuple[str, ...]) -> NDArray[np.int64]:
        """Hinge indices of ``"arms"`` and of ``"hips"``, which are hips and trunk together."""
        chosen = {"arms": ("arm",), "hips": ("hip", "trunk")}
        parts = [self.joints[group] for name in names for group in chosen[name]]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, dtype=np.int64)


def joint_groups(body: BodyModel) -> JointGroups:
    """Sort the joints and segments of a body with two legs.

    Raises:
        BodyError: If it has not two legs of three segments that end in soles.
    """
    legs = [limb for limb in body.limbs if limb.kind is ContactKind.SOLE]
    if len(legs) != 2 or any(len(leg.segments) != 3 for leg in legs) or body.sole_length is None:
        raise BodyError(f"body {body.name!r} does not stand on two legs; valid: human, kudoh")
    arms = [limb for limb in body.limbs if limb.kind is not ContactKind.SOLE]
    toes = {leg.effector: end_segments(body, leg.effector)[1:] for leg in legs}
    parts = {
        "ankle": [name for leg in legs for name in (leg.segments[2], *toes[leg.effector])],
        "knee": [leg.segments[1] for leg in legs],
        "hip": [leg.segments[0] for leg in legs],
        "arm": [name for arm in arms for name in arm.segments],
    }
    sorted_out = {name for names in parts.values() for name in names}
    parts["trunk"] = [segment.name for segment in body.segments if segment.name not in sorted_out]
    joints = {
        group: np.array(
            [body.joint_index(hinge.name) for name in names for hinge in body.segment(name).hinges],
            dtype=np.int64,
        )
        for group, names in parts.items()
    }
    segments = {
        "arms": tuple(parts["arm"]),
        "trunk": tuple(parts["trunk"]),
        "legs": (*parts["hip"], *parts["knee"], *parts["ankle"]),
    }
    return JointGroups((legs[0].effector, legs[1].effector), joints, segments)
