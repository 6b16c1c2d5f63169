"""Make the shipped places of one foot relative to the other, of a man and a woman of 1.75 m.

`python docs/step_reach.py` writes ``src/manikin/kinematics/step_reach.npz``; a minute.
"""

import sys
from pathlib import Path

import numpy as np

from manikin.body import human
from manikin.kinematics.step_reach import FILE, SHIPPED, STATURE, StepReach

ROUNDS = 300
"""Rounds of sampling outwards."""


def main(path: Path) -> None:
    """Write the table."""
    table: dict[str, np.ndarray] = {}
    for sex in ("male", "female"):
        body = human(STATURE, 22.0 * STATURE**2, sex)
        for heels, rest in SHIPPED:
            reach = StepReach.sampled(body, heels, rest, rounds=ROUNDS)
            table[f"{sex}/{heels}/{rest}/A"] = reach.A.astype(np.float32)
            table[f"{sex}/{heels}/{rest}/b"] = reach.b.astype(np.float32)
    np.savez_compressed(path, allow_pickle=False, **table)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
