"""Touch-downs and lift-offs of laboratories that had no part in the choice of what finds them.

`python benchmarks/leave_one_laboratory_out.py FOLDER` finds the supports of every walk below FOLDER that has
force plates, with several shares of the highest speed of a swing below which a foot has touched down and
above which it has lifted off. For each laboratory the shares are taken that have the least mean error in the
walks of all others. Runs, jumps and treadmills are left out. A folder is a laboratory, in `c3dorg` a file.
"""

import sys
from collections import defaultdict
from itertools import product
from pathlib import Path

import numpy as np

from manikin.errors import ManikinError
from manikin.recordings import MarkerRecording, Reconstruction, read_recording, reconstruct, supports_of
from manikin.recordings import timing_errors as errors_of
from manikin.recordings.supports import support_levels
from manikin.recordings.supports.treadmill import belt_velocity

TOUCH, LIFT = (0.06, 0.08, 0.10, 0.12), (0.12, 0.16, 0.20, 0.24)
LARGEST = 0.25
"""Larger errors are those of another step than the plate's [s]."""


def laboratory(path: Path) -> str:
    """Whose recording it is; the samples of `c3dorg` are of one laboratory each."""
    return str(path) if path.parent.name == "c3dorg" else str(path.parent)


def walks(folder: Path) -> dict[Path, tuple[MarkerRecording, Reconstruction]]:
    """Reconstructed walks over the ground with plates."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".c3d", ".trc")):
        try:
            recording = read_recording(path)
            if isinstance(recording, MarkerRecording) and recording.plates:
                person = reconstruct(recording)
                flights = [p for p in supports_of(person, start=recording.start).phases if not p.effectors]
                if belt_velocity(person) is None and max((p.duration for p in flights), default=0.0) < 0.03:
                    found[path] = recording, person
        except ManikinError:
            continue
    return found


def main() -> None:
    """Command line."""
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        raise SystemExit(__doc__)
    known = walks(Path(sys.argv[1]))
    errors: dict[tuple[float, float], dict[Path, np.ndarray]] = defaultdict(dict)
    for shares in product(TOUCH, LIFT):
        support_levels.TOUCH_SHARE, support_levels.LIFT_SHARE = shares
        for path, (recording, person) in known.items():
            supports = supports_of(person, start=recording.start)
            late = np.array([one.error for one in errors_of(supports, recording.plates)])
            if np.any(np.abs(late) < LARGEST):
                errors[shares][path] = late[np.abs(late) < LARGEST]

    def mean(shares: tuple[float, float], without: str) -> float:
        """Mean error in the other laboratories' walks, each counted alike."""
        others = [late for path, late in errors[shares].items() if laboratory(path) != without]
        return float(np.mean([np.abs(late).mean() for late in others]))

    left, chosen = [], defaultdict(int)
    for path in known:
        shares = min(errors, key=lambda one: mean(one, laboratory(path)))
        chosen[shares] += 1
        if path in errors[shares]:
            left.append(errors[shares][path])
    medians, every = np.array([np.median(np.abs(late)) for late in left]), np.abs(np.concatenate(left))
    print(f"shares chosen: {dict(chosen)}")
    several = len({laboratory(path) for path in known})
    print(f"{len(left)} walks of {several} laboratories, {len(every)} events")
    print(f"events: median {1e3 * np.median(every):.1f} ms, 90 % {1e3 * np.quantile(every, 0.9):.1f} ms")
    print(f"walks: median {1e3 * np.median(medians):.1f} ms, at most 20 ms in {np.sum(medians <= 0.02)}")


if __name__ == "__main__":
    main()
