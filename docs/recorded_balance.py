"""Measure the balance of recorded people, beside force plates: writes ``recorded-balance.md``.

Run ``python docs/recorded_balance.py FOLDER``, where FOLDER has ``clips_locomotion.csv`` (windows of
recordings with a class each) and, in ``mocap``, recordings with and without force plates.
"""

import csv
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.balance import force_space, zero_moment_point
from manikin.body.configuration import Configuration
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.numerics.polytope import polygon_of_halfplanes
from manikin.numerics.spatial import GRAVITY, FloatArray, wrench_about
from manikin.recordings import (
    ForcePlate,
    LeastShift,
    MarkerRecording,
    PlateComparison,
    PlateForces,
    Reconstruction,
    RecordedDynamics,
    RecordedMargins,
    RecordedSupports,
    Support,
    compare_with_plates,
    dynamics_of,
    least_shift,
    mass_on_plates,
    motion_on_contacts,
    plate_forces,
    read_recording,
    reconstruct,
    recorded_margins,
    recorded_schedule,
    supports_of,
    timing_errors,
    touch_downs_of,
    with_mass,
)
from manikin.recordings.dynamics.plate_forces import JOINTS, UNSURE, compare_torques
from manikin.recordings.dynamics.recorded_dynamics import (
    CUTOFF,
    HEIGHT_CUTOFF,
    margins_of_wrenches,
)
from manikin.recordings.dynamics.recorded_forces import contact_wrenches, shared_wrenches, torques_of
from manikin.recordings.dynamics.shifted_motion import ASIDE, INSIDE, LARGEST_SHIFT, PLACE_ERROR
from manikin.recordings.supports.recorded_stances import FRICTION
from manikin.runtime.display import readable

PAGE = Path(__file__).with_name("recorded-balance.md")
IMAGES = Path(__file__).parent / "images"
JUDGED = ("FunctionalWalk.c3d", "PiG_Motion-FlatFoot-One.c3d", "walking2.c3d", "walking5.c3d")
LEVEL = (
    "walk straight",
    "walk veer",
    "walk 90 turn (1.2 s core)",
    "walk turn (1.5 s core)",
    "walk long curve L",
)
LAB_COM = "CentreOfMass"
LAB_PARTS = (
    ("hip", "FEO", 0.1, 0.433), ("FEO", "TIO", 0.0465, 0.433), ("TIO", "TOO", 0.0145, 0.5),
    ("shoulder", "HUO", 0.028, 0.436), ("HUO", "RAO", 0.016, 0.43), ("HNO", "HNO", 0.006, 0.0),
)  # fmt: skip
"""Limbs of Plug-in Gait: ends by its origins, share of the mass, place of its centre from the first end, as
Winter (2009), Table 4.1. The pelvis has 0.142, the head 0.081, the thorax 0.355 at 0.63 of the way from C7 to
L5, which is 0.828 of the distance of the hips above their middle."""
BAR = 30.0
"""Largest root mean square that was asked for, of centres of mass and of pressure [mm]."""
SITTING = "STS1.trc"
CIRCLE = "levelground_ccw_fast_01_01.trc"
COLOURS = {
    "ours": "#0072B2",
    "plates": "#D55E00",
    "point": "#8A8A8A",
    "left_foot": "#009E73",
    "right_foot": "#CC79A7",
}

TEXT = f"""# Balance of recorded people

Stances, forces, torques and margins of recorded people (Qiu 2012, 4.4), beside force plates, by
`docs/recorded_balance.py`. Soles are those of the body model, whole, level, at one place for each support,
friction {FRICTION:g}; postures are low-passed at {CUTOFF.usual:g} Hz (second order, no delay), rising to
{CUTOFF.highest:g} Hz within {1e3 * CUTOFF.width:.0f} ms of a touch-down beside another support, the height
of their centre of mass at {HEIGHT_CUTOFF.usual:g} to {HEIGHT_CUTOFF.highest:g} Hz, all files alike, and
differentiated twice. Segment masses lie off the lines between joints (Dumas, Chèze and Verriest, 2007), a
trunk without markers tilts so that its upper end has a third of the pelvis' fast motion.
Nothing is fitted to the plates but the mass of the person; the cutoffs were
chosen with them.

`manikin analyze` measures the motion as recorded. *Shifted* is the whole body moved by the smooth path
that is least and leaves the centre of pressure {1e2 * INSIDE:.0f} cm inside of the edges of the soles, if
none longer than {1e2 * LARGEST_SHIFT:.0f} cm along an axis is needed, and rather near the axis of a foot that
carries alone (`manikin.recordings.least_shift`). Markers give the position of a body to a centimetre; a
millimetre at 4 Hz moves the centre of pressure by 6 cm. The plates have no part in a shift, but the weight
of a foot's axis ({1e2 * ASIDE:.0f} cm count as much as {1e3 * PLACE_ERROR:.0f} mm of shift)
was chosen with them.
"""
PLATES = f"""
## Beside force plates

Compared are frames in which every support is wholly on a plate (2 cm of overhang allowed) and that are at
least {1e3 * UNSURE:.0f} ms from those with a support elsewhere. Plates are low-passed at 20 Hz, their offset
while unloaded taken off.

* *Mass*: by the file, and by the impulse of the plates; the latter is used. In `PiG_Motion-FlatFoot-One.c3d`
  the plate says 8 % less than the file.
* *Vertical force*: root mean square of the difference per body weight, all compared frames, and single
  support.
* *CoP*: root mean square distance of the zero moment point of our wrench from the plates' centre of pressure
  in single support, as recorded and shifted; *mean*: ours, shifted, minus theirs, along and to the left of
  the walk.
* *Timing*: median of the absolute error of touch-downs and lift-offs.
* *Plates' margin*: share of the compared frames in which the plates' own wrench, with moments, is within the
  polytope of our stances; *apart*: median difference between both margins, about the centre of mass.
* *CoM, laboratory's*: root mean square distance of our centre of mass from the file's, where it has one.

"""
COM = """
## The laboratory's centre of mass

"""
TORQUES = """
## Joint torques

Torques of the legs by inverse dynamics from the motion alone, beside those with the plates' forces on the
feet, both sides, while a foot is on a plate of its own: root mean square of the difference (*least, smooth,
shifted*), and the largest magnitudes of the shifted motion and by plates [N.m]. Two feet that carry together
can share the wrench in many ways. *Least*: forces of least squares; *smooth*: each foot is loaded and
unloaded gradually, and forces rather meet above the centre of mass
(`manikin.recordings.dynamics.recorded_forces`), as `manikin analyze` measures;
*shifted*: the same of the shifted motion.

"""
SHARES = """
## Margins

Share of the frames with a positive margin of the whole body (4.55), as recorded and shifted, and of a point
mass as recorded (4.54); *median* of the whole body's as recorded, about the centre of mass; how far the body
was shifted. A shifted motion has a positive margin because it is made to: results are the share of frames in
which that is possible and how long the shift has to be; no margin of it is given. Columns at the right: the
frames whose margin is not positive although shifted, by what they are put down to.

* *Change*: the stance before or after a touch-down or lift-off within a quarter of the cutoff's period admits
  the wrench; the low-pass spreads the impact over that time.
* *End*: of the recording, half of that period, where derivatives look to one side.
* *Flight*: no support was found.
* *Untold*: another frame of a recording without markers on trunk or arms (unmeasured).
* *Model*: none of these.

"""
SIT = """
## Sitting down and standing up

Seat-off and seat-on by the height of the buttocks, and by the plates under the feet: the seat is loaded while
they carry a tenth of the body's weight less than the motion needs.

"""


class Cause(StrEnum):
    """What a margin that is not positive is put down to."""

    CHANGE = "change of support"
    """The stance before or after a change within a quarter of the cutoff's period admits the wrench."""
    END = "end of the recording"
    """Half of the cutoff's period from the first or the last frame, or less."""
    FLIGHT = "flight"
    """Nothing supports."""
    UNTOLD = "untold trunk or arms"
    """No marker tells where a third of the body, or its arms, are."""
    MODEL = "model"
    """None of these: the body's masses, the soles, the recording."""


@dataclass(frozen=True)
class Loss:
    """A frame whose margin is not positive.

    Attributes:
        frame: Its index.
        time: On the clock of the stances [s].
        margin: [N.m].
        cause: What it is put down to.
    """

    frame: int
    time: float
    margin: float
    cause: Cause


def balance_losses(
    margins: RecordedMargins, dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0,
    neutral: Sequence[str] = (), cutoff: float = CUTOFF.usual,
) -> tuple[Loss, ...]:  # fmt: skip
    """Every frame without a positive margin of the whole body, with its cause.

    A low-pass spreads what happens at touch-down over a quarter of its period to either side, and supports
    are known no better. A wrench that the stance before or after such a change admits is told from one that
    no stance does; so are the ends of the recording, where derivatives look to one side only, and recordings
    that say nothing about trunk or arms.

    Args:
        margins: Of the motion.
        dynamics: The motion.
        schedule: Its stances.
        start: The schedule's clock at the motion's first instant [s].
        neutral: Segments about which the recording says nothing.
        cutoff: Of the low-pass of the postures [Hz].
    """
    times, near = dynamics.time + start, 0.25 / cutoff
    untold = bool({"thorax", "left_upper_arm", "right_upper_arm"} & set(neutral))
    before, after = schedule.phase_at(times - near), schedule.phase_at(times + near)
    found = []
    for frame in np.flatnonzero(margins.whole_body <= 0.0).tolist():
        others = [margins.polytopes[k] for k in range(before[frame], after[frame] + 1)]
        wrench = dynamics.wrench[frame]
        if any(one is not None and one.margin(wrench_about(wrench, one.reference)) > 0.0 for one in others):
            cause = Cause.CHANGE
        elif margins.polytopes[int(margins.phase[frame])] is None:
            cause = Cause.FLIGHT
        elif min(times[frame] - times[0], times[-1] - times[frame]) <= 2.0 * near:
            cause = Cause.END
        else:
            cause = Cause.UNTOLD if untold else Cause.MODEL
        found.append(Loss(frame, float(times[frame]), float(margins.whole_body[frame]), cause))
    return tuple(found)


def share_by_cause(losses: Sequence[Loss], frames: int) -> dict[Cause, float]:
    """Share of all frames that each cause takes."""
    counts = Counter(loss.cause for loss in losses)
    return {cause: counts[cause] / frames for cause in Cause}


LOADED = 0.1
"""Share of the body's weight from which a seat is loaded."""

LOOK = 0.5
"""Time about a change of the supports within which the load's own is looked for [s]."""


@dataclass(frozen=True)
class SeatChange:
    """A seat-off or a seat-on, extracted from the motion and seen by the plates.

    Attributes:
        event: ``"seat-off"`` or ``"seat-on"``.
        time: That of the plates [s].
        error: Extracted minus plates [s].
    """

    event: str
    time: float
    error: float


def seat_load(dynamics: RecordedDynamics, feet: PlateForces) -> FloatArray:
    """(n,) what of the vertical force the feet's plates do not carry, per body weight."""
    return (dynamics.vertical_force - feet.wrench[:, 2]) / (GRAVITY * dynamics.body.mass)


def seat_changes(
    seats: Sequence[Support], times: FloatArray, dynamics: RecordedDynamics, feet: PlateForces
) -> tuple[SeatChange, ...]:
    """Changes of extracted seats beside those of the load that the feet do not carry.

    Those that are not seen during the recording, or near which the load does not pass :data:`LOADED`, are
    left out; of several passages the nearest counts.

    Args:
        seats: Supports of the seat.
        times: (n,) instants of the motion on the clock of the supports [s].
        dynamics: The motion, with the person's mass.
        feet: Forces under both feet.
    """
    load = seat_load(dynamics, feet) > LOADED
    passages = {"seat-on": np.flatnonzero(~load[:-1] & load[1:]) + 1}
    passages["seat-off"] = np.flatnonzero(load[:-1] & ~load[1:]) + 1
    found = []
    for seat in seats:
        for event, instant, seen in (
            ("seat-on", seat.start, seat.start_seen), ("seat-off", seat.end, seat.end_seen)
        ):  # fmt: skip
            there = times[passages[event]]
            if seen and len(there) and np.abs(there - instant).min() < LOOK:
                nearest = float(there[np.argmin(np.abs(there - instant))])
                found.append(SeatChange(event, nearest, instant - nearest))
    return tuple(sorted(found, key=lambda change: change.time))


@dataclass(frozen=True, eq=False)
class Trial:
    """A recording, with all that follows from it."""

    name: str
    plates: tuple[ForcePlate, ...]
    told_mass: float | None
    lab: FloatArray | None
    found: Reconstruction
    supports: RecordedSupports
    schedule: ContactSchedule
    dynamics: RecordedDynamics
    measured: PlateForces | None
    plate_mass: float | None

    @cached_property
    def times(self) -> FloatArray:
        """On the recording's clock [s]."""
        return self.dynamics.time + self.supports.start

    @cached_property
    def margins(self) -> RecordedMargins:
        """Of every frame."""
        return recorded_margins(self.dynamics, self.schedule, self.supports.start)

    @cached_property
    def shifted(self) -> LeastShift:
        """The motion nearest to it that its stances can carry."""
        return least_shift(self.found, self.dynamics, self.margins)

    @cached_property
    def losses(self) -> tuple[Loss, ...]:
        """Frames without a positive margin although shifted."""
        return balance_losses(
            self.shifted.margins,
            self.shifted.dynamics,
            self.schedule,
            self.supports.start,
            self.found.neutral,
        )

    @cached_property
    def motion(self) -> Motion:
        """With forces and torques."""
        return motion_on_contacts(self.dynamics, self.schedule, self.supports.start, self.margins)

    @cached_property
    def shifted_motion(self) -> Motion:
        """Shifted, with forces and torques."""
        moved = self.shifted
        return motion_on_contacts(moved.dynamics, self.schedule, self.supports.start, moved.margins)

    @cached_property
    def comparison(self) -> PlateComparison | None:
        """Beside the plates."""
        if self.measured is None or self.plate_mass is None:
            return None
        return compare_with_plates(self.dynamics, self.margins, self.measured, self.height)

    @cached_property
    def shifted_comparison(self) -> PlateComparison | None:
        """The shifted motion beside the plates."""
        if self.measured is None or self.plate_mass is None:
            return None
        return compare_with_plates(self.shifted.dynamics, self.shifted.margins, self.measured, self.height)

    @property
    def height(self) -> float:
        """Of the plates [m]."""
        return float(np.median([plate.origin[2] for plate in self.plates]))


def trial(path: Path) -> Trial:
    """Reconstruct a recording and find its supports, stances and dynamics."""
    recording = read_recording(path)
    found = reconstruct(recording)
    marked = isinstance(recording, MarkerRecording)
    supports = supports_of(found, start=recording.start if isinstance(recording, MarkerRecording) else 0.0)
    touch_downs = touch_downs_of(supports)
    schedule, dynamics = recorded_schedule(found, supports), dynamics_of(found, touch_downs=touch_downs)
    plates = recording.plates if isinstance(recording, MarkerRecording) else ()
    measured = plate_forces(plates, dynamics.time + supports.start, schedule) if plates else None
    mass = mass_on_plates(dynamics, measured) if measured else None
    if mass is not None:
        schedule = recorded_schedule(with_mass(found, mass), supports)
        dynamics = dynamics_of(with_mass(found, mass), touch_downs=touch_downs)
    lab = None
    if isinstance(recording, MarkerRecording) and LAB_COM in recording.marker_names:
        lab = recording.marker(LAB_COM)[found.first_frame : found.first_frame + len(found.time)]
    told = recording.subject.mass if isinstance(recording, MarkerRecording) and marked else None
    name = f"{path.parent.name}/{path.name}"
    return Trial(name, plates, told, lab, found, supports, schedule, dynamics, measured, mass)


def table(heads: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    """In Markdown."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def percent(value: float) -> str:
    """In tables."""
    return f"{100.0 * value:.1f} %"


def millimetres(value: float) -> str:
    """In tables."""
    return f"{1e3 * value:.0f} mm"


def rms(distances: FloatArray) -> float:
    """Root mean square length of (n, 3) distances [mm]."""
    return 1e3 * float(np.sqrt(np.mean(np.sum(distances**2, axis=1))))


def ahead(one: Trial) -> FloatArray:
    """(2,) unit vector along the walk, from the first place of the centre of mass to the last."""
    way = (one.dynamics.com[-1] - one.dynamics.com[0])[:2]
    return way / max(float(np.linalg.norm(way)), 1e-9)


def plate_rows(trials: list[Trial]) -> Iterator[tuple[object, ...]]:
    """One for each walk on plates."""
    for one in trials:
        shown, moved = one.comparison, one.shifted_comparison
        if shown is None or moved is None or one.plate_mass is None:
            continue
        along = ahead(one)
        mean = np.array(moved.cop_mean)
        errors = [abs(error.error) for error in timing_errors(one.supports, one.plates)]
        mark = "**" if one.name.split("/")[-1] in JUDGED else ""
        yield (
            f"{mark}{one.name}{mark}", "-" if one.told_mass is None else f"{one.told_mass:.1f} kg",
            f"{one.plate_mass:.1f} kg", shown.frames, shown.single_frames, percent(shown.vertical_rms),
            percent(shown.vertical_rms_single), millimetres(shown.cop_rms), millimetres(moved.cop_rms),
            f"{1e3 * mean @ along:+.0f}, {1e3 * (along[0] * mean[1] - along[1] * mean[0]):+.0f} mm",
            f"{1e3 * np.median(errors):.0f} ms ({len(errors)})" if errors else "-",
            percent(shown.margin_share), f"{shown.margin_difference:.0f} N.m",
            "-" if one.lab is None else f"{rms(one.dynamics.com - one.lab):.0f} mm",
        )  # fmt: skip


def standing_text(one: Trial) -> str:
    """Where the plates place the pressure under feet that stand still for seconds."""
    assert one.measured is not None
    places, step = [], float(one.times[1] - one.times[0])
    for number, phase in enumerate(one.schedule.sequence):
        for contact in phase.stance:
            wrench = one.measured.of_effector[:, one.measured.effectors.index(contact.effector)]
            frames = (one.margins.phase == number) & (wrench[:, 2] > 100.0)
            if frames.sum() * step > 2.0:
                cop = zero_moment_point(wrench[frames], one.height) - contact.position[:2]
                ahead_of = float(np.median(cop @ contact.rotation_contact_to_world[:2, 0]))
                since = f"{readable(contact.effector)}, from {one.times[frames][0]:.1f} s"
                places.append(f"{1e3 * ahead_of:+.0f} mm ({since})")
    return (
        f"\nIn `{one.name}` the plates place the pressure under feet that stand still for seconds at "
        f"{', '.join(places)} from the middle of our soles, ahead positive, with the markers of heels and "
        "toes at the same places of the soles each time. Hardly anybody stands so differently at both "
        "ends of one walk: plates and markers of this file seem to agree to several centimetres only, "
        "which may be most of its error.\n"
    )


def torque_rows(trials: list[Trial]) -> Iterator[tuple[object, ...]]:
    """One for each recording whose feet are on plates of their own."""
    for one in trials:
        if one.measured is None or one.plate_mass is None:
            continue
        moved = one.shifted.dynamics
        found = [
            compare_torques(one.dynamics, with_least_forces(one), one.measured),
            compare_torques(one.dynamics, one.motion, one.measured),
            compare_torques(moved, one.shifted_motion, one.measured),
        ]
        if all(found):
            mark = "**" if one.name.split("/")[-1] in JUDGED else ""
            yield (
                f"{mark}{one.name}{mark}", found[0][0].frames,
                *(", ".join(f"{each.rms:.0f}" for each in same) for same in zip(*found, strict=True)),
                *(f"{same[2].peak:.0f}, {same[2].peak_by_plates:.0f}" for same in zip(*found, strict=True)),
            )  # fmt: skip


def with_least_forces(one: Trial) -> Motion:
    """The recorded motion with the least forces at its contacts in every frame."""
    names, torques = one.schedule.sequence.effectors, np.array(one.motion.tau)
    wrenches = contact_wrenches(one.dynamics, one.schedule, one.supports.start)
    for number, phase in enumerate(one.schedule.sequence):
        frames = np.flatnonzero(one.margins.phase == number)
        if len(frames) and len(phase.stance) > 1:
            columns = [names.index(name) for name in phase.stance.effectors]
            weight = GRAVITY * one.dynamics.body.mass
            wrenches[frames[:, None], columns] = shared_wrenches(
                phase.stance, one.dynamics.wrench[frames], weight
            )
    torques[:, 6:] = torques_of(one.dynamics, names, wrenches)[:, 6:]
    return replace(one.motion, tau=torques)


def torque_text(trials: list[Trial]) -> str:
    """How much is due to the sharing, in one sentence."""
    walks = [
        one
        for one in trials
        if one.measured is not None and one.plate_mass is not None and not one.name.endswith(SITTING)
    ]
    medians = []
    kinds = (
        lambda one: (one.dynamics, with_least_forces(one)),
        lambda one: (one.dynamics, one.motion),
        lambda one: (one.shifted.dynamics, one.shifted_motion),
    )
    for kind in kinds:
        found = [compare_torques(*kind(one), one.measured) for one in walks if one.measured is not None]
        medians.append([np.median([each[k].rms for each in found if each]) for k in range(len(JOINTS))])
    told = "; ".join(
        f"{readable(joint)} {', '.join(f'{row[k]:.0f}' for row in medians)}" for k, joint in enumerate(JOINTS)
    )
    return (
        f"\nMedians over the walks, least, smooth, shifted: {told} N.m. Least forces do not let the feet "
        "push against each other, as they do under people whose front foot brakes while the other still "
        "pushes off. What is left is the error of the motion itself, as in single support, and largest at "
        "the ankle just before the next touch-down: the low-pass begins the impact early, and the foot that "
        "carries alone has to supply it. With an earlier way to share, letting the next foot be loaded 40 ms "
        "before it is on the ground lowered the ankle's peak from 1.5 of that by plates to 1.1 (median) and "
        "raised the hip's difference by a quarter, so it was left.\n"
    )


def torque_figure(one: Trial) -> None:
    """Torques of the legs beside those by plates."""
    assert one.measured is not None
    theirs = torques_of(one.dynamics, one.measured.effectors, one.measured.of_effector)
    least = with_least_forces(one)
    names = one.motion.joint_names
    figure = Figure(figsize=(9.0, 6.6), layout="constrained")
    rows = figure.subplots(3, 2, sharex=True, sharey="row")
    joints = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
    for number, side in enumerate(("left", "right")):
        held = one.measured.apart & one.motion.support[:, one.motion.contact_names.index(f"{side}_foot")]
        for axes, joint in zip(rows[:, number], joints, strict=True):
            column = 6 + names.index(f"{side}_{joint}")
            shade(axes, one)
            curves = (
                (least.tau, COLOURS["point"], ":", "least forces"),
                (one.shifted_motion.tau, COLOURS["ours"], "-", "loaded smoothly, shifted"),
                (theirs, COLOURS["plates"], "-", "plates"),
            )
            for values, colour, style, label in curves:
                shown = np.where(held, values[:, column], np.nan)
                axes.plot(one.times, shown, style, color=colour, label=label)
            axes.axhline(0.0, color="k", linewidth=0.6)
            axes.set_ylabel(f"{joint.replace('_', ' ')} [N.m]")
        rows[0, number].set_title(f"{one.name}, {side} leg", loc="left", fontsize=9)
        rows[-1, number].set_xlabel("time [s]")
    rows[0, 0].legend(fontsize=8)
    figure.savefig(IMAGES / "recorded-torques.png", dpi=110)


def com_text(trials: list[Trial], folder: Path) -> Iterator[str]:
    """Our centre of mass beside that of the laboratory, and what the plates say to both."""
    for one in trials:
        if one.lab is None or one.measured is None:
            continue
        apart, textbook = one.dynamics.com - one.lab, textbook_com(one, folder)
        along = ahead(one)
        parts = [
            apart[:, :2] @ along, along[0] * apart[:, 1] - along[1] * apart[:, 0], apart[:, 2]
        ]  # fmt: skip
        mean = [1e3 * float(np.mean(part)) for part in parts]
        plain = [
            (each, least_shift(each.found, each.dynamics, each.margins, aside=None))
            for each in trials
            if each.measured is not None and each.name.split("/")[-1] in JUDGED
        ]
        beside = [
            compare_with_plates(moved.dynamics, moved.margins, each.measured, each.height)
            for each, moved in plain
            if each.measured is not None
        ]
        without = [each.cop_rms for each in beside if each is not None]
        enough = max(1.0 - BAR / rms(apart), 0.0)
        yield (
            f"`{one.name}`: {1e3 * np.sqrt(np.mean(np.sum(apart**2, axis=1))):.0f} mm root mean square, "
            f"{mean[0]:+.0f} mm along the walk, {mean[1]:+.0f} mm to the left, {mean[2]:+.0f} mm up (ours "
            f"minus "
            f"theirs), {rms(apart - apart.mean(axis=0)):.0f} mm without its mean. The force plate sides "
            "with ours: with the laboratory's centre of mass, our forces and "
            "angular momentum the centre of pressure is off by "
            f"{missed_by_plates(one, -apart):.0f} mm, with ours by "
            f"{1e3 * one.comparison.cop_rms if one.comparison else np.nan:.0f} mm. Hips, knees, ankles "
            "and shoulders agree to 3 cm. By the published model of Plug-in Gait on the laboratory's own "
            f"segments the centre of mass is {rms(one.dynamics.com - textbook):.0f} mm from ours and "
            f"{rms(one.lab - textbook):.0f} mm from the file's: with those masses the file's asks for a "
            "thorax whose centre is in front of the marker on the sternum. The bar of 3 cm is missed for "
            "that reason, along the walk; sideways and in height it is met, and beside the published model "
            "altogether. To meet it would cost the bar of the centre of pressure, 3 cm as well: moved "
            f"towards the laboratory's until it is {BAR:.0f} mm from it, our centre of mass puts the centre "
            f"of pressure of the recorded motion {missed_by_plates(one, -enough * apart):.0f} mm off.\n\n"
            "Masses off the lines between joints move our centre of mass back by 1.3 cm, and with it the "
            "centre of pressure of the motion, whose mean is still ahead in most files of the table.\n\n"
            "The vertical force is within 7 % of the weight in all files. The centre of pressure is within "
            "3 cm in single support in the four files in bold, once shifted; just so in `FunctionalWalk`, in "
            "which neither trunk nor arms have markers. Without regard to the axes of the soles it would be "
            f"{', '.join(f'{1e3 * value:.0f}' for value in without)} mm in them.\n"
        )


def missed_by_plates(one: Trial, offset: FloatArray) -> float:
    """How far the CoP is off the plates' in single support, our CoM moved by (n, 3) offsets, RMS [mm]."""
    assert one.measured is not None
    both = one.measured.covered & one.measured.single
    moved = np.array(one.dynamics.wrench)
    moved[:, 3:] += np.cross(offset, moved[:, :3])
    ours, theirs = (zero_moment_point(wrench, one.height)[both] for wrench in (moved, one.measured.wrench))
    return rms(ours - theirs)


def textbook_com(one: Trial, folder: Path) -> FloatArray:
    """(n, 3) of the published model of Plug-in Gait on the laboratory's own segments [m]."""
    recording = read_recording(folder / "mocap" / "grf" / one.name)
    assert isinstance(recording, MarkerRecording)
    frames = slice(one.found.first_frame, one.found.first_frame + len(one.found.time))
    ends = [Configuration(one.dynamics.body, q) for q in one.dynamics.q]

    def joint(segment: str) -> FloatArray:
        return np.array([at.segment_placement(segment)[1] for at in ends])

    def seen(name: str) -> FloatArray:
        return recording.marker(name)[frames]

    hips = [joint(f"{side}_thigh") for side in ("left", "right")]
    middle = 0.5 * (hips[0] + hips[1])
    above = middle + 0.828 * np.linalg.norm(hips[0] - hips[1], axis=1)[:, None] * np.array([0.0, 0.0, 1.0])
    total = 0.142 * (above + 0.895 * (middle - above)) + 0.081 * seen("HEDO")
    total = total + 0.355 * (seen("C7") + 0.63 * (above - seen("C7")))
    for side, hip in zip(("left", "right"), hips, strict=True):
        own = {"hip": hip, "shoulder": joint(f"{side}_upper_arm")}
        for first, last, mass, share in LAB_PARTS:
            near, far = (own[n] if n in own else seen(side[0].upper() + n) for n in (first, last))
            total = total + mass * (near + share * (far - near))
    return total


def share_row(one: Trial, inside: np.ndarray) -> tuple[object, ...]:
    """Of the table of margins, for some frames."""
    frames, shifted = int(inside.sum()), one.shifted
    losses = [loss for loss in one.losses if inside[loss.frame]]
    shares = share_by_cause(losses, frames)
    size = shifted.size[inside]
    return (
        one.name, frames, percent(float(np.mean(one.margins.whole_body[inside] > 0.0))),
        percent(1.0 - len(losses) / frames), percent(float(np.mean(one.margins.point_mass[inside] > 0.0))),
        f"{np.median(one.margins.whole_body[inside]):.0f} N.m",
        f"{1e3 * np.sqrt(np.mean(size**2)):.1f}, {1e3 * size.max():.0f} mm",
        *(percent(shares[cause]) for cause in Cause),
    )  # fmt: skip


def margin_rows(trials: list[Trial]) -> list[tuple[object, ...]]:
    """One for each recording."""
    return [share_row(one, np.ones(len(one.times), dtype=bool)) for one in trials]


def loss_rows(found: list[tuple[Trial, np.ndarray]]) -> Iterator[tuple[object, ...]]:
    """One for each run of frames whose margin is not positive although shifted."""
    for one, inside in found:
        losses = [loss for loss in one.losses if inside[loss.frame]]
        while losses:
            count = 1
            while count < len(losses) and (
                losses[count].frame == losses[count - 1].frame + 1 and losses[count].cause == losses[0].cause
            ):
                count += 1
            lowest = min(loss.margin for loss in losses[:count])
            yield one.name, f"{losses[0].time:.2f} s", count, f"{lowest:.0f} N.m", losses[0].cause.value
            losses = losses[count:]


def beside(one: Trial) -> FloatArray:
    """(k,) how far the centre of mass is inside of the axis of the sole in single support [m]."""
    found = []
    for number, phase in enumerate(one.schedule.sequence):
        if len(phase.stance) == 1 and (contact := phase.stance.contacts[0]).effector.endswith("foot"):
            frames = one.margins.phase == number
            local = (one.dynamics.com[frames] - contact.position) @ contact.rotation_contact_to_world
            found.append(local[:, 1] * (-1.0 if contact.effector.startswith("left") else 1.0))
    return np.concatenate(found)


def clips(folder: Path) -> Iterator[tuple[Trial, np.ndarray]]:
    """Each file of level walks without plates, and which of its frames are within a window."""
    windows: dict[str, list[slice]] = {}
    with (folder / "clips_locomotion.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["class"] in LEVEL:
                window = slice(int(row["first_frame0"]), int(row["end_frame0"]))
                windows.setdefault(row["file"], []).append(window)
    for name, parts in sorted(windows.items()):
        one = trial(folder / "mocap" / name)
        inside = np.zeros(len(one.times), dtype=bool)
        for part in parts:
            inside[part] = True
        yield one, inside


def clip_text(found: list[tuple[Trial, np.ndarray]], walks: list[Trial], heads: tuple[str, ...]) -> str:
    """Table of the walks without plates, what is wrong with skeletons, and what is left of all walks."""
    skeletons, marked = (float(np.median(np.concatenate([beside(one) for one in group])))
                         for group in ([one for one, _ in found], walks))  # fmt: skip
    shares = [np.mean(one.shifted.margins.whole_body[inside] > 0.0) for one, inside in found]
    shifts = [np.sqrt(np.mean(one.shifted.size[inside] ** 2)) for one, inside in found]
    everything = [(one, np.ones(len(one.times), dtype=bool)) for one in walks] + found
    return (
        "\n### Without plates\n\nWindows of level walks by the CMU Graphics Lab and ACCAD, recorded as "
        "skeletons. In single support the centre of mass is "
        f"{100.0 * skeletons:.1f} cm inside of the axis of the sole (median), in the walks above, whose "
        f"markers show the feet, {100.0 * marked:.1f} cm: the feet of skeletons stand too far inside, and "
        "they are not told where their masses are. "
        f"{sum(share >= 0.97 for share in shares)} of {len(shares)} files reach 97 % once shifted, by "
        f"{1e3 * np.median(shifts):.1f} mm (median of the root mean squares).\n\n"
        + table(heads, [share_row(one, inside) for one, inside in found])
        + "\n### What is left\n\nEvery run of frames of the two tables whose margin is not positive although "
        "shifted:\n\n"
        + table(("file", "from", "frames", "lowest", "put down to"), list(loss_rows(everything)))
    )  # fmt: skip


CONTROL = """
### What a shift can show

The least shift does not repair everything. With stances that begin and end too late it grows, until it meets
its bound and the margin stays negative. Median over the level walks of both tables:

"""
DELAYS = (0.0, 0.05, 0.1, 0.2, 0.3)


def control_text(trials: list[Trial]) -> str:
    """Table of the shifts that stances at wrong times ask for."""
    rows = []
    for delay in DELAYS:
        found = []
        for one in trials:
            start = one.supports.start - delay
            margins = recorded_margins(one.dynamics, one.schedule, start)
            moved = least_shift(one.found, one.dynamics, margins)
            shares = [float(np.mean(each.whole_body > 0.0)) for each in (margins, moved.margins)]
            found.append((*shares, moved.rms, float(moved.size.max())))
        recorded, shifted, rms, largest = np.median(found, axis=0)
        rows.append((
            f"{1e3 * delay:.0f} ms", percent(recorded), percent(shifted),
            f"{1e3 * rms:.1f} mm", f"{1e3 * largest:.0f} mm",
        ))  # fmt: skip
    heads = ("stances late by", "recorded", "shifted", "shift, RMS", "largest")
    return CONTROL + table(heads, rows)


def sitting_text(one: Trial) -> str:
    """Seat-offs, phases and torques of the sit-to-stands."""
    assert one.measured is not None
    seats = one.supports.of("buttocks")
    changes = seat_changes(seats, one.times, one.dynamics, one.measured)
    rows = [(change.event, f"{change.time:.2f} s", f"{1e3 * change.error:+.0f} ms") for change in changes]
    text = SIT + table(("event", "plates", "extracted minus plates"), rows)
    names = one.motion.joint_names
    heads = (
        "rise",
        "seated before",
        "to upright",
        "standing",
        "highest vertical force",
        "hip",
        "knee",
        "ankle",
    )
    rises = []
    for number, (seat, following) in enumerate(pairwise(seats), start=1):
        rising = (one.times >= seat.end - 0.5) & (one.times < following.start)
        high = one.dynamics.com[:, 2]
        top = float(np.quantile(high[rising], 0.9))
        upright = float(one.times[np.flatnonzero(rising & (high > top - 0.02))[0]])
        window = rising & (one.times < upright + 0.2)
        torques = [
            max(
                float(np.abs(one.motion.tau[window, 6 + names.index(f"{side}_{joint}")]).max())
                for side in ("left", "right")
            )
            for joint in ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
        ]
        push = float(one.dynamics.vertical_force[window].max()) / (GRAVITY * one.dynamics.body.mass)
        rises.append(
            (
                number, f"{seat.duration:.2f} s", f"{upright - seat.end:.2f} s",
                f"{following.start - upright:.2f} s", f"{push:.2f} of the weight",
                *(f"{torque:.0f} N.m" for torque in torques),
            )
        )  # fmt: skip
    return (
        text + "\nPhases of each, and the largest torques from half a second before seat-off until upright:"
        + "\n\n"
        + table(heads, rises)
    )  # fmt: skip


# --- figures -----------------------------------------------------------------------------------


def shade(axes: Axes, one: Trial) -> None:
    """Single supports behind a plot over time."""
    for number, phase in enumerate(one.schedule.sequence):
        if len(phase.stance) == 1:
            begin, end = one.schedule.instants[number : number + 2]
            colour = COLOURS[phase.stance.effectors[0]]
            axes.axvspan(begin, end, color=colour, alpha=0.13, linewidth=0.0)


def margin_figure(one: Trial) -> None:
    """Margins over time, as Figures 4.11 and 4.13, with that of the plates."""
    assert one.measured is not None
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    both = figure.subplots(2, 1, sharex=True)
    theirs = margins_of_wrenches(
        one.margins.polytopes, one.margins.phase, one.measured.wrench, one.dynamics.com
    ).margin
    covered = np.where(one.measured.covered, theirs, np.nan)
    axes = both[0]
    shade(axes, one)
    axes.plot(one.times, one.margins.point_mass, color=COLOURS["point"], label="point mass")
    axes.plot(one.times, one.margins.whole_body, color=COLOURS["ours"], label="whole body")
    axes.plot(one.times, covered, color=COLOURS["plates"], label="force plates")
    axes.plot(one.schedule.instants[1:-1], np.zeros(len(one.schedule.instants) - 2), "ko", markersize=3)
    axes.axhline(0.0, color="k", linewidth=0.6)
    axes.set_ylabel("margin [N.m]")
    axes.set_ylim(-60.0, None)
    axes.legend(loc="upper center", ncols=3, fontsize=8)
    axes.set_title(f"{one.name}; shaded: left (green) or right foot alone", loc="left", fontsize=10)
    whole, mass = one.dynamics.wrench, one.dynamics.point_mass_wrench
    for axis, name in enumerate(("lateral axis", "forward axis")):
        rate = (whole - mass)[:, 3 + (1 - axis)]
        both[1].plot(one.times, rate, label=f"about the world's {'yx'[axis]} ({name})")
    shade(both[1], one)
    both[1].set_ylabel("rate of angular momentum\nabout the centre of mass [N.m]")
    both[1].set_xlabel("time [s]")
    both[1].legend(loc="lower right", fontsize=8)
    both[1].set_xlim(one.times[0], one.times[-1])
    figure.savefig(IMAGES / "recorded-margin.png", dpi=110)


def force_figure(trials: list[Trial]) -> None:
    """Vertical force and centre of pressure beside the plates."""
    figure = Figure(figsize=(9.0, 2.9 * len(trials)), layout="constrained")
    rows = figure.subplots(len(trials), 3, squeeze=False)
    for axes, one in zip(rows, trials, strict=True):
        assert one.measured is not None
        weight = GRAVITY * one.dynamics.body.mass
        seen = np.where(one.measured.covered, one.measured.wrench[:, 2], np.nan)
        shade(axes[0], one)
        axes[0].plot(one.times, one.dynamics.vertical_force / weight, color=COLOURS["ours"])
        axes[0].plot(one.times, one.measured.wrench[:, 2] / weight, color=COLOURS["plates"], alpha=0.35)
        axes[0].plot(one.times, seen / weight, color=COLOURS["plates"])
        axes[0].set_ylabel("vertical force / weight")
        axes[0].set_title(one.name, loc="left", fontsize=9)
        both = one.measured.covered & one.measured.single
        ours, theirs = one.dynamics.zero_moment_point(one.height), np.full((len(both), 2), np.nan)
        moved = one.shifted.dynamics.zero_moment_point(one.height)
        theirs[both] = zero_moment_point(one.measured.wrench[both], one.height)
        along = ahead(one)
        left = np.array([-along[1], along[0]])
        for axis, (way, name) in enumerate(((along, "along"), (left, "to the left")), start=1):
            shade(axes[axis], one)
            shown = np.where(np.isnan(theirs[:, 0]), np.nan, ours @ way)
            base = np.nanmin(theirs @ way)
            axes[axis].plot(one.times, shown - base, color=COLOURS["ours"], label="motion")
            nearest = np.where(np.isnan(theirs[:, 0]), np.nan, moved @ way)
            axes[axis].plot(one.times, nearest - base, "--", color=COLOURS["ours"], label="shifted")
            axes[axis].plot(one.times, theirs @ way - base, color=COLOURS["plates"], label="plates")
            axes[axis].set_ylabel(f"CoP {name} [m]")
            axes[axis].set_xlim(one.times[both][0] - 0.2, one.times[both][-1] + 0.2)
        axes[0].set_xlim(one.times[both][0] - 0.4, one.times[both][-1] + 0.4)
    rows[0, 1].legend()
    for axes in rows[-1]:
        axes.set_xlabel("time [s]")
    figure.savefig(IMAGES / "recorded-forces.png", dpi=110)


def space_figure(one: Trial) -> None:
    """Horizontal forces admitted before and after a foot lifts, as Figure 4.10."""
    phase = next(
        number
        for number, held in enumerate(one.schedule.sequence)
        if number and len(held.stance) == 1 and len(one.schedule.sequence[number - 1].stance) == 2
        and one.schedule.instants[number] > one.times[0] + 0.3
    )  # fmt: skip
    frame = int(np.flatnonzero(one.margins.phase == phase)[0])
    force = one.dynamics.wrench[frame, :3]
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.subplots()
    for number, colour, label in ((phase - 1, "#C0392B", "before"), (phase, COLOURS["ours"], "after")):
        polytope = one.margins.polytopes[number]
        assert polytope is not None
        space = force_space(polytope, one.dynamics.com[frame])
        corners = polygon_of_halfplanes(space.H[:, :2], space.h - space.H[:, 2] * force[2])
        if len(corners):
            axes.fill(*corners.T, alpha=0.25, color=colour, label=f"{label} the lift of a foot")
    axes.plot(*force[:2], "ko", markersize=5, label="force of the motion")
    axes.set_aspect("equal")
    axes.set_xlabel("force along x [N]")
    axes.set_ylabel("force along y [N]")
    axes.set_title(f"{one.name}, {one.times[frame]:.2f} s", loc="left", fontsize=9)
    axes.legend(fontsize=8)
    figure.savefig(IMAGES / "recorded-force-space.png", dpi=110)


def lift_text(one: Trial) -> str:
    """What the figure of margins shows, in numbers."""
    supports = np.array([len(phase.stance) for phase in one.schedule.sequence])[one.margins.phase]
    lifts = [
        k for k in range(1, len(supports)) if supports[k - 1] == 2 and supports[k] == 1
    ]  # fmt: skip
    margin = one.margins.whole_body
    pairs = ", ".join(f"{margin[k - 1]:.0f} to {margin[k]:.0f}" for k in lifts)
    apart = np.abs(one.margins.whole_body - one.margins.point_mass)
    return (
        f"\n![margins over time](images/recorded-margin.png)\n\nWith the lift of a foot the margin of "
        f"`{one.name}` "
        f"falls from one frame to the next ({pairs} N.m), as in Figure 4.11; lowest are the frames before "
        f"the next "
        f"touch-down. Both models are {np.median(apart):.0f} N.m apart (median); "
        f"{percent(float(np.mean(apart > 25.0)))} "
        "of the frames differ by more than the 25 N.m of Figure 4.13. Admissible forces in the horizontal "
        "plane "
        "at the lift of a foot, as Figure 4.10:\n\n![force space](images/recorded-force-space.png)\n"
    )


def main() -> None:
    """Analyse the recordings of the folder on the command line and write the page."""
    folder = Path(sys.argv[1]) if len(sys.argv) == 2 else Path()
    if not (folder / "mocap" / "grf").is_dir() or not (folder / "clips_locomotion.csv").is_file():
        raise SystemExit(
            "usage: python docs/recorded_balance.py FOLDER; valid: a folder with mocap and clips"
        )
    files = sorted(path for path in (folder / "mocap" / "grf").rglob("*") if path.suffix in (".c3d", ".trc"))
    trials = [trial(path) for path in files if not path.name.startswith("DJ")]
    walks = [one for one in trials if not one.name.endswith(SITTING)]
    sitting = next(one for one in trials if one.name.endswith(SITTING))
    judged = [next(one for one in walks if one.name.endswith(name)) for name in JUDGED]
    shown = next(one for one in walks if one.name.endswith("walkingTO1.trc"))
    skeletons = list(clips(folder))
    force_figure(judged)
    margin_figure(shown)
    torque_figure(shown)
    space_figure(shown)
    heads = (
        "file", "mass, file", "mass, plates", "frames", "single", "vertical force", "single support",
        "CoP", "shifted", "mean", "timing", "plates' margin", "apart", "CoM, laboratory's",
    )  # fmt: skip
    torque_heads = (
        "file", "frames", *(f"{readable(joint)}: least, smooth, shifted" for joint in JOINTS),
        *(f"{readable(joint)}: largest" for joint in JOINTS),
    )  # fmt: skip
    margin_heads = ("file", "frames", "recorded", "shifted", "point mass", "median", "shift: RMS, largest",
                    *(cause.value.split(" of ")[0] for cause in Cause))  # fmt: skip
    PAGE.write_text(
        TEXT + PLATES + table(heads, list(plate_rows(walks)))
        + "\n![forces](images/recorded-forces.png)\n" + COM + "".join(com_text(walks, folder))
        + standing_text(next(one for one in walks if one.name.endswith(CIRCLE)))
        + TORQUES + table(torque_heads, list(torque_rows(trials)))
        + "\n![torques](images/recorded-torques.png)\n" + torque_text(trials)
        + SHARES + table(margin_heads, margin_rows(trials)) + lift_text(shown)
        + clip_text(skeletons, walks, margin_heads)
        + control_text(walks + [one for one, _ in skeletons]) + sitting_text(sitting)
    )  # fmt: skip


if __name__ == "__main__":
    main()
