"""Measure the trials of the walls scenario for the documentation: writes ``walls.json`` beside this file.

Run ``python docs/walls.py`` (a few minutes), then ``python docs/generate.py``.
"""

import json
import tempfile
from pathlib import Path
from typing import Any

import yaml

from manikin.planning.com import plan_com
from manikin.scenarios import Scenario, load_scenario

HERE = Path(__file__).parent
TRIALS = tuple(f"trial-{number}" for number in range(1, 6))
SPACINGS = (0.0, 0.4, 0.6)
"""Distances along y between the front and the hind pair [m]."""
PUBLISHED_DURATION = 5.29
"""Trial 4 of Table 5.1 [s]."""


def measure(scenario: Scenario) -> dict[str, Any]:
    """Margin [N], duration [s] and wall time [s] of one plan, or why there is none."""
    result = plan_com(scenario.build_centroidal_problem())
    trajectory = result.trajectory
    return {
        "margin_N": None if trajectory is None or result.d_min is None else round(result.d_min, 2),
        "duration_s": None if trajectory is None else round(trajectory.duration, 3),
        "wall_s": round(result.wall_time, 1),
        "failure": None if result.failure is None else result.failure.reason,
    }


def spaced(spacing: float) -> Scenario:
    """Trial 4 within its published duration, with the pairs ``spacing`` apart along y [m]."""
    limit = [f"planning.max_duration_s={PUBLISHED_DURATION}"]
    data = yaml.safe_load(load_scenario("walls", "trial-4", limit).to_yaml())
    for phase in data["supports"]["phases"]:
        for name, contact in phase.items():
            if isinstance(contact, dict):
                contact["position"][1] = spacing / 2 if "front" in name else -spacing / 2
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spaced.yaml"
        path.write_text(yaml.safe_dump(data))
        return load_scenario(path)


def main() -> None:
    """Measure everything and write it down."""
    found: dict[str, Any] = {"trials": {}, "spacings": {}}
    for name in TRIALS:
        found["trials"][name] = measure(load_scenario("walls", name))
    found["one_polynomial"] = measure(load_scenario("walls", "one-polynomial"))
    for spacing in SPACINGS:
        found["spacings"][f"{spacing:g}"] = measure(spaced(spacing))
        (HERE / "walls.json").write_text(json.dumps(found, indent=2) + "\n")  # a long job keeps what it has


if __name__ == "__main__":
    main()
