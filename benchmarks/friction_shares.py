"""Largest use of friction in each stage of finished runs, against the cone that was asked for.

    python -m manikin run all --out runs
    python benchmarks/friction_shares.py runs

Reads every ``summary.json`` below the folders; exit status 1 if a stage left its pyramid.
"""

import json
import sys
from pathlib import Path

STAGES = ("centroidal", "wholebody", "act", "execution")
ROUNDING = 1e-6


def main(folders: list[str]) -> int:
    """Print a table; return the exit status."""
    files = sorted(path for folder in folders for path in Path(folder).rglob("summary.json"))
    if not files:
        print(f"no summary.json below {', '.join(folders)}; valid: folders of finished runs", file=sys.stderr)
        return 2
    print(f"{'run':32}{'model':8}" + "".join(f"{stage:>12}" for stage in STAGES))
    broken = 0
    for path in files:
        summary = json.loads(path.read_text())
        found = {stage: (summary.get(stage) or {}).get("friction") for stage in STAGES}
        used = {stage: item for stage, item in found.items() if item is not None}
        models = "/".join(sorted({item["model"] for item in used.values()})) or "-"
        cells = [f"{used[stage]['max_share']:12.4f}" if stage in used else f"{'-':>12}" for stage in STAGES]
        print(f"{path.parent.name:32}{models:8}" + "".join(cells))
        broken += any(item["max_share"] > 1.0 + ROUNDING for item in used.values())
    print(f"{len(files)} runs, {broken} outside the cone that was asked for")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["runs"]))
