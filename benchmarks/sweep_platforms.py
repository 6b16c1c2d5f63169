"""Platforms of other bodies, heights and frictions, mirrored or turned, without constraints on the CoM.

`python benchmarks/sweep_platforms.py 0 20` runs seeds 0 to 19, 10 to 45 s of processor time each; a third
argument ``com`` stops after the centre of mass and its key postures. The last line counts what is proved.
"""

import sys
import time
from copy import deepcopy

import numpy as np

from manikin.pipeline.runner import run
from manikin.pipeline.stages import Report, RunContext
from manikin.pipeline.stages.whole_body_stage import plan_centre_of_mass, with_key_postures
from manikin.scenarios import load_scenario
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate

MIRRORED = {"left_foot": "right_foot", "right_foot": "left_foot"}


def platform(seed):
    """A platform for one random body, in a random place; half of them mirrored, half with steps to scale."""
    rng = np.random.default_rng(seed)
    data = deepcopy(load_scenario("platform").file.model_dump(mode="json", exclude_none=True))
    stature = round(rng.uniform(1.50, 1.95), 3)
    scale = stature / 1.75
    body = {"stature_m": stature, "mass_kg": round(rng.uniform(19.0, 32.0) * stature**2, 1),
            "sex": str(rng.choice(["male", "female"]))}  # fmt: skip
    height = round(rng.uniform(0.08, 0.30), 3)
    sill = round(height + rng.uniform(0.02, 0.14), 3)
    room = round(1.275 * scale * rng.uniform(0.93, 1.18), 3)
    along = scale if rng.random() < 0.5 else 1.0
    mirror = -1.0 if rng.random() < 0.5 else 1.0
    turn, shift = rng.uniform(-180.0, 180.0), rng.uniform(-5.0, 5.0, 2)
    cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))

    def moved(x, y, z):
        x, y = along * x * mirror, along * y
        return [float(cosine * x - sine * y + shift[0]), float(sine * x + cosine * y + shift[1]), float(z)]

    thick = {
        "roof": (0.05, height + room + 0.025),
        "threshold": (sill, sill / 2),
        "platform": (height, height / 2),
    }
    for item in data["scene"]:
        x, y, _ = item["position"]
        size, z = thick[item["name"]]
        item["box"] = [along * item["box"][0], along * item["box"][1], size]
        item["position"] = moved(x, y, z)
        item["rpy_deg"] = [0.0, 0.0, turn]
    phases = []
    for phase in data["supports"]["phases"]:
        entries = {}
        for key, value in phase.items():
            name = MIRRORED.get(key, key) if mirror < 0.0 else key
            if isinstance(value, dict):
                x, y, z = value["position"]
                yaw = value.get("yaw_deg", 0.0)
                yaw = (180.0 - yaw if mirror < 0.0 else yaw) + turn
                value = {**value, "position": moved(x, y, height if z > 0.0 else 0.0), "yaw_deg": yaw}
            entries[name] = value
        phases.append(entries)
    data["supports"] |= {"phases": phases, "friction": round(rng.uniform(0.35, 0.95), 2),
                         "normal_force_cap_N": 19.0 * body["mass_kg"]}  # fmt: skip
    data["supports"]["sole"] = {"length_m": 0.16 * stature, "width_m": 0.12 * scale}
    low = min(0.53 * stature, 0.66 * scale * min(room / (1.275 * scale), 1.35))
    data["task"] = {
        "start": {"com": moved(0.0, 0.0, 0.92 * scale)}, "goal": {"com": moved(0.6, 0.65, height + low)},
    }  # fmt: skip
    margin = 16.7 * body["mass_kg"] / 79.0 * scale
    style = int(rng.integers(3))  # the planner's options of the built-in platform, its defaults, a low margin
    data["planning"] = ({**data["planning"], "min_margin": margin}, {}, {"min_margin": 0.3 * margin})[style]
    for key in ("variants", "reference_stature_m", "reference_mass_kg"):
        data.pop(key, None)
    data |= {"name": f"platform-{seed}", "body": {"model": "human", **body}, "com_constraints": []}
    what = (
        f"{body['sex'][0]} {stature:.2f} m {body['mass_kg']:.0f} kg, platform {height:.2f}, sill {sill:.2f}, "
        f"room {room:.2f}, friction {data['supports']['friction']}, steps x{along:.2f}, "
        f"planning {style}"
    )
    return Scenario(validate(ScenarioFile, data, f"platform-{seed}"), f"platform-{seed}"), what


def planned(scenario):
    """Failure of the centre of mass and its key postures, or None."""
    context = RunContext.of(scenario)
    report = Report(context, None, None, time.perf_counter())
    result = plan_centre_of_mass(context, report)
    plan = with_key_postures(context, report, result)
    return report.failure, plan.replans, result


def main(first, count, stage=""):
    """Print one line for each seed."""
    good = 0
    for seed in range(first, first + count):
        scenario, what = platform(seed)
        began = time.process_time()
        if stage == "com":
            failure, replans, result = planned(scenario)
            text = "" if failure is None else f"{failure.stage} {failure.time_s:.2f} s: {failure.reason}"
            good += failure is None
            print(seed, what, "planned" if failure is None else "FAILED", f"replans {replans}",
                  f"{time.process_time() - began:.0f} s", text, flush=True)  # fmt: skip
            continue
        result = run(scenario)
        good += result.succeeded
        failure = result.summary["failure"]
        text = "" if failure is None else f"{failure['stage']} {failure['time_s']:.2f} s: {failure['reason']}"
        print(seed, what, result.verdict, f"{time.process_time() - began:.0f} s", text, flush=True)
    print(f"{good} of {count}")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
