"""Whether a change leaves motions as they were, bit for bit: ten scenarios, one process each.

    python benchmarks/bit_test.py [NAME ...] [--source SRC] [--jobs N] > before.txt

Every line is a scenario, a dataset of its motion file and the start of its SHA-256; compare two of them by
``diff``.
"""

import argparse
import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py

SCENARIOS = (
    "platform",
    "stairs",
    "crouch",
    "stand-up-chair",
    "beam-H2C2",
    "climb",
    "walk",
    "push-back-500",
    "car-ingress",
    "crouch@refined",
)
GROUPS = ("planned", "executed", "recorded")


def lines(name: str, source: Path | None) -> list[str]:
    """Run one scenario and digest its motions."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    if source is not None:
        environment["PYTHONPATH"] = str(source)
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "manikin", "run", name, "--out", folder, "--no-figures"]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        found = [f"{name} exit {done.returncode}"]
        file = Path(folder) / "motion.h5"
        if not file.exists():
            return [*found, f"{name} no motion: {done.stderr.strip().splitlines()[-1:]}"]
        with h5py.File(file) as content:
            for group in GROUPS:
                for key, data in sorted(content.get(group, {}).items()):
                    if isinstance(data, h5py.Dataset):
                        value = data[()]
                        bits = value.tobytes() if hasattr(value, "tobytes") else bytes(value)
                        shape = getattr(value, "shape", ())
                        found.append(f"{name} {group}/{key} {shape} {hashlib.sha256(bits).hexdigest()[:16]}")
        return found


def main() -> None:
    """Print the digests in the order of the names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=SCENARIOS)
    parser.add_argument("--source", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    with ThreadPoolExecutor(options.jobs) as pool:
        for found in pool.map(lambda name: lines(name, options.source), options.names):
            print("\n".join(found), flush=True)


if __name__ == "__main__":
    main()
