"""Clips: the supports, centre of mass and highest points of recorded motions, for statistics."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.segments import Shape, ShapeKind
from manikin.errors import InputError, ManikinError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.recordings.dynamics.recorded_dynamics import smoothed
from manikin.recordings.readers import READERS, read_recording
from manikin.recordings.readers.markers import MarkerRecording
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.reconstruction.reconstruct import person_of, reconstruct
from manikin.recordings.statistics.phases import PhaseSequence
from manikin.recordings.supports.body_supports import RecordedSupports
from manikin.recordings.supports.supports import supports_of

PARTS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"head": ("head", "neck"), "trunk": ("pelvis", "lumbar", "thorax")}
)
"""Parts of a person that pass under something, and their segments."""


@dataclass(frozen=True, eq=False)
class RecordedClip:
    """One recorded motion, on one clock.

    Attributes:
        group: What it is compared with: a person, a condition.
        time: (n,) instants, rising [s].
        com: (n, 3) centre of mass in the world [m].
        tops: (n, 3) highest point of each part of the body, by its name [m]; may be empty.
        standing_com: Height of the centre of mass in standing [m]; None if it is not known.
    """

    name: str
    group: str
    supports: RecordedSupports
    time: FloatArray
    com: FloatArray
    tops: Mapping[str, FloatArray]
    standing_com: float | None = None

    def __post_init__(self) -> None:
        where, n = f"clip {self.name!r}", len(self.time)
        object.__setattr__(self, "time", frozen_array(self.time, f"{where} time", (n,)))
        if not n or np.any(np.diff(self.time) <= 0.0):
            raise InputError(f"{where} has {n} instants that do not rise; valid: at least one, rising")
        object.__setattr__(self, "com", frozen_array(self.com, f"{where} com", (n, 3)))
        tops = {k: frozen_array(top, f"{where} top of {k!r}", (n, 3)) for k, top in self.tops.items()}
        object.__setattr__(self, "tops", MappingProxyType(tops))

    @property
    def floor(self) -> float:
        """Height of the lowest surface found; that of the world's origin if none was [m]."""
        return self.supports.surfaces[0] if self.supports.surfaces else 0.0

    @property
    def phases(self) -> PhaseSequence:
        """Phases of all supports; the recording cuts the first and the last."""
        return PhaseSequence(self.name, self.group, self.supports.phases)


def clip_of(found: Reconstruction, name: str, group: str, *, start: float = 0.0) -> RecordedClip:
    """Clip of a reconstructed recording, not yet smoothed, of at least four instants at an even rate.

    ``start`` is what the first frame of the recording is on its clock [s].
    """
    known, still = supports_of(found, start=start), smoothed(found)
    com, tops = com_and_tops(still.body, still.q)
    standing, _ = com_and_tops(still.body, still.body.standing_posture()[None])
    time = known.start + still.time - still.time[0]
    return RecordedClip(name, group, known, time, com, tops, float(standing[0, 2]))


def com_and_tops(
    body: BodyModel, postures: FloatArray, parts: Mapping[str, Sequence[str]] = PARTS
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """(n, 3) centres of mass in postures (n, nq), and (n, 3) highest points by part [m].

    Parts, of the segments given for each, are left out if the body has no segment of them.
    """
    model, data = body.pinocchio, body.pinocchio.createData()
    have = {segment.name: segment for segment in body.segments}
    shapes = {
        part: [(body.segment_frame(one), shape) for one in names if one in have for shape in have[one].shapes]
        for part, names in parts.items()
    }
    com = np.empty((len(postures), 3))
    tops = {part: np.empty((len(postures), 3)) for part, known in shapes.items() if known}
    for number, q in enumerate(postures):
        com[number] = pin.centerOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        for part, top in tops.items():
            each = [_top(shape, data.oMf[frame]) for frame, shape in shapes[part]]
            top[number] = max(each, key=lambda point: point[2])
    return com, tops


def _top(shape: Shape, place: pin.SE3) -> FloatArray:
    """(3,) highest point of a shape of a segment [m]."""
    turn, centre = place.rotation @ shape.rotation, place.act(np.array(shape.translation))
    if shape.kind == ShapeKind.BOX:
        return centre + turn @ (np.where(turn[2] < 0.0, -0.5, 0.5) * shape.size)
    up = np.array([0.0, 0.0, float(shape.size[0])])
    if shape.kind == ShapeKind.SPHERE:
        return centre + up
    return centre + up + turn[:, 2] * np.copysign(0.5 * float(shape.size[1]), turn[2, 2])


READ = 0.1
"""Share of the work that is done when all files are read."""


@dataclass(frozen=True)
class GroupedFile:
    """A recording and the name of the group with which it is compared."""

    path: Path
    group: str


@dataclass(frozen=True, eq=False)
class ClipFiles:
    """Clips in the order of their files, and why the others could not be used, in one line by file."""

    clips: tuple[RecordedClip, ...]
    refused: Mapping[Path, str]


def grouped_files(words: Iterable[str]) -> tuple[GroupedFile, ...]:
    """Files of words such as ``walk.bvh``, ``duck=clips/127_3*.amc`` or ``clips``.

    Each is a file, a folder (all recordings directly in it) or a pattern, after its group and ``=``; without
    them the group is the name of the file's folder. InputError if a folder or pattern has no recording.
    """
    found = []
    for word in words:
        group, _, place = word.rpartition("=") if not Path(word).exists() else ("", "", word)
        path, files = Path(place), [Path(place)]
        if path.is_dir():
            files = [file for file in path.iterdir() if file.suffix.lower() in READERS]
        elif any(sign in place for sign in "*?["):
            files = list(Path(path.anchor).glob(str(path.relative_to(path.anchor))))
        if not files:
            raise InputError(f"{place}: no recording there; valid: {', '.join(READERS)} files")
        found += [GroupedFile(file, group or file.resolve().parent.name) for file in sorted(files)]
    return tuple(found)


def read_clips(
    files: Sequence[GroupedFile], *, sex: str = "male", report: Callable[[float, str], None] | None = None
) -> ClipFiles:
    """Read and reconstruct recordings, those of one skeleton with the lengths that come from all of them.

    ``sex`` is the table of segment masses; ``report`` is told the share that is done and the file at work.
    """
    tell = report or (lambda _share, _remark: None)
    recordings: dict[int, Recording | MarkerRecording] = {}
    refused: dict[Path, str] = {}
    for number, file in enumerate(files):
        tell(READ * number / len(files), file.path.name)
        try:
            recordings[number] = read_recording(file.path)
        except ManikinError as error:
            refused[file.path] = str(error)
    bodies, names = _bodies(recordings, sex), _names(files)
    clips = []
    for done, (number, recording) in enumerate(recordings.items()):
        file = files[number]
        tell(READ + (1.0 - READ) * done / len(recordings), file.path.name)
        try:
            found = reconstruct(recording, bodies.get(number), sex=sex)
            start = recording.start if isinstance(recording, MarkerRecording) else 0.0
            clips.append(clip_of(found, names[number], file.group, start=start))
        except ManikinError as error:
            text = str(error)
            refused[file.path] = text if file.path.name in text else f"{file.path}: {text}"
    tell(1.0, f"{len(clips)} of {len(files)} files")
    return ClipFiles(tuple(clips), refused)


def _bodies(recordings: Mapping[int, Recording | MarkerRecording], sex: str) -> dict[int, BodyModel]:
    """A body for all recordings of one skeleton; none where it is recorded once, or its lengths are odd."""
    people: dict[tuple[tuple[str, ...], bytes], list[int]] = {}
    for number, recording in recordings.items():
        if isinstance(recording, Recording):
            people.setdefault((recording.joint_names, recording.offsets.tobytes()), []).append(number)
    bodies: dict[int, BodyModel] = {}
    for numbers in people.values():
        if len(numbers) > 1:
            try:
                body = person_of([recordings[number] for number in numbers], sex=sex)
            except ManikinError:
                continue  # reported for each recording by itself
            bodies |= dict.fromkeys(numbers, body)
    return bodies


def _names(files: Sequence[GroupedFile]) -> list[str]:
    """Names of the files without what they have in common, each once."""
    paths = [file.path for file in files]
    stems = Counter(path.stem for path in paths)
    names = [path.stem if stems[path.stem] == 1 else f"{path.parent.name}/{path.name}" for path in paths]
    again = Counter(names)
    return [name if again[name] == 1 else f"{name} ({number})" for number, name in enumerate(names, start=1)]
