"""Every trial of other laboratories, as delivered: read, reconstructed, compared with its plates, or why not.

`python benchmarks/survey_laboratories.py FOLDER RESULTS` analyses every C3D and TRC file below FOLDER, each
in its own process with a time limit, and keeps one JSON file per trial in RESULTS: a second run does
the missing ones. It then prints a table. `--refused` does those again that were refused or took too long.
`docs/laboratories.py` makes a page of RESULTS.
"""

import json
import multiprocessing
import re
import sys
import time
from pathlib import Path

LIMIT = 400.0
"""Longest time for one trial [s]."""


def one(path: Path) -> dict:
    """What becomes of one trial."""
    from manikin.analysis.analyze import AnalysisOptions, analyze
    from manikin.errors import ManikinError
    from manikin.recordings import read_recording

    found: dict = {"stage": "refused", "reason": ""}
    began = time.perf_counter()
    try:
        recording = read_recording(path)
        found |= {
            "stage": "read", "rate_hz": recording.rate, "frames": len(recording),
            "duration_s": (len(recording) - 1) / recording.rate, "plates": len(recording.plates),
        }  # fmt: skip
        summary = analyze(recording, AnalysisOptions()).as_dict()
    except ManikinError as error:
        return found | {"reason": re.sub(r"/\S*/", "", str(error)), "wall_s": time.perf_counter() - began}
    plates = summary["force_plates"]
    residual = summary["reconstruction_residual_m"]
    found |= {
        "stage": "reconstructed", "stature_m": summary["stature_m"], "mass_kg": summary["mass_kg"],
        "residual_median_m": residual["median"], "residual_max_m": residual["max"],
        "supports": len(summary["supports"]), "remarks": summary["remarks"],
        "activity": summary["activity"]["kind"], "implausible": summary["implausible"],
        "cycles": len(summary["gait"]["cycles"]) if summary["gait"] else 0,
    }  # fmt: skip
    if plates is not None:
        found["force_plates"] = {key: value for key, value in plates.items() if "torques" not in key}
        if plates["frames"] or plates["events"]:
            found["stage"] = "compared"
    return found | {"wall_s": time.perf_counter() - began}


def trials(folder: Path) -> list[Path]:
    """Recordings of markers below a folder."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".c3d", ".trc"))


def survey(folder: Path, results: Path, again: bool) -> None:
    """Do what is missing."""
    import manikin.analysis.analyze  # noqa: F401  once, before the processes are forked

    results.mkdir(parents=True, exist_ok=True)
    for path in trials(folder):
        kept = results / ("__".join(path.relative_to(folder).parts) + ".json")
        if kept.exists() and not (again and json.loads(kept.read_text())["stage"] in ("refused", "read")):
            continue
        began = time.perf_counter()
        found = _apart(path)
        found |= {"trial": str(path.relative_to(folder)), "process_s": time.perf_counter() - began}
        kept.write_text(json.dumps(found, indent=1) + "\n")


def _apart(path: Path) -> dict:
    """What becomes of one trial in a process of its own, which a fault or the time limit ends.

    It is forked, so that it need not import anything again.
    """
    context = multiprocessing.get_context("fork")
    mine, its = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(path, its))
    process.start()
    its.close()
    try:
        if not mine.poll(LIMIT):
            process.kill()
            return {"stage": "refused", "reason": f"FAULT: longer than {LIMIT:g} s"}
        return mine.recv()
    except EOFError:
        return {"stage": "refused", "reason": "FAULT: the process ended without a result"}
    finally:
        process.join()


def _send(path: Path, pipe) -> None:
    """Measure a trial and send what comes of it, a fault's last line too."""
    try:
        pipe.send(one(path))
    except Exception as error:
        pipe.send({"stage": "refused", "reason": f"FAULT: {type(error).__name__}: {error}"})


def table(results: Path) -> str:
    """One line per trial, then the counts."""
    lines, counts = [], dict[str, int]()
    for path in sorted(results.glob("*.json")):
        found = json.loads(path.read_text())
        counts[found["stage"]] = counts.get(found["stage"], 0) + 1
        if found["stage"] in ("refused", "read"):
            lines.append(f"{found['stage']:14}{found['trial'][-60:]:62}{found['reason']}")
            continue
        plates = found.get("force_plates") or {}
        cells = [f"{1e3 * found['residual_median_m']:.0f}/{1e3 * found['residual_max_m']:.0f} mm"]
        cells += [f"{found['stature_m']:.2f} m {found['mass_kg']:.0f} kg {found['supports']} supports"]
        if plates.get("timing_median_s") is not None:
            cells.append(f"{1e3 * plates['timing_median_s']:.0f} ms of {plates['events']}")
        if plates.get("cop_rms_m") is not None:
            vertical = 100.0 * plates["vertical_rms_body_weight"]
            cells.append(f"{vertical:.1f} % {1e3 * plates['cop_rms_m']:.0f} mm")
        lines.append(f"{found['stage']:14}{found['trial'][-60:]:62}{', '.join(cells)}")
    return "\n".join([*lines, ", ".join(f"{count} {stage}" for stage, count in counts.items())])


def main() -> None:
    """Command line."""
    folders = [Path(word) for word in sys.argv[1:] if not word.startswith("--")]
    if len(folders) != 2 or not folders[0].is_dir():
        raise SystemExit("usage: python benchmarks/survey_laboratories.py FOLDER RESULTS [--refused]")
    survey(*folders, "--refused" in sys.argv)
    print(table(folders[1]))


if __name__ == "__main__":
    main()
