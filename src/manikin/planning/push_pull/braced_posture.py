"""The posture that acts: trunk, hands and feet by EFORT, then balance, strength and obstacles."""

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import stature_of
from manikin.contact import Contact, FrictionModel, grasp
from manikin.kinematics import Preferences
from manikin.kinematics.efort import Task
from manikin.kinematics.limb_samples import LimbSamples
from manikin.kinematics.trunk_postures import TrunkClearance, TrunkPostures
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.planning.contacts import (
    ContactGenerator,
    ContactPlan,
    ContactRules,
    Efort,
    Heuristic,
    PostureFinder,
    PostureFinderSettings,
    Stage,
    WeightedSum,
)
from manikin.planning.contacts.contact_plan import COM_ROOM
from manikin.planning.push_pull.act import STRONG, Act, ActKind, BracedForces, largest_force, share_force
from manikin.planning.push_pull.stance_heuristics import (
    LEVEL,
    BraceFooting,
    Loads,
    Mirrored,
    Natural,
)
from manikin.scene import Scene, Surface

ARMS = ("left_arm", "right_arm")
LEGS = ("right_leg", "left_leg")
"""Limbs in the order in which they are asked; the first leg braces, the second one balances."""

BALANCED = 1e3
"""Weight of balance beside EFORT: among balanced places EFORT decides."""

FLAT_PALMS = 3.0
"""Weight of the palms' turn against the face [1/rad^2]."""

HANDS_ROOM = 0.2
"""Distance of the body's middle to the sides of what it acts on [m]; our choice."""

REACHING_TIME = 1.2
"""Shortest time in which the hands go to the object [s]; our choice."""

TOUCHING_TIME = 0.5
"""Shortest time from their touch to the act [s]."""

ROOM = (0.02, 0.02, 0.02)
"""How far from that of the posture the centre of mass may be when the hands touch [m]."""

LIFTING_TIME = 1.2
"""Shortest time in which a foot goes to a wall [s]; our choice, as the next ones."""

BESIDE = 0.2
"""Distance of two feet that stand, of a body of 1.75 m [m]."""

BEHIND = (0.0, 0.1, 0.2, 0.3)
"""Distances at which one of them is tried behind the other, of that body [m]."""

HIGHEST = 0.6
"""Height of a foot on a wall, relative to that of the root that stands."""

UNBALANCED = "no stance of the feet is balanced without and with the force"

_HANDS, _FEET, _POSTURE, _STRENGTH = _STEPS = range(4)
"""What is looked for in turn; the farthest step that was reached explains a failure."""


@dataclass(frozen=True)
class BraceSettings:
    """Settings of the search for a posture that acts, for a body of 1.75 m; the values are our choice.

    Attributes:
        distances: Distances of the root from the face that is acted on [m].
        heights: Heights of the root, relative to standing.
        leans: Pitch of the root the way of the act [rad].
        margin: Least margin of the feet about the CoM with no force and with all of it [N.m].
        torque_share: Largest share of a joint's strength.
        enough: Postures that act after which the best one is taken.
        palm_room: Distance of the palms to the face [m]: the wrist of our shapes is thicker than the hand.
        friction_model: Friction model of feet and palms.
    """

    distances: tuple[float, ...] = (0.60, 0.52, 0.68, 0.44, 0.76, 0.36, 0.30)
    heights: tuple[float, ...] = (0.95, 0.88, 0.98)
    leans: tuple[float, ...] = (0.3, 0.2, 0.1, 0.0)
    margin: float = 10.9
    torque_share: float = STRONG
    enough: int = 8
    palm_room: float = 0.02
    friction: float = 0.7
    friction_model: FrictionModel = "outer"


@dataclass(frozen=True, eq=False)
class Brace:
    """A posture that acts.

    Attributes:
        q: (nq,).
        feet: Contacts by effector.
        hands: Contacts by effector, holds at which the object's reaction is felt.
        forces: With the act's force, torques as even as can be.
        largest: With the largest force the posture can exert.
        margin: Least margin of the feet alone with no force and with all of it [N.m].
        stages: From both feet on the ground, the hands still free, to the posture.
    """

    q: FloatArray
    feet: Mapping[str, Contact]
    hands: Mapping[str, Contact]
    forces: BracedForces
    largest: BracedForces
    margin: float
    stages: tuple[Stage, ...]

    @property
    def contacts(self) -> dict[str, Contact]:
        """Feet and hands."""
        return {**self.feet, **self.hands}


@dataclass(frozen=True, eq=False)
class BraceResult:
    """A posture that acts, or why there is none.

    Attributes:
        brace: The one that takes the least share of the strength.
        tried: Places of the trunk.
        strongest: Largest force of any balanced posture that was found [N]; 0 without one.
        others: Further ones, the next best first.
    """

    brace: Brace | None
    tried: int
    strongest: float
    failure: str | None = None
    others: tuple[Brace, ...] = ()


def find_braced_posture(
    body: BodyModel, scene: Scene, samples: Mapping[str, LimbSamples], act: Act, near: FloatArray, *,
    level: float = 0.0, settings: BraceSettings | None = None, hands_by: Heuristic | None = None,
    feet_by: Heuristic | None = None, reference: FloatArray | None = None,
) -> BraceResult:  # fmt: skip
    """Find where hands and feet of a body act with EFORT, and a posture that can.

    Args:
        near: (2,) where the body comes from; it acts on the part of the object nearest to there [m].
        level: Height of the ground [m].
        hands_by: What hands prefer; EFORT, pulling EFORT for a pull, when omitted.
        feet_by: What feet prefer; EFORT when omitted.
        reference: (nq,) posture to be like where the task leaves freedom; standing when omitted.
    """
    search = _BraceSearch(body, scene, samples, act, settings or BraceSettings(), reference)
    return search.run(np.append(near, level), hands_by or act.hand_heuristic(), feet_by or Efort())


class _BraceSearch:
    def __init__(
        self, body: BodyModel, scene: Scene, samples: Mapping[str, LimbSamples], act: Act,
        settings: BraceSettings, reference: FloatArray | None,
    ) -> None:  # fmt: skip
        self._body, self._scene, self._act, self._settings = body, scene, act, settings
        self._rules = ContactRules(friction=settings.friction)
        self._generator = ContactGenerator(body, scene, samples, rules=self._rules)
        self._reference = body.standing_posture() if reference is None else reference
        asked = PostureFinderSettings(natural=any(item.natural for item in samples.values()))
        self._poser = PostureFinder(body, scene, self._reference, asked)
        self._upright = TrunkPostures.of(body).upright
        self._clearance = TrunkClearance(TrunkPostures.of(body), scene)
        self._reasons: dict[int, Counter[str]] = {step: Counter() for step in _STEPS}
        self._tried, self._strongest, self._highest = 0, 0.0, np.inf
        facing = act.facing
        self._across = np.array([-facing[1], facing[0], 0.0])
        self._yaw = float(np.arctan2(facing[1], facing[0]))

    def run(self, near: FloatArray, hands_by: Heuristic, feet_by: Heuristic) -> BraceResult:
        faces = [
            face
            for face in self._scene.surfaces
            if self._act.obstacle in face.obstacles and float(face.normal @ self._act.facing) < -0.7
        ]
        if not faces:
            reason = f"{self._act.obstacle} has no face against {self._act.kind}ing hands"
            return BraceResult(None, self._tried, self._strongest, reason)
        self._highest = float(near[2]) + HIGHEST * float(self._reference[2])
        for on_wall in (False, True):
            tries = (self._at(q, hands_by, feet_by, on_wall=on_wall) for q in self._trunks(faces, near))
            found = (brace for brace in tries if brace is not None)
            braces = list(itertools.islice(found, self._settings.enough))
            if braces:
                break
        else:
            return BraceResult(None, self._tried, self._strongest, self._why())
        best, *others = sorted(braces, key=lambda item: item.forces.torque_share)
        return BraceResult(best, self._tried, self._strongest, others=tuple(others))

    def _trunks(self, faces: list[Surface], near: FloatArray) -> Iterator[FloatArray]:
        """Postures before the nearest face, the trunk at the settings' places."""
        settings, facing, across = self._settings, self._act.facing, self._across
        face = min(faces, key=lambda item: float((item.polygon @ facing).min()))
        depth = float((face.polygon @ facing).min())
        sides = face.polygon @ across
        low, high = float(sides.min()) + HANDS_ROOM, float(sides.max()) - HANDS_ROOM
        middle = 0.5 * (low + high) if low >= high else float(np.clip(float(near @ across), low, high))
        size = stature_of(self._body) / 1.75
        forwards = 1.0 if self._act.kind is ActKind.PUSH else -1.0
        for lean, height, distance in itertools.product(settings.leans, settings.heights, settings.distances):
            self._tried += 1
            q = np.array(self._reference)
            q[:2] = ((depth - distance * size) * facing + middle * across)[:2]
            q[2] = near[2] + height * q[2]
            q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, forwards * lean, self._yaw)).coeffs()
            yield q

    def _at(self, q: FloatArray, hands_by: Heuristic, feet_by: Heuristic, *, on_wall: bool) -> Brace | None:
        """Contacts and posture of one trunk, with a foot on a wall or none, or None."""
        posture, hands = self._hands(q, hands_by)
        if hands is None:
            return None
        both = np.array([np.zeros(6), self._act.load(hands.values())])
        loads = Loads(self._body.mass, both, self._settings.friction_model)
        posture, feet = self._feet(posture, loads, feet_by, on_wall=on_wall)
        if feet is None:
            return None
        near = Configuration(self._body, posture).com
        place, margin = loads.best_place(list(feet.values()), near, np.array([0.14, 0.1]))
        if margin < self._settings.margin:
            return self._none(_FEET, UNBALANCED)
        contacts = {**feet, **hands}
        posed = self._poser.pose(
            contacts, contacts, posture, place=place, placements=self._poser.led(q[:7]),
            preferences=Preferences(grasp=FLAT_PALMS),
        )  # fmt: skip
        if posed.q is None:
            return self._none(_POSTURE, posed.reason)
        return self._strong(posed.q, feet, hands, margin)

    def _stages(
        self, q: FloatArray, feet: dict[str, Contact], hands: dict[str, Contact]
    ) -> tuple[Stage, ...] | str:
        """From both feet on the ground to a posture, or why not; the hands hold on before a foot goes up."""
        acting = Stage.of(self._body, {**feet, **hands}, q, TOUCHING_TIME, ROOM)
        up = next((foot for foot, contact in feet.items() if contact.normal[2] < LEVEL), None)
        if up is None:
            return Stage.of(self._body, feet, q, REACHING_TIME), acting
        ((name, ground),) = ((foot, contact) for foot, contact in feet.items() if foot != up)
        standing, upright = self._arrival(name, ground, up)
        rest = {name: ground, **hands}
        steps = (standing, standing), ({**standing, **hands}, standing), ({**standing, **hands}, rest)
        postures = [upright]
        for (held, carrying), near in zip(steps, (upright, q, q), strict=True):
            posed = self._poser.pose(held, carrying, postures[-1], near[:7], restarts=True)
            if posed.q is None:
                return f"{up} does not come to the wall: {posed.reason}"
            postures.append(posed.q)
        # Arms that hold on leave the centre of mass less room.
        contacts, rooms = (standing, steps[1][0], rest), (COM_ROOM, ROOM, ROOM)
        changes = zip(
            contacts, postures[1:], (REACHING_TIME, TOUCHING_TIME, LIFTING_TIME), rooms, strict=True
        )
        return *(Stage.of(self._body, *item) for item in changes), acting

    def _arrival(self, name: str, ground: Contact, up: str) -> tuple[dict[str, Contact], FloatArray]:
        """Feet on the ground before one goes up, and the (nq,) posture upright above them.

        The one that goes up stands beside the other, or behind it where the body is upright only there.
        """
        size = stature_of(self._body) / 1.75
        aside = BESIDE * size * (1.0 if up.startswith("left") else -1.0) * self._across
        behind = np.array([ground.position + aside - back * size * self._act.facing for back in BEHIND])
        middles = 0.5 * (ground.position + behind)
        forwards = ground.rotation_contact_to_world[:, 0]
        heading = np.arctan2(forwards[1], forwards[0])
        places = np.column_stack([middles, np.full(len(middles), heading)])
        chosen = int(np.argmax(self._clearance.cheapest(places) == 0))
        place = frozen_array(behind[chosen], "place of the other foot [m]", (3,))
        standing = {name: ground, up: replace(ground, effector=up, position=place)}
        return standing, self._upright.at(places[chosen])

    def _none(self, step: int, reason: str) -> None:
        """Keep a reason for which a step found nothing."""
        self._reasons[step][reason] += 1

    def _strong(
        self, q: FloatArray, feet: dict[str, Contact], hands: dict[str, Contact], margin: float
    ) -> Brace | None:
        """The posture, if it can exert the force, or None."""
        contacts = [*feet.values(), *hands.values()]
        rub = self._settings.friction, self._settings.friction_model
        largest = largest_force(self._body, q, contacts, self._act, *rub)
        self._strongest = max(self._strongest, 0.0 if largest is None else largest.force)
        forces = share_force(self._body, q, contacts, self._act, *rub)
        if largest is None or forces is None or forces.torque_share > self._settings.torque_share:
            joint = "friction" if forces is None else forces.tightest
            return self._none(_STRENGTH, f"{joint} is too weak")
        stages = self._stages(q, feet, hands)
        if isinstance(stages, str):
            return self._none(_STRENGTH, stages)
        return Brace(q, feet, hands, forces, largest, margin, stages)

    def _hands(self, q: FloatArray, heuristic: Heuristic) -> tuple[FloatArray, dict[str, Contact] | None]:
        task, hands, middle, order = self._act.hand_task(ARMS), {}, np.array(q[:3]), heuristic
        for arm in ARMS:
            answer = self._generator.request(q, arm, task, order, kind=self._act.touch)
            if answer.contact is None or answer.q is None:
                return q, self._none(_HANDS, answer.message)
            if self._act.obstacle not in answer.obstacles:
                return q, self._none(_HANDS, f"{arm} prefers {answer.obstacle}")
            q = answer.q
            # Held so that any force up to a hand's strength is felt.
            contact, away = answer.contact, self._settings.palm_room * answer.contact.normal
            hands[contact.effector] = grasp(
                contact.effector, contact.position + away, max_force=self._rules.grasp_force,
                rotation=contact.rotation_contact_to_world,
            )  # fmt: skip
            if len(hands) == 2 and answer.score < 0.5 * BALANCED:
                return q, self._none(_HANDS, "the hands cannot act side by side")
            alike = Mirrored(contact, middle, self._across)
            order = WeightedSum([(1.0, heuristic), (BALANCED, alike)])
        return q, hands

    def _feet(
        self, q: FloatArray, loads: Loads, heuristic: Heuristic, *, on_wall: bool
    ) -> tuple[FloatArray, dict[str, Contact] | None]:
        """Posture and contacts of both feet, the first one on a wall or not."""
        task, natural = self._act.foot_task(self._body), Natural(self._yaw)
        bracing = replace(natural, wall=True, highest=self._highest) if on_wall else natural
        order = WeightedSum([(1.0, heuristic), (BALANCED, bracing)])
        first = self._generator.request(q, LEGS[0], Task(self._act.direction) if on_wall else task, order)
        if first.contact is None or first.q is None:
            return q, self._none(_FEET, first.message)
        balance = BraceFooting(loads, first.contact, natural, self._settings.margin, rules=self._rules)
        order = WeightedSum([(1.0, heuristic), (BALANCED, natural), (BALANCED, balance)])
        second = self._generator.request(first.q, LEGS[1], task, order)
        if second.contact is None or second.q is None:
            return q, self._none(_FEET, second.message)
        if min(first.score, second.score - BALANCED) < 0.5 * BALANCED:
            return q, self._none(_FEET, UNBALANCED)
        return second.q, {item.effector: item for item in (first.contact, second.contact)}

    def _why(self) -> str:
        act, farthest = self._act, max((step for step in _STEPS if self._reasons[step]), default=_HANDS)
        most = self._reasons[farthest].most_common(1)
        why = f"; nearest to it: {most[0][0]}" if most else ""
        best = f" (the strongest balanced one {self._strongest:.0f} N)" if self._strongest > 0.0 else ""
        return (
            f"none of {self._tried} places of the trunk has a posture to {act.kind} {act.obstacle} "
            f"with {act.force:g} N{best}{why}"
        )


def arrival(brace: Brace) -> Stage:
    """Goal of the way: both feet on the ground, the hands still free."""
    return brace.stages[0]


def with_hands(body: BodyModel, way: ContactPlan, brace: Brace) -> ContactPlan:
    """The way to the feet of an act, the hands put to the object, both at once, and a foot to a wall."""
    last = way.stages[-1]
    reaching = Stage.of(body, last.contacts, last.q, REACHING_TIME, last.com_room)
    acting = [replace(stage, contacts=_kept(last.contacts, stage.contacts)) for stage in brace.stages[1:]]
    return ContactPlan.of(body, [*way.stages[:-1], reaching, *acting], brace.q)


def _kept(before: Mapping[str, Contact], contacts: Mapping[str, Contact]) -> dict[str, Contact]:
    """Contacts, those of before where they are at the same place."""
    same = {n: c for n, c in before.items() if n in contacts and contacts[n].same_place(c)}
    return {**same, **{name: contact for name, contact in contacts.items() if name not in same}}
