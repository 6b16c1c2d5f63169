"""Sit on a seat and leave it: where the buttocks and feet are, and the stages up to standing.

Whether a person can rise depends on the start: feet drawn back below the knees, thighs that do not press on
the seat's edge, buttocks far enough in front.  Legs on a seat are two triangles seen from the side, so that
all places and slopes of the shanks are compared in closed form (:class:`Sitter`), and only the best few are
tried with the whole body.  The body leaves the seat at rest where it can lean until its weight is over its
feet, else in motion (:mod:`manikin.balance.capturability`), else with hands that push on armrests, a table
or the seat.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from manikin.balance.capturability import momentum_to_rest
from manikin.body import BodyModel, Configuration
from manikin.body.anthropometry import ANKLE_FROM_HEEL
from manikin.body.human import BUTTOCK_RADIUS, SEAT_LENGTH, SEAT_WIDTH
from manikin.body.limbs import of_both_sides, stature_of
from manikin.body.segments import FEET
from manikin.contact import Contact, Stance, point, rolling_front, sole
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import FloatArray, onto_normal, rotation_from_yaw
from manikin.planning.contacts.contact_plan import ContactPlan, Contacts, Stage
from manikin.planning.contacts.footholds import Footholds
from manikin.planning.contacts.posture_finder import PostureFinder
from manikin.scene import Scene, Surface

SEATED_ON = frozenset({"buttocks"})  # effectors with which a body sits
STRENGTH_SHARE = 0.95  # largest share of the strength of a joint with which a seat is left
SEAT_FRICTION = 0.3  # Coulomb coefficient of clothes on a seat; our choice
SHANK_SLOPE = float(np.deg2rad(12.0))  # slope that is liked, knee before ankle [rad]; people have 0 to 20 deg
SLOPES = np.deg2rad(np.arange(-25.0, 28.1, 1.0))  # slopes of the shank that are compared [rad]
FORWARD = np.arange(0.0, 0.161, 0.01)  # ways of the buttocks towards the seat's edge [statures]
APART = 0.07  # distance of the middle of a sole from the body's middle plane [statures]
LIKED = (0.05, float(np.deg2rad(12.0)), 0.012)
"""Way forward [statures], deviation of the shank's slope [rad] and gap between the farthest lean and the
heels [statures] that count alike; our choice."""
CALF_ROOM = 0.016  # distance of the calves to the edge of the seat [m]
SEAT_THICKNESS = 0.05  # depth below the top of a seat at which calves keep that distance [m]; our choice
FEET_SPACING = 0.01  # distance of the places that are tried for the feet [m]
TRIED = 6  # sittings that are tried with the whole body
LEAN = {
    "hip_flexion": 1.5, "knee_flexion": 1.6, "ankle_dorsiflexion": 0.1, "lumbar_flexion": 0.8,
    "thorax_flexion": 0.5, "neck_flexion": -0.4,
}  # fmt: skip
"""Angles of a body that leans far forward on a seat, its pelvis flat [rad]."""

LEAN_PITCH = 0.5  # pitch of the pelvis of a body that leans far, where it rolls on the buttocks [rad]
Sitting = tuple[dict[str, Contact], FloatArray]
"""Contacts of buttocks and feet, and a posture (nq,) near one that holds them."""


class Sitter:
    """Compares ways to sit of one human body."""

    def __init__(self, body: BodyModel, footholds: Footholds, friction: float, *, rolls: bool = True) -> None:
        """Take the lengths of the body, whose pelvis lies flat if it may not roll; the friction is of soles.

        Raises:
            BodyError: If its legs are not a human's.
        """
        self._body, self._footholds, self._friction, self._rolls = body, footholds, friction, rolls
        self.stature = stature_of(body)
        legs = LegKinematics(body)
        self._thigh, self._shank = legs.thigh, legs.shank
        foot, seat = body.effector("left_foot"), body.effector("buttocks")
        self._sole = float(foot.translation[0]), -float(foot.translation[2])
        self._hip = legs.hip[0] - seat.translation
        self._thigh_radius, self._shank_radius = (
            float(body.segment(f"left_{name}").shapes[0].size[0]) for name in ("thigh", "leg")
        )
        self._heel = ANKLE_FROM_HEEL * float(body.sole_length or 0.0)
        self._lean = self._farthest_lean()

    def _farthest_lean(self) -> float:
        """Way of the centre of mass before the middle of the buttocks' place where the body leans far [m]."""
        pitch = LEAN_PITCH * self._rolls
        angles = {**LEAN, "hip_flexion": LEAN["hip_flexion"] + pitch}
        q = self._body.posture(of_both_sides(self._body, angles))
        q[3:7] = [0.0, np.sin(0.5 * pitch), 0.0, np.cos(0.5 * pitch)]
        state = Configuration(self._body, q)
        turn, place = state.effector_placement("buttocks")
        edge = self.stature * np.array([0.5 * SEAT_LENGTH, 0.0, BUTTOCK_RADIUS])
        return float((state.com - place - turn @ edge + edge)[0]) + self.stature * BUTTOCK_RADIUS * pitch

    def sittings(self, at: FloatArray, heading: float, seat: Surface, floor: float) -> Iterator[Sitting]:
        """Ways to sit near a place, the best first.

        Args:
            at: (3,) wanted middle of the buttocks, on the seat [m].
            heading: Where to face [rad].
            floor: Height of what the feet stand on [m].
        """
        size, turn = self.stature, rotation_from_yaw(heading)
        steps = np.linspace(0.0, 1.0, 201)
        inside = seat.outside(at + steps[:, None] * turn[:, 0]) <= 1e-9
        room = float(steps[-1] if inside.all() else steps[int(np.argmin(inside))])
        tried, feet = list[tuple[float, float]](), dict[int, dict[str, Contact]]()
        for forward, ahead in self._compared(float(at[2]) - floor, room):
            if len(tried) == TRIED:
                return
            if any(abs(forward - other) < 0.02 and abs(ahead - foot) < 0.02 for other, foot in tried):
                continue
            row = round((forward + ahead) / FEET_SPACING)
            if row not in feet:
                wanted = at + row * FEET_SPACING * turn[:, 0]
                feet[row] = self._feet(np.array([*wanted[:2], floor]), heading)
            if len(feet[row]) == len(FEET):
                place = at + forward * turn[:, 0]
                place[2] -= float(seat.height(place[None])[0] / seat.normal[2])
                buttocks = sole(
                    "buttocks", place, rotation=onto_normal(turn, seat.normal), length=SEAT_LENGTH * size,
                    width=SEAT_WIDTH * size, friction=SEAT_FRICTION,
                )  # fmt: skip
                if self._rolls:
                    buttocks = rolling_front(buttocks, BUTTOCK_RADIUS * size)
                tried.append((forward, ahead))
                yield {"buttocks": buttocks, **feet[row]}, self._guess(buttocks, heading)

    def _feet(self, middle: FloatArray, heading: float) -> dict[str, Contact]:
        """Footholds beside a place (3,) between the feet, as far as there are any close enough."""
        found: dict[str, Contact] = {}
        for foot, side in zip(FEET, (1.0, -1.0), strict=True):
            wanted = middle + rotation_from_yaw(heading) @ [0.0, side * APART * self.stature, 0.0]
            contact = next(iter(self._footholds.near(foot, wanted, heading, self._friction)), None)
            if contact is not None and float(np.linalg.norm(contact.position - wanted)) < 0.03:
                found[foot] = contact
        return found

    def _compared(self, height: float, room: float) -> list[tuple[float, float]]:
        """Way of the buttocks forward and place of the soles before them [m], the cheapest first.

        The seat has a height above the floor, and room from the wanted place forward to its edge [m].
        """
        size, (toes, ankle) = self.stature, self._sole
        forward, slope = (axis.ravel() for axis in np.meshgrid(FORWARD * size, SLOPES, indexing="ij"))
        hip_x, hip_z = self._hip[0], height + self._hip[2]
        knee_z = ankle + self._shank * np.cos(slope)
        drop = hip_z - knee_z
        level = np.sqrt(np.maximum(self._thigh**2 - drop**2, 0.0))
        ahead = hip_x + level - self._shank * np.sin(slope)
        # Room between the thigh and the seat's edge, where the thigh passes over it.
        edge = np.clip(room - forward - hip_x, 0.0, level)
        over = self._hip[2] - (drop * edge + self._thigh_radius * self._thigh) / np.maximum(level, 1e-6)
        # Room between the calf and that edge, which is as thick as a board.
        low = np.maximum(knee_z - height + SEAT_THICKNESS, 0.0)
        calf = hip_x + level - low * np.tan(slope) - self._shank_radius / np.cos(slope) - (room - forward)
        gap = np.maximum(ahead - self._heel - self._lean, 0.0)
        scales = LIKED[0] * size, LIKED[1], LIKED[2] * size
        cost = (forward / scales[0]) ** 2 + ((slope - SHANK_SLOPE) / scales[1]) ** 2 + (gap / scales[2]) ** 2
        half = 0.5 * SEAT_LENGTH * size
        possible = (np.abs(drop) < self._thigh) & (over >= 0.0) & (calf >= CALF_ROOM)
        possible &= room - forward >= half
        order = np.argsort(cost, kind="stable")
        return [(float(forward[k]), float(ahead[k] + toes)) for k in order.tolist() if possible[k]]

    def _guess(self, buttocks: Contact, heading: float) -> FloatArray:
        q = self._body.posture({**self._body.standing_angles, **of_both_sides(self._body, _SITTING)})
        q[3:7] = [0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)]
        q[:3] += buttocks.position - Configuration(self._body, q).effector_placement("buttocks")[1]
        return q


_SITTING = {"hip_flexion": 1.4, "knee_flexion": 1.6, "ankle_dorsiflexion": 0.1}


LEANING = (0.25, 0.5, 0.75, 0.92)  # shares of the way of the centre of mass to the feet that have a posture
LEANING_TIMES = (1.3, 0.9)  # time of that way, to rest over the feet and to where it goes on in motion [s]
SEAT_OFF_INSETS = (0.045, 0.03, 0.015)
"""Distances of the centre of mass to the edge of where it may rest on the feet when a seat is left, tried in
order [m]; the first is inside the smaller soles on which it is planned."""
BEHIND = (0.0, 0.02, 0.04)  # ways behind where the centre of mass could rest as a seat is left [m]
LEAN_WEIGHT = 300.0  # of the centre of mass over the feet where a body cannot lean so far [1/m^2]; our choice
EASY_LEAN = 0.8  # share of the farthest lean with which a body leaves a seat on feet and hands; our choice
RISING_TIME = 0.9  # shortest time from there to standing [s]; the pace of the joints mostly asks for more
RISING_SHARE, QUICKEST_RISE, RISING_PACE = 0.8, 0.6, 2.4
"""Of a body that rises without a rest: its time to lean relative to the above, its shortest time from the
seat to standing [s], and the mean speed of the hinge that turns most [rad/s]; our choice."""
LETTING_GO_TIME = 0.2  # shortest time from one hand that lets go to the other one [s]; our choice
SETTLING_TIME = 0.8  # shortest time that the body stands then [s]
SEATED_ROOM = (0.01, 0.01, 0.006)  # for the centre of mass [m]: a seated trunk cannot follow any path
SEAT_OFF_ROOM = (0.01, 0.01, 0.002)
"""The same where the seat is left at rest, as a trunk ends its lean there, and with hands beside it [m]."""


@dataclass(frozen=True, eq=False)
class Leaving:
    """The stages from a seat to standing on feet, from the start on, or why there are none but that."""

    stages: tuple[Stage, ...]
    failure: str | None = None


def leave_seat(
    poser: PostureFinder, start: Stage, feet: frozenset[str], upright: FloatArray | None = None
) -> Leaving:
    """Rise from a seat: lean forward, leave the seat, let go with the hands, stand.

    Args:
        start: Contacts and posture at the start; hands that hold or push there stay until the weight is over
            the feet.
        feet: Effectors to stand on.
        upright: (7,) pose of the root that has risen; over the feet when omitted.
    """
    held = {name: contact for name, contact in start.contacts.items() if name in feet}
    if len(held) == len(start.contacts):
        return Leaving((start,))
    # The posture nearest to the seated one may be a squat, as with thighs below a table.
    near = start.q if upright is None else poser.standing_at(upright)
    risen = poser.pose(held, held, near, upright, restarts=True)
    if risen.q is None:
        return Leaving((start,), f"no posture on {', '.join(held) or 'feet'} alone: {risen.reason}")
    pushing = {name: contact for name, contact in start.contacts.items() if name not in SEATED_ON}
    if len(pushing) > len(held):
        return _pushed_up(poser, start, pushing, held, risen.q)
    failure = None
    for lean in _leans(poser, start, held, risen.q):
        if not isinstance(lean, str):
            return _rising(poser, start, [lean], risen.q)
        failure = lean
    return Leaving((start,), failure)


def _leans(poser: PostureFinder, start: Stage, held: Contacts, risen: FloatArray) -> Iterator[Stage | str]:
    """Leans that bring the weight over the feet, then such as leave it farther and farther behind them."""
    rest = Configuration(poser.body, risen).com
    over = poser.resting_place(held, start.com[:2], SEAT_OFF_INSETS[-1])
    if over is None:
        yield f"{', '.join(held)} cannot carry the body at rest"
        return
    for inset in SEAT_OFF_INSETS[:-1]:
        farther = poser.resting_place(held, start.com[:2], inset)
        posed = poser.pose(start.contacts, held, start.q, place=farther, inset=inset)
        if posed.q is not None:
            yield _lean(poser, posed.q, held, rest, moving=False)
    back = start.com[:2] - rest[:2]
    back /= max(float(np.linalg.norm(back)), 1e-9)
    reason, q = "", start.q
    for behind in BEHIND:
        posed = poser.pose(start.contacts, held, q, place=over + behind * back, restarts=behind == 0.0)
        if posed.q is None:
            reason = reason or posed.reason
            continue
        q = posed.q
        yield _lean(poser, q, held, rest, moving=behind > 0.0)
    # The farthest lean, wherever that is.
    posed = poser.pose(start.contacts, held, q, place=over, com_weight=LEAN_WEIGHT)
    if posed.q is None:
        yield reason or posed.reason
        return
    lean = _lean(poser, posed.q, held, rest, moving=True)
    yield f"{lean}; at rest: {reason}" if isinstance(lean, str) else lean


def _lean(
    poser: PostureFinder, q: FloatArray, held: Contacts, rest: FloatArray, *, moving: bool
) -> Stage | str:
    """Stage in which a seat is left for the feet with a posture (nq,) that leans, or why not there."""
    body, momentum = poser.body, None
    if moving:
        com = Configuration(body, q).com
        momentum = momentum_to_rest(Stance(list(held.values()), model=poser.model), body.mass, com, rest)
        if momentum is None:
            behind = float(np.linalg.norm(com[:2] - rest[:2]))
            where = f"{behind:.3f} m behind the middle of the feet"
            return f"a lean leaves the centre of mass {where}, from where no speed carries it over them"
    acceleration = None if momentum is None else momentum.acceleration
    room = SEAT_OFF_ROOM if momentum is None else SEATED_ROOM
    return poser.strained(q, held, STRENGTH_SHARE, acceleration) or Stage.of(
        body, held, q, RISING_TIME, room, momentum=momentum
    )


def _pushed_up(
    poser: PostureFinder, start: Stage, pushing: Contacts, held: Contacts, risen: FloatArray
) -> Leaving:
    """Leave a seat with hands that push, until the weight is over the feet."""
    # The arms push until they are long: what is left to rise alone is as little as they let.
    failure = None
    for inset in SEAT_OFF_INSETS:
        place = poser.resting_place(held, start.com[:2], inset)
        free = poser.pose(pushing, held, start.q, risen[:7], place=place, restarts=True)
        if free.q is None:
            failure = failure or f"hands cannot be let go: {free.reason}"
            continue
        over_feet = Configuration(poser.body, free.q).com[:2]
        off = poser.pose(start.contacts, pushing, start.q, place=over_feet, com_weight=LEAN_WEIGHT)
        if off.q is not None:
            # Short of where joint ranges end, as a motion needs room.
            lean = Configuration(poser.body, off.q).com[:2] - start.com[:2]
            off = poser.pose(start.contacts, pushing, off.q, place=start.com[:2] + EASY_LEAN * lean)
        if off.q is None:
            failure = failure or off.reason
            continue
        weak = [poser.strained(q, on, STRENGTH_SHARE) for q, on in ((off.q, pushing), (free.q, held))]
        if not any(weak):
            changes = [Stage.of(poser.body, pushing, off.q, RISING_TIME, SEAT_OFF_ROOM)]
            for hand in [name for name in pushing if name not in held]:
                pushing = {name: contact for name, contact in pushing.items() if name != hand}
                last = len(pushing) == len(held)
                time = RISING_TIME if last else LETTING_GO_TIME
                changes.append(Stage.of(poser.body, pushing, free.q, time, SEATED_ROOM))
            return _rising(poser, start, changes, risen)
        failure = weak[0] or weak[1]
    return Leaving((start,), failure)


def _rising(poser: PostureFinder, start: Stage, changes: Sequence[Stage], risen: FloatArray) -> Leaving:
    """Stages that lean up to the first of some changes of contact, make them, and stand."""
    body, stages, moving = poser.body, [start], changes[0].momentum is not None
    there, before = changes[0].com[:2], 0.0
    room = SEATED_ROOM if len(changes) == 1 else SEAT_OFF_ROOM
    for share in (*LEANING, 1.0):
        time = _leaning_time(share, moving)
        stages[-1] = replace(stages[-1], min_duration=time - before)
        place = (1.0 - share) * start.com[:2] + share * there
        posed = poser.pose(start.contacts, start.contacts, stages[-1].q, place=place) if share < 1.0 else None
        if posed is not None and posed.q is not None:
            stages.append(Stage.of(body, start.contacts, posed.q, 0.0, room))
            before = time
    standing = Stage.of(body, changes[-1].contacts, risen, SETTLING_TIME)
    return Leaving((*stages, *changes, standing))


def rising_times(stages: Sequence[Stage]) -> list[float]:
    """Least durations of the stages of a body that rises from a seat without a rest, at people's pace [s].

    Args:
        stages: Of a plan that begins on a seat.

    Returns:
        One for each stage up to the first in which the body stands; none where it does not rise on its feet.
    """
    names = [stage.contacts.keys() for stage in stages]
    off = next((number for number, held in enumerate(names) if not held & SEATED_ON), 0)
    alone = names[0] <= SEATED_ON.union(FEET)  # without hands
    if not 0 < off < len(stages) - 1 or any(held != names[0] for held in names[:off]) or not alone:
        return []
    start, way = stages[0].com[:2], float(np.linalg.norm(stages[off].com[:2] - stages[0].com[:2]))
    shares = [float(np.linalg.norm(stage.com[:2] - start)) / way for stage in stages[: off + 1]]
    times = [RISING_SHARE * _leaning_time(min(share, 1.0), moving=True) for share in shares]
    turn = float(np.abs(stages[off + 1].q[7:] - stages[off].q[7:]).max())
    return [after - before for before, after in pairwise(times)] + [max(QUICKEST_RISE, turn / RISING_PACE)]


def _leaning_time(share: float, moving: bool) -> float:
    """Time at which a lean of least jerk, which ends at rest or not, has come a share of its way [s]."""
    shares = np.linspace(0.0, 1.0, 101)
    # Half of a way twice as long ends with its largest speed.
    half = 0.5 if moving else 1.0
    way = least_jerk(half * shares)[0] / least_jerk(half)[0]
    return float(LEANING_TIMES[moving] * np.interp(share, way, shares))


HAND_AHEAD, HAND_ASIDE, HAND_ABOVE = 0.08, 0.15, 0.13
"""Where a hand pushes best from the middle of the buttocks [statures]; our choice."""
HAND_ROOM = 0.25  # farthest that it is from there [statures]
HAND_INSET = 0.012  # distance of the middle of the palm to the edges of its surface [m]


def hand_supports(
    scene: Scene, buttocks: Contact, stature: float, friction: float, steepest: float
) -> dict[str, Contact]:
    """Places beside a seat on which heels of hands can push: armrests, a table, the seat itself.

    Args:
        friction: Coulomb coefficient.
        steepest: Largest slope of a surface to push on [rad].
    """
    turn, result = buttocks.rotation_contact_to_world, dict[str, Contact]()
    for hand, side in (("left_wrist", 1.0), ("right_wrist", -1.0)):
        wanted = buttocks.position + turn @ (stature * np.array([HAND_AHEAD, side * HAND_ASIDE, HAND_ABOVE]))
        best = HAND_ROOM * stature
        for surface in scene.surfaces_facing((0.0, 0.0, 1.0), steepest):
            if float(surface.polygon[:, 2].max()) < buttocks.position[2] - 0.02:
                continue
            place = surface.nearest_inside(wanted, HAND_INSET)
            away = np.inf if place is None else float(np.linalg.norm(place - wanted))
            if place is not None and away < best:
                best = away
                frame = onto_normal(turn, surface.normal)
                result[hand] = point(hand, place, friction=friction, rotation=frame)
    return result


def take_seat(poser: PostureFinder, way: ContactPlan, sat: Stage) -> ContactPlan | str:
    """A way to the feet of a stage on a seat, or near them, and the body sits down there; or why it cannot.

    It rises backwards in time: every balanced motion is balanced backwards as well, with the same forces.
    """
    body, feet = poser.body, way.stages[-1].contacts
    contacts = {name: contact for name, contact in sat.contacts.items() if name not in feet} | dict(feet)
    posed = poser.pose(contacts, contacts, sat.q, place=sat.com[:2], restarts=True)
    if posed.q is None:
        return f"no posture on the seat with the feet where they are: {posed.reason}"
    seated = Stage.of(body, contacts, posed.q, SETTLING_TIME)
    rising = leave_seat(poser, seated, frozenset(feet), way.goal[:7])
    if rising.failure is not None:
        return f"cannot sit down: {rising.failure}"
    stages = [*way.stages, Stage.of(body, feet, rising.stages[-1].q, RISING_TIME)]
    for before, after in reversed(list(pairwise(rising.stages))):
        if before.contacts.keys() != after.contacts.keys():
            momentum = None if after.momentum is None else after.momentum.backwards
            stages.append(Stage.of(
                body, before.contacts, after.q, SETTLING_TIME, SEATED_ROOM, momentum=momentum
            ))  # fmt: skip
    return ContactPlan.of(body, stages, seated.q)
