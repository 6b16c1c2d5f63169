"""Touch-downs and lift-offs of laboratories that had no part in the choice of what finds them.

`python benchmarks/leave_one_laboratory_out.py FOLDER` finds the supports of every walk below FOLDER that has
force plates, with several shares of the highest speed of a swing below which a foot has touched down and
above which it has lifted off. For each laboratory the shares are taken that have the least mean error in the
walks of all others. Compared are the events that all shares find within a quarter of a second of the plate's;
how many others there are is printed. Runs, jumps and treadmills are left out, and copies of a walk in another
file format. A folder is a laboratory, wherever it is, and in `c3dorg` a file.
"""

import sys
from collections import Counter, defaultdict
from itertools import product
from pathlib import Path

import numpy as np

from manikin.errors import ManikinError
from manikin.recordings import (
    ForcePlate,
    MarkerRecording,
    Reconstruction,
    RecordedSupports,
    read_recording,
    reconstruct,
    recorded_schedule,
    supports_of,
    timing_errors,
    without_offsets,
)
from manikin.recordings.reconstruction.marker_reconstruction import sides_exchanged
from manikin.recordings.supports import support_levels
from manikin.recordings.supports.treadmill import belt_velocity

TOUCH, LIFT = (0.06, 0.08, 0.10, 0.12), (0.12, 0.16, 0.20, 0.24)
COPIES = ("sample_10_TYPE-2a", "sample_10_TYPE-4a", "sample_28_type1")
"""Walks of `sample_06_newwalk` and `sample_28_dynamic` in other formats."""
SAME = {"opensim_core": "opensim"}
"""Folders of the laboratory of another one."""
LARGEST, LONGEST_FLIGHT = 0.25, 0.03
"""Larger errors are those of another step than the plate's; longer flights those of runs and jumps [s]."""

Walk = tuple[Reconstruction, float, tuple[ForcePlate, ...]]
"""A person, the instant at which the recording begins, and the plates."""


def laboratory(path: Path) -> str:
    """Whose recording it is; the samples of `c3dorg` are of one laboratory each."""
    name = path.parent.name
    return path.stem if name == "c3dorg" else SAME.get(name, name)


def walks(folder: Path) -> dict[Path, Walk]:
    """Walks over the ground with plates."""
    found: dict[Path, Walk] = {}
    refused = 0
    for path in sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".c3d", ".trc")):
        try:
            recording = read_recording(path)
            if not isinstance(recording, MarkerRecording) or not recording.plates or path.stem in COPIES:
                continue
            person = reconstruct(sides_exchanged(recording))
            supports = supports_of(person, start=recording.start)
            if belt_velocity(person) is None and longest_flight(supports) < LONGEST_FLIGHT:
                plates, _ = without_offsets(recording.plates, recorded_schedule(person, supports))
                found[path] = person, recording.start, plates
        except ManikinError:
            refused += 1
    print(f"{refused} recordings are refused")
    return found


def longest_flight(supports: RecordedSupports) -> float:
    """Longest time without any support [s]."""
    return max((phase.duration for phase in supports.phases if not phase.effectors), default=0.0)


def main() -> None:
    """Command line."""
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        raise SystemExit(__doc__)
    known = walks(Path(sys.argv[1]))
    events: dict[Path, dict[tuple[float, float], dict[tuple[str, str, float], float]]] = defaultdict(dict)
    for shares in product(TOUCH, LIFT):
        support_levels.TOUCH_SHARE, support_levels.LIFT_SHARE = shares
        for path, (person, start, plates) in known.items():
            late = timing_errors(supports_of(person, start=start), plates)
            events[path][shares] = {(one.plate, one.event, one.time): one.error for one in late}
    errors: dict[Path, dict[tuple[float, float], np.ndarray]] = {}
    others = 0
    for path, by_shares in events.items():
        near = [{key for key, late in one.items() if abs(late) < LARGEST} for one in by_shares.values()]
        common = sorted(set.intersection(*near))
        others += len(set.union(*(set(one) for one in by_shares.values()))) - len(common)
        if common:
            errors[path] = {shares: np.abs([one[key] for key in common]) for shares, one in by_shares.items()}

    def mean(shares: tuple[float, float], without: str) -> float:
        """Mean error in the other laboratories' walks, each counted alike."""
        return float(np.mean([
            one[shares].mean() for path, one in errors.items() if laboratory(path) != without
        ]))  # fmt: skip

    chosen = {
        path: min(product(TOUCH, LIFT), key=lambda one, path=path: mean(one, laboratory(path)))
        for path in errors
    }
    left = [errors[path][shares] for path, shares in chosen.items()]
    every, medians = np.concatenate(left), np.array([np.median(one) for one in left])
    several = len({laboratory(path) for path in errors})
    print(f"shares chosen, by walks: {dict(Counter(chosen.values()))}")
    print(
        f"{len(left)} walks of {several} laboratories, {len(every)} events; {others} events are not compared"
    )
    print(f"events: median {1e3 * np.median(every):.1f} ms, 90 % {1e3 * np.quantile(every, 0.9):.1f} ms")
    print(f"walks: median {1e3 * np.median(medians):.1f} ms, at most 20 ms in {np.sum(medians <= 0.02)}")


if __name__ == "__main__":
    main()
