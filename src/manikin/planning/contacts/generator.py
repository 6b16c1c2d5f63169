"""The request for one contact: reach, samples in contact, order, choice ([Tonneau2015]_ 5.3.2)."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration, Limb, limb_named
from manikin.body.natural_range import NaturalRange
from manikin.contact import Contact, ContactKind
from manikin.errors import BodyError
from manikin.kinematics import LimbKinematics
from manikin.kinematics.alignment import POSITION_TOLERANCE, TILT_TOLERANCE, Aligner
from manikin.kinematics.efort import Task, efort
from manikin.kinematics.limb_collisions import DeepSamples, LimbCollisions
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray, onto_normal
from manikin.planning.contacts.candidates import Candidates, Situation, find_candidates
from manikin.planning.contacts.contact_plan import ContactRules, footprint, make_contact
from manikin.planning.contacts.heuristics import Efort, Heuristic
from manikin.scene import Scene
from manikin.scene.surface_table import SurfaceTable
from manikin.scene.triangles import IntArray

_GROWTH = 0.15  # how much longer each step down the order is than the one before
_STEPS = np.cumsum(1 + (_GROWTH * np.arange(1000)).astype(np.int64)) - 1
_FEW, _SOME, _BLOCK = 4, 16, 64  # candidates looked at together: first, later, and where many collide
_NO_DIRECTION = np.zeros(3)
_LOOKED_AT = 8  # candidates for each that may be tried
Alpha = TypeVar("Alpha", float, FloatArray)

_Faults = Counter[tuple[str, str]]
_TILTED, _UNNATURAL, _WEAK = ("", "tilted"), ("", "unnatural"), ("", "weak")
NATURAL_SLACK = 0.1  # normalised distance out of the learnt range that the alignment may leave


class Hindrance(StrEnum):
    """Cause that kept a limb from making a contact."""

    REACH = "reach"  # no surface is within reach of the limb
    SURFACE = "surface"  # surfaces are within reach, but no sample of the limb lies on one
    COLLISION = "collision"  # every contact that was tried collides
    ALIGNMENT = "alignment"  # no effector that was tried can be put flat onto its surface
    DIRECTION = "direction"  # no surface within reach has a usable EFORT in the direction that is asked for


@dataclass(frozen=True)
class UsableEfort:
    """EFORT that an answer has at least, whatever the heuristic prefers.

    Attributes:
        least: See :func:`manikin.kinematics.efort.usable_efort` [N per N.m].
        pulling: Whether the limb holds on and pulls at the surface (5.13).
    """

    least: float
    pulling: bool = False

    def signed(self, alpha: Alpha) -> Alpha:
        """EFORT of what the limb does, from that of a limb that presses."""
        return -alpha if self.pulling else alpha


@dataclass(frozen=True)
class GeneratorSettings:
    """Settings of a request for a contact.

    Attributes:
        tolerance: Largest distance of a sample's effector to a surface, closed by inverse kinematics; of a
            limb without joints it stays [m].
        max_tilt: Largest angle between the effector's z axis and the normal before the alignment [rad].
        point_tilt: That angle after the alignment of points, grasps and limbs without joints [rad].
        tries: Candidates that are aligned and tested before giving up.
    """

    tolerance: float = 0.03
    max_tilt: float = float(np.deg2rad(45.0))
    point_tilt: float = float(np.deg2rad(15.0))
    tries: int = 120


@dataclass(frozen=True, eq=False)
class GeneratedContact:
    """Answer to a request: a contact and the posture that makes it, or why there is none.

    Attributes:
        q: (nq,) the body with this limb in contact and all else as asked, or None.
        obstacles: Names of the obstacles touched; coplanar ones that touch are one surface.
        score: Score of the candidate; minus infinity without one.
        candidates: Number of samples in contact (Table 8.2).
        tried: How many of them were tried, or, without a contact, were found impossible.
        failure: What kept the limb from a contact, or None.
        message: The failure in words, or an empty text.
        gap: Distance of the effector from its contact in ``q`` [m]: none where joints close it, at most the
            settings' tolerance for a limb without joints, which touches where the root puts it.
        efort: EFORT (5.12) of the posture ``q`` as of a limb that presses, None without one [N per N.m].
    """

    limb: str
    contact: Contact | None
    q: FloatArray | None
    obstacles: tuple[str, ...]
    score: float
    candidates: int
    tried: int
    failure: Hindrance | None = None
    message: str = ""
    gap: float = 0.0
    efort: float | None = None

    @property
    def found(self) -> bool:
        """Whether there is a contact."""
        return self.contact is not None

    @property
    def obstacle(self) -> str | None:
        """The obstacles in words, or None."""
        return " and ".join(self.obstacles) or None


class ContactGenerator:
    """Makes contacts of a body in a scene, one request at a time.

    What depends on the scene alone is prepared once; each request is a lookup in the samples, an order
    and a few tests. The same request has the same answer. One instance works on buffers of its own:
    use one per thread.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, samples: Mapping[str, LimbSamples],
        settings: GeneratorSettings | None = None, rules: ContactRules | None = None,
    ) -> None:  # fmt: skip
        """Prepare a scene for samples by name of the limb, see :mod:`manikin.kinematics.limb_samples`.

        Raises:
            BodyError: If samples belong to no limb of the body.
        """
        self.body, self._state, self._scene = body, Configuration(body), scene
        self.settings, self.rules = settings or GeneratorSettings(), rules or ContactRules()
        self._table, self._faces = SurfaceTable(scene.holds), len(scene.surfaces)
        self._tools = {
            name: _LimbTools(body, limb_named(body, name), scene, item) for name, item in samples.items()
        }

    def request(
        self, q: ArrayLike, limb: str, task: Task, heuristic: Heuristic | None = None, *,
        kind: ContactKind | None = None, usable: UsableEfort | None = None,
    ) -> GeneratedContact:  # fmt: skip
        """Find the best contact of one limb ([Tonneau2015]_ algorithm 2).

        Each candidate is aligned with its surface and then tested for collision: the print tests before
        the alignment, after which the posture is another one. They are tried down their order in ever
        longer steps, then those left out, best first; the first that is free is the answer. Where the
        limb itself collides several times, samples with its inside deeper in something than the
        alignment moves an effector (``tolerance``) are left out untried.

        Args:
            q: (nq,) the body; all but the limb stays as it is.
            heuristic: What to prefer; EFORT when omitted.
            kind: How the effector touches; the limb's own way when omitted.
            usable: EFORT that the answer has at least, at its sample and in its posture; any when omitted.

        Raises:
            BodyError: If there are no samples of such a limb or ``q`` does not fit.
            ContactError: If a sole is asked for of a body without soles.
        """
        return self.request_first(q, limb, [task], heuristic, kind=kind, usable=usable)[0]

    def request_first(
        self, q: ArrayLike, limb: str, tasks: Sequence[Task], heuristic: Heuristic | None = None, *,
        kind: ContactKind | None = None, usable: UsableEfort | None = None,
    ) -> list[GeneratedContact]:  # fmt: skip
        """Answers of one limb to tasks in the order of preference, up to the first that has a contact.

        The surfaces within reach are looked up once. Other arguments and errors are those of :meth:`request`.
        """
        reached = self._within_reach(q, limb, kind)
        if isinstance(reached, GeneratedContact):
            return [reached]
        answers: list[GeneratedContact] = []
        for task in tasks:
            answers.append(self._answer(reached, task, heuristic or Efort(), usable))
            if answers[-1].found:
                break
        return answers

    def _within_reach(
        self, q: ArrayLike, limb: str, kind: ContactKind | None
    ) -> "_WithinReach | GeneratedContact":
        """Step 1: the surfaces within reach of a limb, whatever the task, or that there are none."""
        if limb not in self._tools:
            raise BodyError(f"no samples of limb {limb!r}; valid: {', '.join(self._tools) or 'none'}")
        tools = self._tools[limb]
        touch = kind or tools.limb.kind
        situation = Situation.of(self._state.update(q), tools.limb, _NO_DIRECTION)
        place = situation.rotation, situation.origin
        near = self._table.within_reach(*place, *tools.samples.hull, self.settings.tolerance)
        if touch is not ContactKind.GRASP:
            near = near[near < self._faces]  # on what is round only a palm can lie
        if not len(near):
            return _failure(limb, Hindrance.REACH, f"no surface is within reach of {limb}")
        stuck = tools.collisions.stuck(situation.origin)
        if stuck is not None:
            why = f"{limb} collides wherever its joints are: {stuck[0]} in {stuck[1]}"
            return _failure(limb, Hindrance.COLLISION, why)
        sole = footprint(self.body, tools.limb, touch, self.rules)
        return _WithinReach(tools, situation, near, touch, sole)

    def _answer(
        self, reached: "_WithinReach", task: Task, heuristic: Heuristic, usable: UsableEfort | None
    ) -> GeneratedContact:
        """Steps 2 to 4 for one task; surfaces that face another way are not looked at."""
        tools, numbers = reached.tools, reached.surfaces
        situation = replace(reached.situation, reaction=task.reaction_on(tools.limb.name))
        reached = replace(reached, situation=situation)
        if usable is not None:
            most_efort = tools.samples.largest_ratio * (self._table.normals[numbers] @ situation.reaction)
            numbers = numbers[usable.signed(most_efort) >= usable.least]
        candidates = self._samples_in_contact(reached, numbers)
        if not len(candidates):
            return self._none_lies(reached, usable)
        if usable is None:
            scores, rows = heuristic.score(situation, candidates), np.arange(len(candidates))
        else:
            order = Efort(usable.pulling)
            values = order.score(situation, candidates)
            rows = np.flatnonzero(values >= usable.least)
            scores = values if heuristic == order else heuristic.score(situation, candidates)
        if not len(rows):
            return self._none_lies(reached, usable)
        return self._choose(reached, candidates, scores, rows, usable)

    def _samples_in_contact(self, reached: "_WithinReach", numbers: IntArray) -> Candidates:
        """Step 2: samples on some of the surfaces within reach."""
        if reached.lying:
            return reached.lying[0].on(numbers)
        candidates = find_candidates(
            self._table, numbers, reached.situation, reached.tools.samples,
            tolerance=self.settings.tolerance, max_tilt=self.settings.max_tilt, footprint=reached.footprint,
        )  # fmt: skip
        if reached.kind is ContactKind.GRASP and len(candidates):
            candidates = replace(candidates, points=self._scene.palms(candidates.surfaces, candidates.points))
        return candidates

    def _none_lies(self, reached: "_WithinReach", usable: UsableEfort | None) -> GeneratedContact:
        """Failure of a limb of which no sample lies on a surface, or on none that pushes it the asked way."""
        limb, near = reached.tools.limb.name, reached.surfaces
        candidates = self._samples_in_contact(reached, near)
        reached.lying[:] = [candidates]
        if usable is None or not len(candidates):
            where = f"flat on a surface of {self._names(near)}, though these are near"
            return _failure(limb, Hindrance.SURFACE, f"no sample of {limb} lies {where}")
        best = float(Efort(usable.pulling).score(reached.situation, candidates).max())
        does = "holds" if usable.pulling else "pushes"
        message = (
            f"no surface in reach of {limb} ({self._names(candidates.surfaces)}) {does} it that way: "
            f"the best EFORT is {round(best, 6) + 0.0:.2g} N per N.m, usable {usable.least:.2g}"
        )
        return _failure(limb, Hindrance.DIRECTION, message, len(candidates))

    def _names(self, surfaces: IntArray) -> str:
        """Names of the obstacles of some surfaces."""
        near = (self._table.surfaces[number].obstacles for number in np.unique(surfaces))
        return ", ".join(sorted(set[str]().union(*near)))

    def _choose(
        self, reached: "_WithinReach", candidates: Candidates, scores: FloatArray, rows: IntArray,
        usable: UsableEfort | None,
    ) -> GeneratedContact:  # fmt: skip
        """Steps 3 and 4: of some rows best first, the first that can be aligned, are usable and free."""
        tools, situation, kind = reached.tools, reached.situation, reached.kind
        faults: _Faults = Counter()
        tried, flat = 0, kind is ContactKind.SOLE
        gap, allowed = tools.allowed(self.settings, flat=flat)
        q, direction, begun = np.array(situation.state.q), situation.reaction @ situation.rotation, False
        order = rows[_order(scores[rows])[: _LOOKED_AT * self.settings.tries]]
        for row, goal in self._worth_trying(reached, candidates, order, faults):
            if tried == self.settings.tries:
                break
            tried, point = tried + 1, candidates.points[row]
            aligned = tools.aligner.align(*goal, allowed)
            lies = aligned.lies(allowed, gap)
            if not lies or not tools.natural(aligned.angles):
                faults[_UNNATURAL if lies else _TILTED] += 1
                continue
            q[tools.chain.slots] = aligned.angles
            if not begun:
                tools.collisions.begin(situation.state.q, situation.origin)
                begun = True
            surface = int(candidates.surfaces[row])
            hit = tools.collisions.first(q, self._table.surfaces[surface].obstacles)
            if hit is not None:
                faults[hit] += 1
                continue
            turn = situation.rotation @ aligned.rotation
            if flat and not self._table.carries_one(point + reached.footprint @ turn.T, surface):
                faults[_TILTED] += 1
                continue
            alpha = float(efort(aligned.product[None], direction, goal[2][None])[0])
            if usable is not None and usable.signed(alpha) < usable.least:
                faults[_WEAK] += 1
                continue
            frame = onto_normal(turn, candidates.normals[row])
            contact = make_contact(self.body, tools.limb, kind, point, frame, self.rules)
            return GeneratedContact(
                tools.limb.name, contact, q.copy(), self._table.surfaces[surface].obstacles,
                float(scores[row]), len(candidates), tried, gap=0.0 if len(tools.chain) else aligned.error,
                efort=alpha,
            )  # fmt: skip
        return _none_fits(tools.limb.name, faults, len(candidates), usable)

    def _worth_trying(
        self, reached: "_WithinReach", candidates: Candidates, order: IntArray, faults: _Faults
    ) -> Iterator[tuple[int, tuple[FloatArray, FloatArray, FloatArray]]]:
        """Rows in order with angles to begin with, and point and normal in the limb's frame.

        As soon as the limb itself, not its end, has collided a few times, candidates that are deep in
        something are left out; they count as collisions.
        """
        tools, situation = reached.tools, reached.situation
        start, size, around = 0, _FEW, None
        while start < len(order):
            rows = order[start : start + size]
            start += size
            if sum(count for hit, count in faults.items() if hit[0] in tools.deep.shapes) >= _FEW // 2:
                around = around or tools.deep.around(situation.rotation, situation.origin)
                deep = tools.deep.pairs(around, candidates.samples[rows], self.settings.tolerance)
                faults.update(tools.collisions.names[pair] for pair in deep[deep >= 0].tolist())
                rows, size = rows[deep < 0], _BLOCK
            goals = (
                tools.samples.angles.take(candidates.samples[rows], axis=0),
                (candidates.points.take(rows, axis=0) - situation.origin) @ situation.rotation,
                candidates.normals.take(rows, axis=0) @ situation.rotation,
            )
            yield from zip(rows.tolist(), zip(*goals, strict=True), strict=True)
            size = max(size, _SOME)


@dataclass(frozen=True, eq=False)
class _WithinReach:
    """Surfaces within reach of a limb, by their numbers; the situation has no direction yet.

    Samples on all of them are in ``lying`` as soon as they are known.
    """

    tools: "_LimbTools"
    situation: Situation
    surfaces: IntArray
    kind: ContactKind
    footprint: FloatArray
    lying: list[Candidates] = field(default_factory=list)


class _LimbTools:
    """What one limb needs for its requests."""

    def __init__(self, body: BodyModel, limb: Limb, scene: Scene, samples: LimbSamples) -> None:
        self.limb, self.samples, self.chain = limb, samples, LimbKinematics(body, limb)
        self.aligner, self.collisions = Aligner(self.chain), LimbCollisions(body, limb, scene)
        self.deep = DeepSamples(body, self.chain, samples, self.collisions)
        self._range = NaturalRange(body, limb) if samples.natural else None
        # Made now, not during a request.
        _ = samples.leaves, samples.manipulability, samples.hull, samples.largest_ratio

    def allowed(self, settings: GeneratorSettings, *, flat: bool) -> tuple[float, float]:
        """Distance [m] and tilt [rad] that the alignment may leave; what no joint moves is taken as it is."""
        if not len(self.chain):
            return settings.tolerance, settings.point_tilt
        return POSITION_TOLERANCE, TILT_TOLERANCE if flat else settings.point_tilt

    def natural(self, angles: FloatArray) -> bool:
        """Whether a limb at angles (k,) is hardly beyond a learnt range of motion; so where none counts."""
        return self._range is None or bool(self._range.volume_distance(angles[None])[0] >= -NATURAL_SLACK)


def _order(scores: FloatArray) -> IntArray:
    """Candidates in the order of their trial: down the scores in ever longer steps, then those left out.

    Neighbours in the order are often neighbours in space and collide with the same thing.
    """
    order = np.argsort(-scores, kind="stable")
    steps = _STEPS[: int(np.searchsorted(_STEPS, len(order)))]
    left = np.ones(len(order), dtype=bool)
    left[steps] = False
    return order[np.concatenate([steps, np.flatnonzero(left)])]


def _failure(limb: str, kind: Hindrance, why: str, candidates: int = 0, tried: int = 0) -> GeneratedContact:
    return GeneratedContact(limb, None, None, (), -np.inf, candidates, tried, kind, why)


def _none_fits(limb: str, faults: _Faults, candidates: int, usable: UsableEfort | None) -> GeneratedContact:
    tried = sum(faults.values())
    tilted, unnatural, weak = (faults.pop(kind, 0) for kind in (_TILTED, _UNNATURAL, _WEAK))
    collided = sum(faults.values())
    counts = {
        Hindrance.ALIGNMENT: tilted + unnatural, Hindrance.COLLISION: collided, Hindrance.DIRECTION: weak
    }  # fmt: skip
    kind = max(counts, key=lambda item: counts[item])
    what = [f"{tilted} cannot lie flat on the surface"] * (tilted > 0)
    what += [f"{unnatural} are beyond the range of motion"] * (unnatural > 0)
    what += [f"{weak} have too little EFORT in their posture"] * (weak > 0)
    if collided:
        (shape, other), count = faults.most_common(1)[0]
        what.append(f"{collided} collide, {count} by {shape} in {other}")
    which = "" if usable is None else f" with an EFORT of {usable.least:.2g} N per N.m or more"
    message = f"none of {tried} contacts of {limb}{which} out of {candidates} is possible: {', '.join(what)}"
    return _failure(limb, kind, message, candidates, tried)
