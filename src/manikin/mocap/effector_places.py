"""Where effectors and segments of a recorded body are."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.further_contacts import with_knees_and_elbows
from manikin.spatial import FloatArray

JOINTS = ("left_knee", "right_knee", "left_elbow", "right_elbow")
"""Effectors of :func:`manikin.body.further_contacts.with_knees_and_elbows`."""


def effector_places(body: BodyModel, q: FloatArray, names: Sequence[str]) -> FloatArray:
    """(k, n, 3) effectors, or else origins of segments, in the world [m].

    Args:
        body: Who; a human has its knees and elbows as effectors, too.
        q: (n, nq) postures.
        names: Of effectors, or of segments.

    Raises:
        BodyError: If the body has none of a name.
    """
    if set(names) & set(JOINTS) - set(body.effectors):
        body = with_knees_and_elbows(body)
    model, data = body.pinocchio, body.pinocchio.createData()
    frames = [
        body.effector_frame(name) if name in body.effectors else body.segment_frame(name) for name in names
    ]
    # Views of Pinocchio's memory: they follow whatever is computed in these data.
    views = [data.oMf[frame].translation for frame in frames]
    places = np.empty((len(q), len(names), 3))
    for number, posture in enumerate(q):
        pin.framesForwardKinematics(model, data, posture)
        places[number] = views
    return np.ascontiguousarray(places.transpose(1, 0, 2))
