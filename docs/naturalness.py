"""Learn the postures of recorded people: writes ``human_postures.npz`` of the package.

Run ``python docs/naturalness.py FOLDER``, where FOLDER has ``clips_locomotion.csv`` and
``clips_cluttered.csv`` and, in ``mocap``, recordings of the CMU Graphics Lab and of the ACCAD Open Motion
Project. Runs are left out. The limit is the distance within which 95 % of the postures of recordings are of
which none was used, a fifth of all recordings in turn; each recording counts alike.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from acknowledgements import THANKS
from scipy.cluster.vq import kmeans2
from scipy.spatial import cKDTree

from manikin.motion.naturalness import FILE, PARTS, mirrored, part_directions
from manikin.numerics.spatial import FloatArray
from manikin.recordings import read_recording, reconstruct
from manikin.runtime.files import atomic_path

GROUPS, FOLDS, RATE = 500, 5, 10.0
"""Groups of postures, groups of recordings that are left out in turn, and postures taken [Hz]."""


def clips(folder: Path) -> dict[str, tuple[int, int | None]]:
    """Files without runs, each with its first frame and the one after its last."""
    found: dict[str, tuple[int, int | None]] = {}
    for row in csv.DictReader((folder / "clips_locomotion.csv").open()):
        if not row["class"].startswith("run"):
            found[row["file"]] = int(row["first_frame0"]), int(row["end_frame0"])
    for row in csv.DictReader((folder / "clips_cluttered.csv").open()):
        if not row["description"].startswith("run"):
            found[row["file"]] = 0, None
    return found


def learnt(postures: dict[str, FloatArray], groups: int, rng: np.random.Generator) -> FloatArray:
    """Middles of groups of the postures of some recordings and of their mirror images."""
    known = np.concatenate([rows for one in postures.values() for rows in (one, mirrored(one))])
    middles, _ = kmeans2(known, 2 * groups, minit="points", seed=rng)
    return middles[np.isfinite(middles).all(axis=1)]


def main(folder: Path) -> None:
    """Write the file and print the distances of recordings left out."""
    postures: dict[str, FloatArray] = {}
    for name, (first, stop) in sorted(clips(folder).items()):
        found = reconstruct(read_recording(folder / "mocap" / name))
        q = found.q[first:stop][:: max(1, round(found.rate / RATE))]
        postures[name] = part_directions(found.body, q).reshape(len(q), -1)
    rng, away = np.random.default_rng(0), dict[str, FloatArray]()
    names = [list(postures)[k] for k in rng.permutation(len(postures))]
    for fold in range(FOLDS):
        out = names[fold::FOLDS]
        tree = cKDTree(
            learnt({name: rows for name, rows in postures.items() if name not in out}, GROUPS, rng)
        )
        away |= {name: tree.query(postures[name])[0] / np.sqrt(len(PARTS)) for name in out}
    weights = np.concatenate([np.full(len(away[name]), 1.0 / len(away[name])) for name in names])
    distances = np.concatenate([away[name] for name in names])
    order = np.argsort(distances)
    limit = float(distances[order][np.searchsorted(np.cumsum(weights[order]), 0.95 * weights.sum())])
    middles = learnt(postures, GROUPS, rng)
    with atomic_path(FILE) as path, path.open("wb") as file:
        np.savez_compressed(file, middles=middles.astype(np.float16), limit=limit, acknowledgement=THANKS)
    print(f"{len(postures)} recordings, {len(distances)} postures, {len(middles)} middles")
    print(f"limit {limit:.3f} rad; recordings left out: median {np.median(distances):.3f} rad")
    for name in sorted(names, key=lambda name: float(np.mean(away[name] <= limit)))[:12]:
        print(f"{name:48} {np.mean(away[name] <= limit):.2f} natural")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
