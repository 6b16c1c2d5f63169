"""Random chairs and bodies that leave them: `python benchmarks/sweep_seats.py --seeds 0:10`.

Each seed draws a body (stature 1.50 to 1.95 m, body mass index 19 to 32, either sex), a chair (seat 0.38 to
0.52 m high, hard or padded, open or closed below, armrests or none) and a place and heading for both.  The
stage says how far a draw is taken; `contacts` needs a second or two, `run` also executes the motion.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from manikin.pipeline.runner import run
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning.com import plan_com
from manikin.planning.contacts import certify_plan
from manikin.scenarios import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate


def drawn(seed: int) -> dict[str, Any]:
    """Scenario of one seed, in plain values."""
    rng = np.random.default_rng([seed, 2121])
    sex = str(rng.choice(["male", "female"]))
    low, high = (1.60, 1.95) if sex == "male" else (1.50, 1.80)
    stature, index = float(rng.uniform(low, high)), float(rng.uniform(19.0, 32.0))
    seat, deep, wide = float(rng.uniform(0.38, 0.52)), float(rng.uniform(0.38, 0.48)), 0.48
    padded, closed, arms, back = (bool(rng.random() < share) for share in (0.5, 0.3, 0.5, 0.8))
    gap = float(rng.uniform(0.0, 0.12))
    at, yaw = rng.uniform(-5.0, 5.0, 2), float(rng.uniform(-180.0, 180.0))
    if seed % 2 == 0:
        at, yaw = np.zeros(2), 0.0
    turn = np.array([[np.cos(np.radians(yaw)), -np.sin(np.radians(yaw))],
                     [np.sin(np.radians(yaw)), np.cos(np.radians(yaw))]])  # fmt: skip

    def box(name: str, size: tuple[float, ...], x: float, y: float, z: float, **more: Any) -> dict[str, Any]:
        place = at + turn @ [x, y]
        return {"name": name, "box": list(size), "position": [*place.tolist(), z], "rpy_deg": [0, 0, yaw],
                **more}  # fmt: skip

    # The middle of the buttocks is a share of the stature and a gap before the backrest.
    rear = -(0.075 * stature + gap)
    thick = seat if closed else 0.06
    scene = [box("seat", (deep, wide, thick), rear + 0.5 * deep, 0.0, seat - 0.5 * thick, padded=padded)]
    if back:
        scene.append(box("back", (0.04, wide, 0.45), rear - 0.02, 0.0, seat + 0.3, padded=padded))
    if arms:
        for side, sign in (("left", 1.0), ("right", -1.0)):
            y = sign * (0.5 * wide + 0.03)
            scene.append(box(f"{side}_armrest", (0.32, 0.05, 0.04), rear + 0.2, y, seat + 0.21))
    goal = at + turn @ [0.3, 0.0]
    return {
        "name": f"chair-{seed}", "manner": "close", "seed": 0,
        "body": {"model": "human", "stature_m": stature, "mass_kg": index * stature**2, "sex": sex},
        "scene": scene,
        "task": {"start": {"at": at.tolist(), "heading_deg": yaw, "posture": "seated"},
                 "goal": {"at": goal.tolist(), "heading_deg": yaw}},
    }  # fmt: skip


def taken(data: dict[str, Any], stage: str, out: Path) -> dict[str, Any]:
    """What became of a scenario up to a stage."""
    scenario = Scenario(validate(ScenarioFile, data, data["name"]), data["name"], Path(), {})
    began = time.process_time()
    if stage == "run":
        result = run(scenario, out=out / data["name"])
        failure = result.summary.get("failure")
        return {"ok": bool(result.summary["succeeded"]), "why": failure, "s": time.process_time() - began}
    framed = scenario.in_task_frame()
    body, scene = framed.build_body(), framed.build_scene()
    found = find_supports(framed, body, scene, np.random.default_rng(framed.seed))
    seconds = time.process_time() - began
    if found.plan is None or found.scenario is None:
        return {"ok": False, "why": f"{found.where}: {found.failure}", "s": seconds}
    certificate = certify_plan(body, scene, found.plan)
    row: dict[str, Any] = {"ok": certificate.held, "why": str(certificate.first_broken or ""), "s": seconds}
    row["used"] = sorted(set().union(*(stage.contacts for stage in found.plan.stages)))
    if stage == "com" and row["ok"]:
        result = plan_com(found.scenario.build_centroidal_problem())
        row |= {"ok": result.succeeded, "why": None if result.failure is None else result.failure.reason}
        row["s"] = time.process_time() - began
    return row


def main() -> None:
    """Print one line for each seed and the share of them that succeeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="0:10")
    parser.add_argument("--stage", choices=("contacts", "com", "run"), default="contacts")
    parser.add_argument("--out", type=Path, default=Path("sweep-seats"))
    options = parser.parse_args()
    first, last = (int(value) for value in options.seeds.split(":"))
    rows = []
    for seed in range(first, last):
        data = drawn(seed)
        body, seat = data["body"], data["scene"][0]
        row = taken(data, options.stage, options.out)
        rows.append(row)
        height = seat["position"][2] + 0.5 * seat["box"][2]
        kind = [name for name, is_so in (
            ("padded", seat["padded"]), ("closed", seat["box"][2] > 0.1),
            ("arms", any("armrest" in item["name"] for item in data["scene"])),
        ) if is_so]  # fmt: skip
        index = body["mass_kg"] / body["stature_m"] ** 2
        print(
            f"{seed:4} {body['sex']:6} {body['stature_m']:.2f} m, {index:.0f} kg/m2, seat {height:.2f} m "
            f"{' '.join(kind):20} {json.dumps(row)}", flush=True,
        )  # fmt: skip
    print(f"{sum(row['ok'] for row in rows)} of {len(rows)}; {np.median([row['s'] for row in rows]):.1f} s")


if __name__ == "__main__":
    main()
