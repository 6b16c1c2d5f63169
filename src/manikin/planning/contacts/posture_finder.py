"""Balanced, free postures on given contacts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise, product

import numpy as np
import pinocchio as pin

from manikin.balance.criteria import RestingTorques, StaticRegion, static_torque_share
from manikin.body import BodyModel, Configuration, with_root
from manikin.contact import Contact, ContactKind, ContactModel, FrictionModel, Stance
from manikin.kinematics import (
    Placement,
    PostureProblem,
    Preferences,
    SolverSettings,
    generate_posture,
    pairs_beside,
    touching_pairs,
)
from manikin.kinematics.posture_terms import BESIDE, GRASPING, NEARBY, SINKING
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import Contacts
from manikin.scene import Proximity, Scene
from manikin.scene.distance import NOTHING, Ignored

ROOT = 7  # numbers of a posture that are the pose of its root
EASING_MOVES, EASING_TURN = 8, (0.3, 0.03)
"""Most moves towards an easier posture; the first and the least turns of its joints [rad]."""
EASY, EASY_ENOUGH = 0.9, 0.98  # shares of the strength at which they aim, and with which they end
LIKE_BEFORE = Preferences(hinges={}, pelvis=0.0, trunk=0.0, head=0.0, arms=0.0)
"""What is wished for where a posture is near another one: that all its hinges stay."""
BETWEEN, CROSSED = (0.25, 0.5, 0.75), 0.005
"""Shares of a way between postures at which parts of the body are tested, and how deep they may be in each
other there, as a motion bends round a little [m]; our choice."""
STAYING, ARM = ("pelvis", "lumbar", "thorax", "neck", "head", "upper_arm"), "arm"
"""Ends of the names of segments that steps take round nothing, and what names of arms contain."""
LEARNT_MARGIN = 0.01  # angle that such postures keep to the surface of a learnt volume [rad]; our choice


@dataclass(frozen=True)
class PostureFinderSettings:
    """Requirements on the postures of a contact plan; the values are our choice.

    Attributes:
        clearance, self_clearance: Distances to obstacles and between body parts [m].
        range_margin: Angle to the ends of the joint ranges [rad].
        natural: Whether hips and shoulders of a human keep to their learnt volumes as well.
        inset: Distance of the centre of mass to the edges of the region where it may rest [m].
        root_weight: Weight of the distance between the root and the guide [1/m^2].
        turn_weight: Weight of the angle between the root and the guide [1/rad^2].
        tolerance: Largest residual of a contact [m, rad].
        iterations: Iterations of each search.
        friction_model: Friction model of the stances on which the body has to be able to rest.
        forearms_beside: Whether forearms may come as near as 3.5 mm to what their hands hold.
    """

    clearance: float = 0.014
    self_clearance: float = 0.014
    range_margin: float = 0.05
    natural: bool = False
    inset: float = 0.045
    root_weight: float = 2.0
    turn_weight: float = 2.0
    tolerance: float = 2e-4
    iterations: int = 40
    friction_model: FrictionModel = "outer"
    forearms_beside: bool = True

    def scaled(self, factor: float) -> "PostureFinderSettings":
        """Settings for a body of another size: lengths times a factor."""
        return replace(
            self, clearance=factor * self.clearance, self_clearance=factor * self.self_clearance,
            inset=factor * self.inset, root_weight=self.root_weight / factor**2,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Posed:
    """A posture, or why there is none.

    Attributes:
        q: (nq,) or None.
        reason: In one line, where there is none, or where it is too hard.
        too_hard: Whether the joints are too weak to rest in it.
    """

    q: FloatArray | None
    reason: str = ""
    too_hard: bool = False

    @property
    def at_rest(self) -> "Posed":
        """The posture, or the reason why it is none, where the joints are too weak for it."""
        return Posed(None, self.reason, too_hard=True) if self.too_hard else self


UPRIGHT = {"knee": 1.0, "wrist": 6.0}
"""Weights with which shanks on knees and hands on their heels are level, other points 0.05 [1/rad^2]."""


class PostureFinder:
    """Finds postures of a body in a scene; ``searches`` counts those looked for so far."""

    def __init__(
        self, body: BodyModel, scene: Scene, reference: FloatArray | None = None,
        settings: PostureFinderSettings | None = None,
    ) -> None:  # fmt: skip
        """Prepare a scene; postures are like a reference (nq,), or standing, where there is freedom."""
        self.body, self._root = with_root(body)
        self.scene, self._reference = scene, reference
        self.settings, self.searches = settings or PostureFinderSettings(), 0
        standing = np.array(body.standing_posture())
        self.model = ContactModel.of_body(body.mass, self.settings.friction_model)
        self._ahead = np.zeros(3) if body.stature else Configuration(body, standing).com - standing[:3]
        self._proximity = Proximity(self.body, scene)
        self._regions: dict[frozenset[Contact], StaticRegion] = {}
        self._touched = cache(scene.touched_obstacles)

    def pose(
        self, held: Contacts, carrying: Contacts, start: FloatArray,
        guide: FloatArray | None = None, *, place: FloatArray | None = None, inset: float | None = None,
        com_weight: float | None = None, restarts: bool = False,
        placements: Mapping[str, Placement] | None = None, preferences: Preferences | None = None,
        upright: bool = True, through: bool = False,
    ) -> Posed:  # fmt: skip
        """Find a posture that holds contacts, points upright, and rests on some of them alone.

        Args:
            held: Contacts that are held.
            carrying: Those that carry the body.
            start: (nq,) where to begin.
            guide: (7,) pose of the root to be near, or (nq,) posture to be like; none when omitted.
            place: (2,) where the centre of mass has to be [m]; near the guide, or where it is, when omitted.
            inset: Distance of that place to the edges of where it may rest [m]; the settings' when omitted.
            com_weight: Weight with which that place is only wished for [1/m^2]; it is required when omitted.
            restarts: Whether to try again from crouched postures.
            placements: Where further effectors should be, by name.
            preferences: Weights of what is not required; the default ones when omitted.
            upright: Whether points are wished upright on their surfaces.
            through: Whether to come to the contacts through the obstacles, where there is no other way.
        """
        if place is None:
            near = self._com_at(start if guide is None else guide)
            place = self.resting_place(carrying, near, self.settings.inset if inset is None else inset)
        if place is None:
            return Posed(None, f"{', '.join(carrying) or 'nothing'} cannot carry the body at rest")
        self.searches += 1
        settings, led = self.settings, {} if guide is None else self.led(guide[:ROOT])
        whole = guide is not None and len(guide) > ROOT
        ignore, touching = self._near(held)
        points = {
            name: Placement(None, item.rotation_contact_to_world, UPRIGHT.get(name.partition("_")[2], 0.05))
            for name, item in held.items() if upright and item.kind is ContactKind.POINT
        }  # fmt: skip
        problem = PostureProblem(
            self.body, tuple(held.values()),
            {**led, **points, **(placements or {})},
            com=np.array([*place, np.nan]),
            com_weight=com_weight, proximity=self._proximity, clearance=settings.clearance,
            self_clearance=settings.self_clearance, ignore=ignore, touching=touching,
            range_margin=settings.range_margin, learnt_margin=LEARNT_MARGIN if settings.natural else None,
            reference=guide if whole else self._reference, preferences=preferences or Preferences(),
        )  # fmt: skip
        once = SolverSettings(
            tolerance=settings.tolerance, iterations=settings.iterations, restarts=False, explain=False
        )
        if guide is not None:
            # The guide's trunk is free, so that from there no obstacle is passed on its wrong side.
            there = guide if whole else np.concatenate([guide, start[ROOT:]])
            result = generate_posture(problem, there, settings=once)
            if result.succeeded:
                return Posed(result.q)
        result = generate_posture(problem, start, settings=replace(once, restarts=restarts))
        if through and not result.succeeded:
            there = start if guide is None or whole else np.concatenate([guide, start[ROOT:]])
            free = generate_posture(replace(problem, proximity=None), there, settings=once)
            result = generate_posture(problem, free.q, settings=once) if free.succeeded else result
        return Posed(result.q) if result.succeeded else Posed(None, result.failure or "no posture")

    def standing_at(self, root: FloatArray) -> FloatArray:
        """(nq,) the reference posture, or a standing one, with the root at a pose (7,)."""
        whole = self.body.standing_posture() if self._reference is None else self._reference
        return np.concatenate([root[:ROOT], whole[ROOT:]])

    def clears(self, contact: Contact) -> bool:
        """Whether the end of a limb keeps the clearance at a contact to what it does not touch."""
        shape = self.body.segment(self.body.effector(contact.effector).segment).shapes[-1]
        least = self.settings.clearance + shape.size[0]
        return bool(self.scene.distance_beside(contact.position, self._touched(contact)) >= least)

    def crossing(self, *postures: FloatArray, deeper: float = CROSSED, step: bool = False) -> str:
        """What straight ways from posture to posture take through each other by more than a depth; or empty.

        It is parts of the body. Of a ``step``, in which limbs go round each other and round obstacles, it is
        trunk, head or upper arms and anything else, or forearms and the body.
        """
        model = self.body.pinocchio
        ways = [pin.interpolate(model, *pair, share) for pair in pairwise(postures) for share in BETWEEN]
        proximity, ignored = (self._proximity, self._of_steps) if step else (self._own, NOTHING)
        found = proximity.minimum_over(np.array(ways), ignored, tolerance=1e-3)
        return " and ".join(found.pair or ()) if found.distance < -deeper else ""

    @cached_property
    def _own(self) -> Proximity:
        """Distances between parts of the body alone."""
        return Proximity(self.body, Scene((), None))

    @cached_property
    def _of_steps(self) -> Ignored:
        """Pairs of which a step takes one round the other."""
        own = frozenset(self._own.pairs)

        def stays(name: str) -> bool:
            return name.partition("/")[0].endswith(STAYING)

        return frozenset(
            (first, second) for first, second in self._proximity.pairs
            if not stays(first) and not ((first, second) in own and (stays(second) or ARM in first + second))
        )  # fmt: skip

    def eased(
        self, posed: Posed, held: Contacts, carrying: Contacts,
        placements: Mapping[str, Placement] | None = None, *, upright: bool = True,
    ) -> Posed:  # fmt: skip
        """A posture that the joints can hold at rest: the given one, or one near it that asks for less.

        Each move keeps contacts and joint ranges, and is put back onto what else is required. Where no
        posture is found, the one that asks for the least is told with the reason; the other arguments are
        those of :meth:`pose`.
        """
        if posed.q is None:
            return posed
        body, stance, margin = self.body, self._held_by(carrying), self.settings.range_margin
        now, turn, best = RestingTorques(body, posed.q, stance), EASING_TURN[0], posed.q
        for _ in range(EASING_MOVES if now.share > 1.0 else 0):
            state, wide = Configuration(body, best), np.full(body.nv, turn)
            low, high = -wide, wide.copy()
            low[6:] = np.clip(body.lower + margin - best[ROOT:], low[6:], 0.0)
            high[6:] = np.clip(body.upper - margin - best[ROOT:], 0.0, high[6:])
            still = np.vstack([
                state.effector_jacobian(name)[: 3 if contact.kind is ContactKind.POINT else 6]
                for name, contact in held.items()
            ])  # fmt: skip
            move = now.easing(still, (low, high), EASY)
            if move is None or now.share - move[1] < 0.003:
                break
            near = pin.integrate(body.pinocchio, best, move[0])
            q = self.pose(
                held, carrying, near, near, placements=placements, preferences=LIKE_BEFORE, upright=upright
            ).q
            then = None if q is None else RestingTorques(body, q, stance)
            if q is not None and then is not None and then.share < now.share - 0.1 * (now.share - move[1]):
                now, best, turn = then, q, min(1.5 * turn, 0.5)
            else:
                turn *= 0.4
            if now.share <= EASY_ENOUGH or turn < EASING_TURN[1]:
                break
        return Posed(best, _strained(carrying, now.share, 1.0), too_hard=now.share > 1.0)

    def strained(
        self, q: FloatArray, carrying: Contacts, most: float, acceleration: FloatArray | None = None
    ) -> str:
        """Message that a posture (nq,) asks for more than a share of the strength; empty where it does not.

        The body rests in it on contacts, or has an acceleration (3,) there [m/s^2].
        """
        share = static_torque_share(self.body, q, self._held_by(carrying), acceleration)
        return _strained(carrying, share, most)

    def _held_by(self, carrying: Contacts) -> Stance:
        """Contacts with friction inside Coulomb's cone: no posture is held by forces outside of it."""
        return Stance(tuple(carrying.values()), model=replace(self.model, friction="cone"))

    def _stance(self, carrying: Contacts) -> Stance:
        return Stance(tuple(carrying.values()), model=self.model)

    def resting_place(self, carrying: Contacts, near: FloatArray, inset: float) -> FloatArray | None:
        """(2,) place nearest to another where the centre of mass can rest on contacts; None without any.

        It keeps a distance ``inset`` to the edges of where it may rest [m].
        """
        key = frozenset(carrying.values())
        if key not in self._regions:
            self._regions[key] = StaticRegion.of(self._stance(carrying), self.body.mass)
        return self._regions[key].nearest(near, inset)

    def inner_place(self, carrying: Contacts, guide: FloatArray) -> FloatArray | None:
        """(2,) place halfway from where a posture near (7,) pose rests to the middle of its contacts."""
        place = self.resting_place(carrying, self._com_at(guide), self.settings.inset)
        middle = np.mean([item.position[:2] for item in carrying.values()], axis=0)
        return None if place is None else self.resting_place(carrying, 0.5 * (place + middle), 0.0)

    def _com_at(self, posture: FloatArray) -> FloatArray:
        """(2,) centre of mass of an (nq,) posture, or about where it is with its root at a (7,) pose [m]."""
        if len(posture) > ROOT:
            return np.asarray(Configuration(self.body, posture).com[:2])
        # Over the root of a person, and over what a creature has ahead of its root.
        return np.asarray(posture[:2] + (pin.XYZQUATToSE3(posture).rotation @ self._ahead)[:2])

    def led(self, guide: FloatArray) -> dict[str, Placement]:
        """Wish for the root to be near a (7,) pose, by the root's effector."""
        pose, settings = pin.XYZQUATToSE3(guide), self.settings
        wish = Placement(pose.translation, pose.rotation, settings.turn_weight, settings.root_weight)
        return {self._root: wish}

    def _near(self, held: Contacts) -> tuple[Ignored, dict[tuple[str, str], float]]:
        """Pairs that touch, and distances of those of which it is limited [m]."""
        touched = [(name, obstacle) for name, item in held.items() for obstacle in self._touched(item)]
        points, grasps = (
            [pair for pair in touched if held[pair[0]].kind is kind]
            for kind in (ContactKind.POINT, ContactKind.GRASP)
        )  # fmt: skip
        forearms = {(parent, obstacle) for name, obstacle in grasps if (parent := self._parent(name))}
        limited = (
            *product(touching_pairs(self.body, points), (SINKING,)),
            *product(touching_pairs(self.body, grasps), (GRASPING,)),
            *product(pairs_beside(self.body, touched), (BESIDE,)),
            *product(forearms if self.settings.forearms_beside else (), (NEARBY,)),
        )  # fmt: skip
        return touching_pairs(self.body, touched), dict(limited)

    def _parent(self, effector: str) -> str | None:
        """Segment on which that of an effector hangs."""
        return self.body.segment(self.body.effector(effector).segment).parent


def _strained(carrying: Contacts, share: float, most: float) -> str:
    names = " and ".join(carrying)
    if not math.isfinite(share):
        return f"{names} cannot carry the body"
    return f"carrying the body on {names} takes {share:.2f} of the strength" if share > most else ""
