"""Walks to random goals among boxes, executed in the physics engine.

``python benchmarks/walks_among_boxes.py 30-39`` makes three walks for each seed; ``--plan`` plans them only,
``--out FOLDER`` keeps the run directories. Goals are 1.5 to 4 m away in any direction and face anywhere; two
to four boxes stand beside and on the straight way, 0.45 m at least from both ends. There is a line for each
walk, and the number of those that kept all requirements.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from manikin.errors import ManikinError
from manikin.pipeline.runner import run
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate
from manikin.walking import WalkObstacle

GOALS = 3
"""Walks of each seed."""
FREE = 0.45
"""Least distance of the boxes from start and goal [m]."""


def scene(seed: int, number: int) -> dict[str, Any]:
    """Scenario of a walk of a seed."""
    rng = np.random.default_rng([seed, number])
    distance, direction, heading = rng.uniform(1.5, 4.0), *rng.uniform(-np.pi, np.pi, 2)
    along = np.array([np.cos(direction), np.sin(direction)])
    goal, boxes = distance * along, list[dict[str, Any]]()
    count = int(rng.integers(2, 5))
    while len(boxes) < count:
        share, beside = rng.uniform(0.1, 0.9), rng.uniform(-0.8, 0.8)
        size, yaw = [*rng.uniform(0.2, 0.8, 2), rng.uniform(0.1, 1.8)], rng.uniform(-90.0, 90.0)
        place = share * goal + beside * np.array([-along[1], along[0]])
        if apart(place, size, np.radians(yaw), np.array([[0.0, 0.0], goal])) >= FREE:
            boxes.append({
                "name": f"box {len(boxes) + 1}", "box": [round(side, 3) for side in size],
                "position": [*np.round(place, 3).tolist(), round(0.5 * round(size[2], 3), 4)],
                "rpy_deg": [0.0, 0.0, round(yaw, 1)],
            })  # fmt: skip
    ends = {
        "start": {"at": [0.0, 0.0], "heading_deg": 0.0},
        "goal": {"at": np.round(goal, 3).tolist(), "heading_deg": round(np.degrees(heading), 1)},
    }
    name = f"among-boxes-{seed}-{number}"
    return {"name": name, "scene": boxes, "walking": {"max_speed_m_s": 1.4}, "task": ends}


def apart(place: np.ndarray, size: list[float], yaw: float, points: np.ndarray) -> float:
    """Least distance of points (n, 2) from a box seen from above [m]."""
    half, turn = 0.5 * np.array(size[:2]), np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = place + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ turn.T
    return float(WalkObstacle("box", corners).distance(points[:, None], np.zeros(len(points))).min())


def walked(seed: int, number: int, *, plan: bool, folder: Path | None) -> tuple[bool, str]:
    """Whether a walk kept all requirements, and what was measured."""
    data = scene(seed, number) | ({"execution": "none"} if plan else {})
    name, began = data["name"], time.process_time()
    job = Scenario(validate(ScenarioFile, data, "benchmark"), "benchmark", Path(), {})
    try:
        result = run(job, out=None if folder is None else folder / name)
    except ManikinError as error:
        return False, f"{name}: refused: {error}"
    spent, summary = time.process_time() - began, result.summary
    walk, failure = summary["walk"], summary["failure"]
    parts = [f"{name}: {len(data['scene'])} boxes, {spent:.0f} s"]
    if "motion_s" in walk:
        parts.append(f"{walk['path_length_m']:.2f} m in {walk['motion_s']:.1f} s")
        parts.append(f"clearance {1e3 * walk['min_clearance_m']:.0f} mm")
    if (execution := result.execution) is not None:
        parts.append(f"margin {100.0 * float(np.mean(execution.motion.margin > 0.0)):.1f} %")
        measures = {"slide": "max_slip_m", "deep": "max_penetration_m", "off": "max_foot_error_m"}
        parts += [f"{word} {1e3 * getattr(execution, key):.1f} mm" for word, key in measures.items()]
    if failure is not None:
        where = f"{failure['where']}, {failure['time_s'] or 0.0:.2f} s"
        parts.append(f"{failure['stage']}: {failure['reason']} ({where})")
    return failure is None, ", ".join(parts)


def main() -> None:
    """Walk, and tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", help="first and last seed, such as 30-39")
    parser.add_argument("--plan", action="store_true", help="plan only")
    parser.add_argument("--out", type=Path, help="folder for the run directories")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    outcomes = []
    for number in range(GOALS):
        for seed in range(int(first), int(last or first) + 1):
            outcomes.append(walked(seed, number, plan=options.plan, folder=options.out))
            print("ok  " if outcomes[-1][0] else "FAIL", outcomes[-1][1], flush=True)
    print(f"{sum(good for good, _ in outcomes)} of {len(outcomes)} walks kept all requirements")


if __name__ == "__main__":
    main()
