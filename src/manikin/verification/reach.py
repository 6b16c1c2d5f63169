"""Reach of a body for plans without postures: a bound from lengths, and a search for a posture."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind
from manikin.numerics.spatial import FloatArray, turned_root


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


REACHED = 5e-3
"""Distance from its contact at which an effector of a searched posture has reached it [m]."""

_TRIES, _STEPS = 4, 120
_LIKE_STANDING, _SOLE_END = 0.01, 0.15
_WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class PostureSearch:
    """Looks for a posture on contacts where a plan gives none: damped Gauss-Newton within the joints' ranges.

    What it finds is reach; collisions are not avoided. A local search from a few starts may miss a posture:
    a plan without postures may be refused although there is one, which it then has to give.
    """

    def __init__(self, body: BodyModel) -> None:
        self._body, self._data = body, body.pinocchio.createData()
        self._standing = body.standing_posture()

    def gap(self, contacts: Sequence[Contact], com: FloatArray | None) -> float:
        """Least distance by which a posture misses one of its contacts or the centre of mass [m].

        Args:
            com: (3,) centre of mass, whose level place is to be kept; free when None.
        """
        rng, best = np.random.default_rng(0), np.inf
        for number in range(_TRIES):
            q = self._start(contacts, 0.12 * number)
            q[7:] += 0.2 * rng.normal(size=len(q) - 7) if number else 0.0
            for _ in range(_STEPS):
                q[7:] = np.clip(q[7:], self._body.lower, self._body.upper)
                missed, rows = self._linear(q, contacts, com)
                worst = max((float(np.linalg.norm(part)) for part in missed), default=0.0)
                best = min(best, worst)
                if best <= REACHED:
                    return best
                q = self._moved(q, np.concatenate(missed), np.concatenate(rows))
        return best

    def _start(self, contacts: Sequence[Contact], lowered: float) -> FloatArray:
        """(nq,) standing posture over the contacts, facing as the feet do."""
        feet = [contact for contact in contacts if "foot" in contact.effector] or list(contacts)
        heading = float(np.angle(np.sum([np.exp(1j * contact.yaw) for contact in feet])))
        start = turned_root(self._standing, heading)
        start[:2] = np.mean([contact.position[:2] for contact in feet], axis=0)
        start[2] += float(np.mean([contact.position[2] for contact in feet])) - lowered * start[2]
        return start

    def _linear(
        self, q: FloatArray, contacts: Sequence[Contact], com: FloatArray | None
    ) -> tuple[list[FloatArray], list[FloatArray]]:
        """What is missed [m], the turn of a sole as the way of its end, and how a motion (nv,) changes it."""
        model, data = self._body.pinocchio, self._data
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        missed, rows = [], []
        for contact in contacts:
            frame = self._body.effector_frame(contact.effector)
            place, jacobian = data.oMf[frame], pin.getFrameJacobian(model, data, frame, _WORLD_AXES)
            away, moves = contact.position - place.translation, jacobian[:3]
            turn = pin.log3(contact.rotation_contact_to_world @ place.rotation.T)
            turns = jacobian[3:]
            if contact.rolls:
                forward, across = contact.rotation_contact_to_world[:, :2].T
                arm, pitch = place.rotation @ contact.pivot, -float(across @ turn)
                rolled = contact.rotation_contact_to_world @ contact.pivot
                away = away + rolled + contact.edge_radius * pitch * forward - arm
                moves = (
                    moves - pin.skew(arm) @ turns - contact.edge_radius * np.outer(forward, across @ turns)
                )
                level = np.eye(3) - np.outer(across, across)
                turn, turns = level @ turn, level @ turns
            missed.append(away)
            rows.append(moves)
            if contact.kind is ContactKind.SOLE:
                missed.append(_SOLE_END * turn)
                rows.append(_SOLE_END * turns)
        if com is not None:
            jacobian = pin.jacobianCenterOfMass(model, data, q, False)
            missed.append((com - data.com[0])[:2])
            rows.append(jacobian[:2])
        return missed, rows

    def _moved(self, q: FloatArray, missed: FloatArray, rows: FloatArray) -> FloatArray:
        """(nq,) posture after one step; joints that would leave their ranges stay."""
        pull = np.zeros(self._body.nv)
        pull[6:] = _LIKE_STANDING * (self._standing[7:] - q[7:])
        free = np.ones(self._body.nv, dtype=bool)
        for _ in range(3):
            active = rows * free
            matrix = active.T @ active + np.diag(np.where(free, _LIKE_STANDING**2, 1.0))
            step = np.linalg.solve(matrix, active.T @ missed + _LIKE_STANDING * pull * free)
            ahead = q[7:] + step[6:]
            leaving = (ahead < self._body.lower - 1e-9) | (ahead > self._body.upper + 1e-9)
            at_end = (q[7:] <= self._body.lower) | (q[7:] >= self._body.upper)
            if not np.any(leaving & at_end & free[6:]):
                break
            free[6:] &= ~(leaving & at_end)
        size = float(np.abs(step).max())
        return pin.integrate(self._body.pinocchio, q, step * min(1.0, 0.4 / max(size, 1e-9)))
