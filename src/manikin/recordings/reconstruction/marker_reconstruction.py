"""Recorded markers as a motion of our human.

A person's lengths and the first postures follow from joint centres. On some frames every marker of a known
segment is placed on our human at its median position; postures and marker positions are then improved in
turn, and finally all frames follow the markers. Joint centres follow from markers on the skin:

* Hips where the file has them; else by regression on the distance of the ASIS and the depth of the pelvis:
  Harrington, Zavatsky, Lawson, Yuan, Theologis, "Prediction of the hip joint centre in adults, children, and
  patients with cerebral palsy based on magnetic resonance imaging", Journal of Biomechanics 40 (2007).
* Knees, ankles and elbows midway between two markers, or half the joint's width from the outer one, at a
  right angle to the plane of the limb (after Davis, Ounpuu, Tyburski, Gage, "A gait analysis data collection
  and reduction technique", Human Movement Science 10 (1991)).
* Shoulders below the acromion: by the measured offset, or by 17 % of the distance of both acromia (Rab,
  Petuskey, Bagley, "A method for determination of upper extremity kinematics", Gait & Posture 15 (2002)).
* Wrists midway between two markers, or at the only one.

Markers that are not seen give NaN.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.errors import InputError
from manikin.kinematics.point_targets import PointTargets, SegmentPlacements
from manikin.kinematics.tracking import follow, improved
from manikin.numerics.spatial import FloatArray, unit
from manikin.recordings.readers.marker_sets import MarkerSet, marker_set
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Subject
from manikin.recordings.reconstruction.cleaning import Cleaning, Repair, gaps_of, without_jumps
from manikin.recordings.reconstruction.orientation_targets import placing_targets
from manikin.recordings.reconstruction.proportions import Reconstruction, frames, human_of, middle

KNEE_WIDTH, ANKLE_WIDTH, ELBOW_WIDTH, MARKER_RADIUS = 0.10, 0.07, 0.08, 0.007
"""Width of a joint where neither the file nor a second marker gives it, and radius of a marker [m]."""

SHOULDER_SHARE = 0.17
"""Depth of a shoulder's centre below its acromion, per distance of both acromia (Rab et al. 2002)."""

PELVIS_WIDTHS = (0.12, 0.45)
"""Distances of the ASIS that are believed [m]."""

BENT = 0.12
"""Share of a limb's length by which its middle joint is off the line of its ends when the bend is trusted."""

_LIMBS = {"leg": ("knee", "thigh", "foot", -1.0), "forearm": ("elbow", "upper_arm", "hand", 1.0)}
"""Segment below a hinge: name of its markers, segments at both ends of the limb, sense of the bend."""


def landmarks(recording: MarkerRecording, found: MarkerSet) -> dict[str, FloatArray]:
    """(n, 3) places [m] of the markers with a role, by role."""
    return {role: recording.marker(name) for role, name in found.roles.items()}


def pelvis_axes(marks: Mapping[str, FloatArray], where: str) -> FloatArray:
    """(n, 3, 3) axes of the pelvis by its markers, to the world: y to the left ASIS, x forward in the plane.

    Of them both ASIS are needed, and both PSIS or the sacrum. If one is missing or never seen with the
    others, or the ASIS are too far apart or too close, an InputError begins with ``where``.
    """
    for side in SIDES:
        if f"{side}_asis" not in marks:
            wrong = f"no marker that is known as the {side} ASIS"
            valid = "both, and PSIS or sacrum (a marker map says what markers mark: --markers)"
            raise InputError(f"{where} has {wrong}; valid: {valid}")
    y = marks["left_asis"] - marks["right_asis"]
    x = middle(marks, "asis") - _back(marks, where)
    axes = frames(np.cross(x, y), y, keep_y=True)
    width = np.linalg.norm(y, axis=1)
    seen = ~np.isnan(axes[:, 0, 0])
    if not seen.any():
        raise InputError(f"{where} never sees the markers of the pelvis at once; valid: in one frame or more")
    (low, high), usual = PELVIS_WIDTHS, float(np.median(width[seen]))
    if not low <= usual <= high:
        right = f"valid: {low} to {high} m (is the unit of length right?)"
        raise InputError(f"{where} has the ASIS {usual:.3g} m apart; {right}")
    return axes


def _back(marks: Mapping[str, FloatArray], where: str) -> FloatArray:
    if "left_psis" in marks and "right_psis" in marks:
        return middle(marks, "psis")
    if "sacrum" not in marks:
        raise InputError(f"{where} has no marker on the back of the pelvis; valid: both PSIS, or the sacrum")
    return marks["sacrum"]


def hip_centres(marks: Mapping[str, FloatArray], axes: FloatArray, where: str) -> dict[str, FloatArray]:
    """(n, 3) hips by segment, fixed to the pelvis: the file's, or by Harrington et al. (2007)."""
    front = middle(marks, "asis")
    width = float(np.nanmedian(np.linalg.norm(marks["left_asis"] - marks["right_asis"], axis=1)))
    depth = float(np.nanmedian(np.linalg.norm(front - _back(marks, where), axis=1)))
    back, down, aside = -0.24 * depth - 0.0099, -0.30 * width - 0.0109, 0.33 * width + 0.0073
    local = {"left": np.array([back, aside, down]), "right": np.array([back, -aside, down])}
    if all(f"{side}_hip" in marks for side in SIDES):
        for side in SIDES:
            given = np.einsum("nji,nj->ni", axes, marks[f"{side}_hip"] - front)
            given = given[~np.isnan(given[:, 0])]
            local[side] = np.median(given, axis=0) if len(given) else local[side]
    return {f"{side}_thigh": front + axes @ local[side] for side in SIDES}


def marker_centres(
    marks: Mapping[str, FloatArray], axes: FloatArray, subject: Subject, where: str
) -> dict[str, FloatArray]:
    """Joint centres in the world, (n, 3) [m], by the segment that begins there, of those that are known.

    ``axes`` (n, 3, 3) are those of :func:`pelvis_axes`; messages begin with ``where``.
    """
    radius = MARKER_RADIUS if subject.marker_radius is None else subject.marker_radius
    found = hip_centres(marks, axes, where) | _shoulders(marks, subject, radius)
    widths = {"leg": subject.knee_width or KNEE_WIDTH, "forearm": subject.elbow_width or ELBOW_WIDTH}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        found |= _ankle(marks, side, sign, axes, 0.5 * (subject.ankle_width or ANKLE_WIDTH) + radius)
        wrist = [marks[name] for name in (f"{side}_wrist_radius", f"{side}_wrist_ulna") if name in marks]
        if wrist:
            found[f"{side}_hand"] = sum(wrist[1:], wrist[0]) / len(wrist)
        for part, (joint, first, last, bend) in _LIMBS.items():
            outer, inner = (marks.get(f"{side}_{joint}_{place}") for place in ("lateral", "medial"))
            begin, end = found.get(f"{side}_{first}"), found.get(f"{side}_{last}")
            if outer is not None and inner is not None:
                found[f"{side}_{part}"] = 0.5 * (outer + inner)
            elif outer is not None and begin is not None:
                end = np.full_like(outer, np.nan) if end is None else end
                reach = 0.5 * widths[part] + radius
                found[f"{side}_{part}"] = _hinge(outer, begin, end, axes[:, :, 1], sign, bend, reach)
    return {name: places for name, places in found.items() if not np.all(np.isnan(places[:, 0]))}


def _hinge(
    outer: FloatArray, begin: FloatArray, end: FloatArray, aside: FloatArray, sign: float, bend: float,
    reach: float,
) -> FloatArray:  # fmt: skip
    """Centre at ``reach`` from an outer marker, at a right angle to the plane of the limb's two parts.

    That plane holds both ends of the limb and the centre; a limb that is nearly straight has the pelvis'
    left-right axis as that of its hinge.
    """
    along = unit(outer - begin)
    plain = sign * unit(aside - np.sum(aside * along, axis=1, keepdims=True) * along)
    line = unit(end - begin)
    off = outer - begin - np.sum((outer - begin) * line, axis=1, keepdims=True) * line
    distance = np.linalg.norm(off, axis=1, keepdims=True)
    share = np.minimum(reach / np.maximum(distance, 1e-9), 1.0)
    away = off / np.maximum(distance, 1e-9)
    normal = share * away + sign * bend * np.sqrt(1.0 - share**2) * np.cross(line, away)
    length = np.linalg.norm(end - begin, axis=1, keepdims=True)
    trust = np.clip(np.sqrt(np.maximum(distance**2 - reach**2, 0.0)) / (BENT * length), 0.0, 1.0) ** 2
    agrees = np.sum(normal * plain, axis=1, keepdims=True) > 0.3
    trust = np.where(np.isnan(trust) | ~agrees, 0.0, trust)
    normal = np.where(trust > 0.0, normal, plain)
    return outer - reach * unit(trust * normal + (1.0 - trust) * plain)


def _ankle(
    marks: Mapping[str, FloatArray], side: str, sign: float, axes: FloatArray, reach: float
) -> dict[str, FloatArray]:
    outer, inner = (marks.get(f"{side}_ankle_{place}") for place in ("lateral", "medial"))
    if outer is None:
        return {}
    if inner is not None:
        return {f"{side}_foot": 0.5 * (outer + inner)}
    heel, toe, knee = (marks.get(f"{side}_{name}") for name in ("heel", "toe", "knee_lateral"))
    aside = axes[:, :, 1]
    if heel is not None and toe is not None and knee is not None:
        across = np.cross(knee - outer, toe - heel)
        aside = np.where(np.isnan(across), aside, unit(across))
    return {f"{side}_foot": outer - sign * reach * aside}


def _shoulders(marks: Mapping[str, FloatArray], subject: Subject, radius: float) -> dict[str, FloatArray]:
    if "left_shoulder" not in marks or "right_shoulder" not in marks:
        return {}
    left, right = marks["left_shoulder"], marks["right_shoulder"]
    if np.all(np.isnan(left[:, 0] + right[:, 0])):
        return {}
    depth = SHOULDER_SHARE * float(np.nanmedian(np.linalg.norm(left - right, axis=1)))
    if subject.shoulder_offset is not None:
        depth = subject.shoulder_offset + radius
    up = middle(marks, "shoulder") - middle(marks, "asis")
    down = depth * frames(up, left - right, keep_y=True)[:, :, 2]
    return {"left_upper_arm": left - down, "right_upper_arm": right - down}


def check_sides(marks: Mapping[str, FloatArray], axes: FloatArray, where: str) -> None:
    """Refuse markers whose left and right are swapped.

    The pelvis is not turned inside out: left ASIS, back and the way up to the trunk or away from the ankles
    make a right-handed frame; knees, ankles and shoulders are on the side of their ASIS, as a median. If they
    are not, an InputError begins with ``where``.
    """
    up = _upward(marks)
    ways = [] if up is None else [("of the pelvis", axes[:, :, 2], up)]
    for role in ("knee_lateral", "ankle_lateral", "shoulder", "elbow_lateral"):
        left, right = marks.get(f"left_{role}"), marks.get(f"right_{role}")
        if left is not None and right is not None:
            ways.append((role.replace("_lateral", ""), axes[:, :, 1], left - right))
    for name, axis, way in ways:
        along = np.sum(axis * way, axis=1)
        seen = along[~np.isnan(along)]
        if seen.size and np.median(seen) < 0.0:
            raise InputError(f"{where} has left and right {name} swapped; valid: left on the person's left")


def sides_exchanged(recording: MarkerRecording) -> MarkerRecording:
    """A recording whose left is the person's left; the same one where it is, or where that is not known.

    Left ASIS, back and the way up make a left-handed frame if the names of all sides are exchanged, or if an
    axis of the file is mirrored. What is called left is then taken for right, by a marker map, and a remark
    says so. Where only some markers are exchanged nothing is changed: :func:`check_sides` refuses them.
    """
    where, found = f"recording {recording.name!r}", marker_set(recording)
    marks = landmarks(recording, found)
    try:
        axes, up = pelvis_axes(marks, where), _upward(marks)
    except InputError:  # said when the person is reconstructed
        return recording
    along = np.zeros(1) if up is None else np.sum(axes[:, :, 2] * up, axis=1)
    if np.isnan(along).all() or np.nanmedian(along) >= 0.0:
        return recording
    roles = {name: role for role, name in found.roles.items()}
    told = {name: _other_side(roles.get(name, segment)) for name, segment in found.segments.items()}
    remark = (
        "left and right are exchanged, or an axis is mirrored: what the file calls left is taken for the "
        "person's right (if an axis is mirrored, the person is shown mirrored)"
    )
    exchanged = replace(recording, marker_map=told, remarks=(*recording.remarks, remark))
    try:
        marks = landmarks(exchanged, marker_set(exchanged))
        check_sides(marks, pelvis_axes(marks, where), where)
    except InputError:
        return recording
    return exchanged


def _other_side(name: str) -> str:
    """Name of a landmark or segment of the other side; that of the middle stays."""
    for side, other in zip(SIDES, SIDES[::-1], strict=True):
        if name.startswith(f"{side}_"):
            return f"{other}_{name.removeprefix(f'{side}_')}"
    return name


def _upward(marks: Mapping[str, FloatArray]) -> FloatArray | None:
    pelvis = middle(marks, "asis")
    if "left_shoulder" in marks and "right_shoulder" in marks:
        return middle(marks, "shoulder") - pelvis
    if "c7" in marks:
        return marks["c7"] - pelvis
    for name in ("knee_lateral", "ankle_lateral"):
        if f"left_{name}" in marks and f"right_{name}" in marks:
            return pelvis - middle(marks, name)
    return None


PLACING_FRAMES, COMPLETE, ROUNDS = 40, 0.9, 2
"""Frames on which markers are placed, share that they see of what the best frame sees, and times that
postures and places are improved in turn."""

LEAST_SEEN = 0.5
"""Share of the markers followed that the first and the last frame see."""


def centres_of_markers(recording: MarkerRecording) -> dict[str, FloatArray]:
    """(n, 3) joint centres [m] by segment, NaN where one is not known; errors of :class:`_Marked`."""
    return _Marked(recording).centres


def reconstruct_markers(
    recording: MarkerRecording, body: BodyModel | None, sex: str, mass: float | None
) -> Reconstruction:
    """Motion of our human that follows markers; see ``reconstruct``.

    Markers that are not where their names say are taken out or exchanged first
    (:mod:`manikin.recordings.reconstruction.cleaning`), a recording without any is followed as it is. Short
    gaps are filled; in longer ones a marker does not count. Frames at the ends that see less than half
    of the markers are left out. Segments without markers stay as in standing.
    """
    calm = without_jumps(recording, tuple(marker_set(recording).segments))
    found, filled = _followed(calm, body, sex, mass)
    cleaning = Cleaning(recording, calm, found.body, found.targets, found.q, found.first_frame)
    repairs: tuple[Repair, ...] = ()
    if cleaning.needed or calm is not recording:
        found, filled = _followed(cleaning.repaired(), body, sex, mass)
        repairs = cleaning.repairs(filled)
    return replace(found, repairs=repairs + gaps_of(recording, filled, found.joints))


def _followed(
    recording: MarkerRecording, body: BodyModel | None, sex: str, mass: float | None
) -> tuple[Reconstruction, MarkerRecording]:
    """A recording as it is, followed, and the same with its gaps filled."""
    marked, subject = _Marked(recording), recording.subject
    if body is None:
        body = human_of(marked.centres, sex, subject.mass if mass is None else mass, subject.stature)
    placed = _placed(marked, body)
    filled, seen = placed.positions, ~np.isnan(placed.positions[..., 0])
    enough = np.flatnonzero(seen.mean(axis=1) >= LEAST_SEEN)
    first, stop = int(enough[0]), int(enough[-1]) + 1
    if stop - first < 2:
        wrong = "sees half of its markers in one frame only"
        raise InputError(f"recording {recording.name!r} {wrong}; valid: in two at least")
    wanted = replace(placed, positions=filled[first:stop])
    q, residual = follow(body, wanted, _starts(body, marked)[first:stop], recording.rate)
    recorded = recording.chosen(placed.names).positions[first:stop]
    found = Reconstruction(
        body, np.arange(stop - first) / recording.rate, q, replace(placed, positions=recorded),
        np.where(np.isnan(recorded[..., 0]), np.nan, residual), first,
        tuple(name for name in recording.marker_names if name not in placed.names),
        tuple(s.name for s in body.segments if s.hinges and not _is_marked(body, s.name, {*placed.segments})),
    )  # fmt: skip
    return found, marked.recording


class _Marked:
    """Markers of a recording by role, the axes of the pelvis and the joint centres.

    InputError if the pelvis is not marked, or left and right are swapped.
    """

    def __init__(self, recording: MarkerRecording) -> None:
        where = f"recording {recording.name!r}"
        if not recording.seen.any():
            raise InputError(f"{where} sees no marker in any frame; valid: markers that are seen")
        self.recording = recording.with_gaps_filled()
        self.set: MarkerSet = marker_set(self.recording)
        self.marks = landmarks(self.recording, self.set)
        self.pelvis = pelvis_axes(self.marks, where)
        check_sides(self.marks, self.pelvis, where)
        self.centres = marker_centres(self.marks, self.pelvis, recording.subject, where)


def _placed(marked: _Marked, body: BodyModel) -> PointTargets:
    """The markers that can be followed, at their places on the body, in all frames."""
    recording = marked.recording
    wanted, pelvis = placing_targets(recording, marked.set, body, marked.marks, marked.centres, marked.pelvis)
    names = tuple(marked.set.segments)
    positions = recording.chosen(names).positions
    frames = _frames(np.isnan(wanted.positions[..., 0]), np.isnan(positions[..., 0]))
    kept = np.flatnonzero(~np.isnan(positions[frames][..., 0]).all(axis=0))
    names, positions = tuple(names[k] for k in kept), positions[:, kept]
    segments = tuple(marked.set.segments[name] for name in names)
    first, _ = seen_targets(wanted, frames)
    q, _ = follow(body, first, _starts(body, marked, pelvis)[frames])
    for number in range(ROUNDS + 1):
        points = _local(body, q, segments, positions[frames])
        placed = PointTargets(names, segments, points, positions, np.ones(len(names)))
        if number < ROUNDS:
            q = improved(body, replace(placed, positions=positions[frames]), q)
    return placed


def _frames(unknown: NDArray[np.bool_], unseen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Frames that see most targets and markers, spread evenly."""
    known = (~unknown).sum(axis=1) + (~unseen).sum(axis=1)
    good = np.flatnonzero((known >= COMPLETE * known.max()) & ~unknown.all(axis=1))
    return good[np.unique(np.linspace(0, len(good) - 1, min(PLACING_FRAMES, len(good))).astype(int))]


def seen_targets(targets: PointTargets, frames: NDArray[np.int64]) -> tuple[PointTargets, NDArray[np.int64]]:
    """Targets in some frames, without those that are not seen there, and (k,) which they are."""
    positions = targets.positions[frames]
    kept = np.flatnonzero(~np.isnan(positions[..., 0]).all(axis=0))
    return PointTargets(
        tuple(targets.names[k] for k in kept), tuple(targets.segments[k] for k in kept),
        targets.points[kept], positions[:, kept], targets.weights[kept],
    ), kept  # fmt: skip


def _local(body: BodyModel, q: FloatArray, segments: tuple[str, ...], places: FloatArray) -> FloatArray:
    """(k, 3) medians of places in the frames of their segments [m]."""
    placed = SegmentPlacements(body, segments).of(q)
    away = places.transpose(1, 2, 0) - placed.roots - placed.shifts
    return np.nanmedian(np.einsum("kjin,kjn->kin", placed.turns, away), axis=2)


def _starts(body: BodyModel, marked: _Marked, pelvis: FloatArray | None = None) -> FloatArray:
    """(n, nq) standing postures put where the pelvis is, or was last seen."""
    turns, hips = marked.pelvis if pelvis is None else pelvis, middle(marked.centres, "thigh")
    known = np.flatnonzero(~np.isnan(turns[:, 0, 0]) & ~np.isnan(hips[:, 0]))
    nearest = known[np.searchsorted(0.5 * (known[1:] + known[:-1]), np.arange(len(turns)))]
    q = np.tile(body.standing_posture(), (len(turns), 1))
    q[:, :3] = hips[nearest]
    q[:, 3:7] = Rotation.from_matrix(turns[nearest]).as_quat()
    return q


def _is_marked(body: BodyModel, segment: str, marked: set[str]) -> bool:
    """Whether a segment, or one that it carries, has a marker."""
    children = [one.name for one in body.segments if one.parent == segment]
    return segment in marked or any(_is_marked(body, child, marked) for child in children)
