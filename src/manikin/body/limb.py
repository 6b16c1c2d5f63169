"""The end of a limb: the segment of an effector and what hangs on it, as toes on a foot."""

from manikin.body.model import BodyModel
from manikin.body.segments import Segment
from manikin.spatial import FloatArray


def hanging_segment(body: BodyModel, segment: str) -> Segment | None:
    """Return the last segment of a limb when it hangs on ``segment``, as toes on a foot, or None."""
    children = [candidate for candidate in body.segments if candidate.parent == segment]
    if len(children) != 1 or not children[0].hinges:
        return None
    leaf = all(candidate.parent != children[0].name for candidate in body.segments)
    return children[0] if leaf else None


def end_segments(body: BodyModel, effector: str) -> tuple[str, ...]:
    """Names of the segments with which an effector touches: its own and the one hanging on it."""
    own = body.effector(effector).segment
    hanging = hanging_segment(body, own)
    return (own,) if hanging is None else (own, hanging.name)


def hinge_line(body: BodyModel, effector: str) -> float | None:
    """Return where the hinge of the hanging segment crosses the effector's x axis [m], or None."""
    frame = body.effector(effector)
    hanging = hanging_segment(body, frame.segment)
    return None if hanging is None else float((frame.rotation.T @ (hanging.origin - frame.translation))[0])


def carrying_segment(body: BodyModel, effector: str, point: FloatArray) -> str:
    """Name of the end segment that carries a point (3,) of the effector frame [m].

    What lies beyond the hinge of the hanging segment is carried by it.
    """
    own = body.effector(effector).segment
    hanging, line = hanging_segment(body, own), hinge_line(body, effector)
    return hanging.name if hanging is not None and line is not None and point[0] > line else own
