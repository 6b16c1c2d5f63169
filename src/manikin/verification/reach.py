"""How far apart two effectors of a body can be at most, whatever its joints do: a bound from lengths."""

import numpy as np

from manikin.body import BodyModel
from manikin.numerics.spatial import FloatArray


class ReachBounds:
    """Upper bounds of distances between parts of a body: the length of the way along its segments.

    A body that keeps to its joints' ranges reaches less; no posture reaches more.
    """

    def __init__(self, body: BodyModel) -> None:
        self._body = body

    def between(self, first: str, second: str) -> float:
        """Largest distance between the origins of two effectors [m]."""
        a, b = self._body.effector(first), self._body.effector(second)
        return self._way(a.segment, a.translation, b.segment, b.translation)

    def to_com(self, effector: str) -> float:
        """Largest distance of an effector from the body's centre of mass [m]."""
        end = self._body.effector(effector)
        ways = [
            segment.mass * self._way(end.segment, end.translation, segment.name, segment.com)
            for segment in self._body.segments
        ]
        return sum(ways) / sum(segment.mass for segment in self._body.segments)

    def _way(self, first: str, at: FloatArray, second: str, other: FloatArray) -> float:
        """Length of the way from a point of one segment over the joints to a point of another [m]."""
        up, down = self._ancestors(first), self._ancestors(second)
        common = next(name for name in up if name in down)
        here, to_here = self._climbed(first, at, common)
        there, to_there = self._climbed(second, other, common)
        return to_here + to_there + float(np.linalg.norm(here - there))

    def _climbed(self, segment: str, point: FloatArray, until: str) -> tuple[FloatArray, float]:
        """Where the way from a point enters an ancestor, in its frame, and its length up to there [m]."""
        length, here = 0.0, np.array(point)
        while segment != until:
            length += float(np.linalg.norm(here))
            part = self._body.segment(segment)
            here, segment = np.array(part.origin), str(part.parent)
        return here, length

    def _ancestors(self, segment: str) -> list[str]:
        result = [segment]
        while (parent := self._body.segment(result[-1]).parent) is not None:
            result.append(parent)
        return result
