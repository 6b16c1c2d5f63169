"""Analysis of recordings: from a file, or several, to all that is measured of the person."""

import time as clock
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from manikin.analysis.activity import recognise
from manikin.analysis.analysis import Analysis, MeasuredMotion, PlateReport, plate_report, remarks_on
from manikin.analysis.gait_cycles import gait_report
from manikin.analysis.plausibility import implausible
from manikin.balance.zmp import LEAST_LOAD
from manikin.body.limbs import with_knees_and_elbows
from manikin.body.strength import HANDS, carrying
from manikin.ergonomics import Circumstances, LowestMargin, ergonomics_of, upright_neck
from manikin.errors import BodyError, InputError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.recordings.dynamics.plate_forces import mass_on_plates, plate_forces, without_offsets
from manikin.recordings.dynamics.recorded_dynamics import (
    CUTOFF,
    RecordedDynamics,
    RecordedMargins,
    dynamics_of,
    recorded_margins,
    touch_downs_of,
    with_mass,
)
from manikin.recordings.dynamics.recorded_forces import motion_on_contacts
from manikin.recordings.dynamics.shifted_motion import least_shift
from manikin.recordings.readers import READERS, read_recording
from manikin.recordings.readers.marker_map import MarkerMap
from manikin.recordings.readers.markers import ForcePlate, MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.marker_reconstruction import sides_exchanged
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.reconstruction.reconstruct import reconstruct
from manikin.recordings.supports.recorded_stances import FRICTION, recorded_schedule
from manikin.recordings.supports.support_levels import effector_places
from manikin.recordings.supports.supports import supports_of
from manikin.recordings.supports.treadmill import belt_velocity, from_the_belt, plates_from_the_belt
from manikin.walking.segmentation import PathSegments, ShoulderPaths, segment_path

WALKS = ("walking", "carrying", "running", "stepping", "standing", "uneven ground")
"""Activities that are cut into holonomic and nonholonomic stretches."""

UPRIGHT = 0.5
"""Height of the shoulders above the pelvis, per that in standing, below which no walk is segmented."""


def walked_segments(found: Reconstruction) -> PathSegments | None:
    """Holonomic and nonholonomic stretches of a walk, by the shoulders ([Truong2010]_ function 1).

    None where the trunk ever lies or is bent so far that the shoulders do not give the heading.
    """
    places = _places(found, found.q)
    standing = _places(found, found.body.standing_posture()[None])[0]
    height = places[:, :2, 2].mean(axis=1) - places[:, 2, 2]
    if np.any(height < UPRIGHT * float(standing[:2, 2].mean() - standing[2, 2])):
        return None
    try:
        return segment_path(ShoulderPaths(places[:, 0, :2], places[:, 1, :2], found.rate))
    except InputError:  # the shoulders are above each other
        return None


def _places(found: Reconstruction, postures: FloatArray) -> FloatArray:
    """(n, 3, 3) left shoulder, right shoulder and pelvis [m]."""
    shoulders = effector_places(found.body, postures, ("left_upper_arm", "right_upper_arm"))
    return np.stack([*shoulders, postures[:, :3]], axis=1)


@dataclass(frozen=True)
class AnalysisJob:
    """One file to measure, the directory of its results, if any, and whether the report has its figure."""

    path: Path
    directory: Path | None = None
    draw: bool = True


@dataclass(frozen=True)
class AnalysisEntry:
    """Result of one file: :meth:`manikin.analysis.Analysis.as_dict`, or None and why it was refused."""

    job: AnalysisJob
    summary: dict[str, Any] | None
    refusal: str = ""


def recordings_in(sources: Iterable[str | Path]) -> tuple[Path, ...]:
    """Recordings among files and folders, each once: files as given, those of a folder in order of path.

    A file that is named is taken whatever its ending, so that its reader can say what is wrong with it.
    Folders are searched to any depth. InputError if a source is not there, or a folder holds no recording.
    """
    found: dict[Path, None] = {}
    for source in map(Path, sources):
        if not source.exists():
            raise InputError(f"{source}: there is no such file; valid: a recording, or a folder of them")
        if not source.is_dir():
            found[source] = None
            continue
        inside = sorted(one for one in source.rglob("*") if one.suffix.lower() in READERS and one.is_file())
        if not inside:
            raise InputError(f"{source}: holds no recording; valid: files {', '.join(READERS)}")
        found |= dict.fromkeys(inside)
    return tuple(found)


SEXES, FEWEST_FRAMES = ("male", "female"), 10
"""Tables of segment masses, and frames that smoothing and differences need."""


@dataclass(frozen=True)
class AnalysisOptions:
    """What a recording does not contain, or not precisely.

    Attributes:
        frames: First frame and the one after the last; None for all.
        mass: Of the person [kg]; None for the file's, that by the plates, or a usual one.
        sex: Table of segment masses, ``"male"`` or ``"female"``.
        load: Carried in the hand ``"left"``, ``"right"`` or ``"both"`` [kg]: part of the masses, and of RULA
            and REBA.
        as_recorded: Whether no shifted motion is looked for, to stand beside the recorded one.
        markers: Marker map or its file, for names of markers that do not say what they mark.
    """

    frames: tuple[int, int] | None = None
    mass: float | None = None
    sex: str = "male"
    friction: float = FRICTION
    load: float = 0.0
    load_hand: str = "both"
    as_recorded: bool = False
    markers: MarkerMap | str | Path | None = None

    def __post_init__(self) -> None:
        if self.mass is not None:
            finite_number(self.mass, "mass [kg]", above=0.0)
        if self.sex not in SEXES:
            raise InputError(f"sex is {self.sex!r}; valid: {', '.join(SEXES)}")
        finite_number(self.friction, "friction", above=0.0)
        finite_number(self.load, "load [kg]", at_least=0.0)
        if self.load_hand not in HANDS:
            raise InputError(f"hand of the load is {self.load_hand!r}; valid: {', '.join(HANDS)}")


def analyze_file(path: str | Path, options: AnalysisOptions | None = None) -> Analysis:
    """Read a recording and measure it.

    Args:
        path: C3D, TRC (with its MOT beside it), BVH or AMC (with its ASF).
        options: What the file does not say.

    Raises:
        InputError: If it cannot be read, or is not a person's motion that can be measured; the message
            begins with the file.
    """
    given = options or AnalysisOptions()
    began = clock.perf_counter()
    recording = read_recording(path, given.frames, given.markers)
    try:
        found = analyze(recording, given, Path(path).stem)
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    return replace(found, source=str(path), wall=clock.perf_counter() - began)


def analyze(
    recording: Recording | MarkerRecording, options: AnalysisOptions | None = None, name: str = ""
) -> Analysis:
    """Reconstruct a recorded person and measure supports, balance, forces, walking and ergonomics.

    Args:
        recording: At least :data:`FEWEST_FRAMES` frames.
        options: What the recording does not say.
        name: What to call it; the recording's own name if empty.

    Raises:
        InputError: If it is too short, or is not a person's motion that can be measured.
    """
    given, began = options or AnalysisOptions(), clock.perf_counter()
    where, enough = f"recording {recording.name!r}", f"valid: at least {FEWEST_FRAMES}"
    if len(recording) < FEWEST_FRAMES:
        raise InputError(f"{where} has {len(recording)} frame(s); {enough}")
    if recording.rate <= 2.0 * CUTOFF.usual:
        wrong = f"has {recording.rate:g} frames per second"
        raise InputError(f"{where} {wrong}; valid: more than {2.0 * CUTOFF.usual:g}")
    start, plates, stated = 0.0, (), given.mass
    if isinstance(recording, MarkerRecording):
        recording = sides_exchanged(recording)
        start, plates, stated = recording.start, recording.plates, given.mass or recording.subject.mass
    found = reconstruct(recording, sex=given.sex, mass=given.mass)
    found = replace(found, body=carrying(found.body, given.load, given.load_hand))
    if len(found.time) < FEWEST_FRAMES:
        raise InputError(f"{where} shows the person in {len(found.time)} frame(s); {enough}")
    found, plates, notes = _on_still_ground(found, plates, start)
    supports = supports_of(found, start=start)
    if not {one.effector for one in supports.supports} <= set(found.body.effectors):
        found = replace(found, body=with_knees_and_elbows(found.body))
    schedule = recorded_schedule(found, supports, friction=given.friction)
    touch_downs = touch_downs_of(supports)
    dynamics = dynamics_of(found, touch_downs=touch_downs)
    mass, zeroed = None, ()
    if plates:
        plates, zeroed = without_offsets(plates, schedule)
        mass = mass_on_plates(dynamics, plate_forces(plates, dynamics.time + supports.start, schedule))
    if mass is not None and not stated and (weighed := _weighed(found, mass - given.load)) is not None:
        found = weighed
        schedule = recorded_schedule(found, supports, friction=given.friction)
        dynamics = dynamics_of(found, touch_downs=touch_downs)
    recorded = recorded_margins(dynamics, schedule, supports.start)
    shifted = None if given.as_recorded else least_shift(found, dynamics, recorded)
    measured = MeasuredMotion(dynamics, recorded, shifted)
    motion = motion_on_contacts(dynamics, schedule, supports.start, recorded)
    beside: Motion | None = None
    if (believed := measured.believed) is not None:
        beside = motion_on_contacts(believed.dynamics, schedule, supports.start, believed.margins)
    report: PlateReport | None = None
    if plates:
        report = plate_report(plates, supports, schedule, measured, (motion, beside), mass)
        report = replace(report, remarks=zeroed)
    neck = upright_neck(found.body, motion.q)
    upright = 0.0 if neck is None else float(np.degrees(neck))
    ergonomics = ergonomics_of(
        found.body, motion, given=Circumstances(load_kg=given.load, neck_upright_deg=upright),
        untold=found.neutral, lowest=_lowest(motion, recorded),
    )  # fmt: skip
    activity, gait = recognise(found, supports, motion), None
    if activity.is_gait:
        loads, timing = (None, ()) if report is None else (report.leg_loads, report.timing)
        gait = gait_report(supports, motion, found.body.own_mass, timing, loads)
    analysis = Analysis(
        name=name or recording.name, source=recording.name, rate=recording.rate, sex=given.sex, found=found,
        supports=supports, motion=motion, shifted_motion=beside, point_mass_margin=recorded.point_mass,
        measured=measured, limiting=recorded.limiting(recorded.lowest),
        cop=_centre_of_pressure(dynamics, motion, min(supports.surfaces, default=0.0)),
        activity=activity, gait=gait,
        segments=walked_segments(found) if activity.kind in WALKS else None, ergonomics=ergonomics,
        plates=report, remarks=(), wall=0.0, implausible=implausible(found, dynamics, supports),
    )  # fmt: skip
    remarks = (*notes, *remarks_on(analysis, recording))
    return replace(analysis, remarks=remarks, wall=clock.perf_counter() - began)


def _on_still_ground(
    found: Reconstruction, plates: tuple[ForcePlate, ...], start: float
) -> tuple[Reconstruction, tuple[ForcePlate, ...], tuple[str, ...]]:
    """Motion and plates as seen from the belt of a treadmill, with a remark; as they are without one."""
    velocity = belt_velocity(found)
    if velocity is None:
        return found, plates, ()
    speed = float(np.linalg.norm(velocity))
    remark = (
        f"treadmill: feet that carry move at {speed:.2f} m/s while the person stays; places and the centre "
        "of pressure are those seen from the belt, as in a walk over the ground"
    )
    moved = plates_from_the_belt(plates, velocity, start + found.first_frame / found.rate)
    return from_the_belt(found, velocity), moved, (remark,)


def _weighed(found: Reconstruction, mass: float) -> Reconstruction | None:
    """With the mass by the plates; None if it is not an adult's, as where a foot stands beside them."""
    try:
        return with_mass(found, mass)
    except BodyError:
        return None


def _centre_of_pressure(dynamics: RecordedDynamics, motion: Motion, height: float) -> FloatArray:
    """(n, 2) on the ground [m]; NaN where nothing supports."""
    loaded = motion.support.any(axis=1) & (dynamics.vertical_force > LEAST_LOAD)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(loaded[:, None], dynamics.zero_moment_point(height), np.nan)


def _lowest(motion: Motion, margins: RecordedMargins) -> LowestMargin:
    """The lowest margin of a motion, with its limiting contact."""
    frame, value = margins.lowest, float(margins.whole_body[margins.lowest])
    on = tuple(name for name, held in zip(motion.contact_names, motion.support[frame], strict=True) if held)
    return LowestMargin(
        value, motion.margin_unit, float(motion.time[frame]), on, margins.limiting(frame), value,
        "recorded contacts" if on else None, None if on else "nothing is in contact at that instant",
    )  # fmt: skip
