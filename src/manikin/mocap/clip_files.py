"""Many recordings from files, each made a clip; one that cannot be used takes no other with it."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from manikin.body import BodyModel
from manikin.errors import InputError, ManikinError
from manikin.mocap.markers import MarkerRecording
from manikin.mocap.read import READERS, read_recording
from manikin.mocap.reconstruct import person_of, reconstruct
from manikin.mocap.recorded_clip import RecordedClip, clip_of
from manikin.mocap.recording import Recording

READ = 0.1
"""Share of the work that is done when all files are read."""


@dataclass(frozen=True)
class GroupedFile:
    """A recording and what it is compared with.

    Attributes:
        path: The file.
        group: Name of its group.
    """

    path: Path
    group: str


@dataclass(frozen=True, eq=False)
class ClipFiles:
    """What became of some files.

    Attributes:
        clips: Those that could be used, in the order of the files.
        refused: Why the others could not, in one line, by file.
    """

    clips: tuple[RecordedClip, ...]
    refused: Mapping[Path, str]


def grouped_files(words: Iterable[str]) -> tuple[GroupedFile, ...]:
    """Files of words such as ``walk.bvh``, ``duck=clips/127_3*.amc`` or ``clips``.

    Each is a file, a folder (all recordings directly in it) or a pattern; before ``=`` may stand the group,
    which else is the name of the file's folder.

    Raises:
        InputError: If a folder or pattern has no recording.
    """
    found = []
    for word in words:
        group, _, place = word.rpartition("=") if not Path(word).exists() else ("", "", word)
        path = Path(place)
        if path.is_dir():
            files = [file for file in path.iterdir() if file.suffix.lower() in READERS]
        elif any(sign in place for sign in "*?["):
            base = Path(path.anchor)
            files = list(base.glob(str(path.relative_to(base))))
        else:
            files = [path]
        if not files:
            raise InputError(f"{place}: no recording there; valid: {', '.join(READERS)} files")
        found += [GroupedFile(file, group or file.resolve().parent.name) for file in sorted(files)]
    return tuple(found)


def read_clips(
    files: Sequence[GroupedFile],
    *,
    sex: str = "male",
    report: Callable[[float, str], None] | None = None,
) -> ClipFiles:
    """Read and reconstruct recordings.

    Recordings of the same skeleton are taken as of one person, whose lengths come from all of them.

    Args:
        files: Of any format that is known.
        sex: Table of segment masses.
        report: Told the share that is done and the file at work.
    """
    tell = report or _silent
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
            told = str(error)
            refused[file.path] = told if file.path.name in told else f"{file.path}: {told}"
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
                continue  # told of each recording by itself
            bodies |= dict.fromkeys(numbers, body)
    return bodies


def _names(files: Sequence[GroupedFile]) -> list[str]:
    """Names of the files without what they have in common, each once."""
    stems = Counter(file.path.stem for file in files)
    names = [
        file.path.stem if stems[file.path.stem] == 1 else f"{file.path.parent.name}/{file.path.name}"
        for file in files
    ]
    again = Counter(names)
    return [name if again[name] == 1 else f"{name} ({number})" for number, name in enumerate(names, start=1)]


def _silent(_share: float, _remark: str) -> None:
    """Take a report and do nothing."""
