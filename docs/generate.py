"""Write what the documentation takes from the code: the JSON schema and the generated tables.

Run ``python docs/generate.py`` after a change; a test compares the result with the files.
``python docs/generate.py REPORT.json ...`` first takes over new results: what ``manikin run all --json``
printed, reduced to what the page shows.  What ``manikin benchmark --json`` printed, or its
``benchmark.json``, is taken over likewise.
A page marks a generated table with ``<!-- generated: NAME -->`` ... ``<!-- end generated -->``.
"""

import json
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import result_tables

from manikin.body import human
from manikin.body.human_parts import HUMAN_HINGES
from manikin.body.strength import HUMAN_STRENGTH, DirectionStrength, LegStrength, hinge_strength
from manikin.motion.file import DATASETS
from manikin.reports import summary_table
from manikin.reports.summary_table import counts_line
from manikin.scenarios import json_schema
from manikin.scenarios.families import FAMILIES
from manikin.scenarios.stance_file import StanceFile
from manikin.scenarios.study_file import study_schema
from manikin.verification import ContactPlanFile

DOCS = Path(__file__).parent
SCHEMAS: dict[str, Callable[[], dict[str, Any]]] = {
    "scenario.schema.json": json_schema,
    "stance.schema.json": StanceFile.model_json_schema,
    "contact-plan.schema.json": ContactPlanFile.model_json_schema,
    "study.schema.json": study_schema,
}
RESULTS = DOCS / "results.json"
BENCHMARK = DOCS / "benchmark.json"
FAR = 1e5
"""Bounds beyond this only refuse nonsense and are not shown."""
_BLOCK = re.compile(r"(<!-- generated: ([\w-]+) -->\n).*?(<!-- end generated -->)", re.DOTALL)


def files() -> dict[Path, str]:
    """Every generated file with the text it should have."""
    texts = {DOCS / name: json.dumps(schema(), indent=2) + "\n" for name, schema in SCHEMAS.items()}
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if _BLOCK.search(text):
            texts[page] = _BLOCK.sub(lambda m: f"{m[1]}\n{TABLES[m[2]]()}\n{m[3]}", text)
    return texts


# --- schemas ---------------------------------------------------------------------------------


def schema_tables(schema: dict[str, Any]) -> str:
    """One table per section of a file, the file itself first."""
    sections = [("The file", schema)]
    sections += [(f"`{_label(name)}`", part) for name, part in schema["$defs"].items()]
    return "\n".join(_section(title, part) for title, part in sections if "properties" in part)


def _section(title: str, part: dict[str, Any]) -> str:
    # Only the file as a whole has alternatives: it may extend another one instead.
    required = part.get("required") or [k for either in part.get("anyOf", ())[1:] for k in either["required"]]
    rows = [
        f"| `{key}` | {_type(value)} | {_default(value, key in required)} | {value.get('description', '')} |"
        for key, value in part["properties"].items()
    ]
    note = " ".join(part.get("description", "").replace("``", "`").split())
    head = ["| key | type | default | meaning |", "|---|---|---|---|"]
    return "\n".join([f"### {title}", "", note, "", *head, *rows, ""])


def _label(name: str) -> str:
    """Name of a section for the reader: ``ObstacleSection`` becomes ``obstacle``."""
    return re.sub(r"(?<!^)(?=[A-Z])", " ", name.removesuffix("Section")).lower()


def _type(value: dict[str, Any]) -> str:
    if "$ref" in value:
        label = _label(value["$ref"].rsplit("/", 1)[-1])
        return f"[{label}](#{label.replace(' ', '-')})"
    for key in ("anyOf", "oneOf"):
        if key in value:
            kinds = [_type(item) for item in value[key] if item.get("type") != "null"]
            return " or ".join(dict.fromkeys(kinds))
    if "const" in value:
        return f"`{value['const']}`"
    if "enum" in value:
        return " or ".join(f"`{item}`" for item in value["enum"])
    if value.get("type") == "array" and "prefixItems" in value:
        return f"{len(value['prefixItems'])} × {_type(value['prefixItems'][0])}"
    if value.get("type") == "array":
        return f"list of {_type(value['items'])}"
    return _number(value)


def _number(value: dict[str, Any]) -> str:
    names = {"string": "text", "boolean": "true or false", "object": "mapping"}
    text = names.get(value.get("type", ""), value.get("type", "any"))
    signs = {"exclusiveMinimum": "&gt;", "minimum": "≥", "exclusiveMaximum": "&lt;", "maximum": "≤"}
    bounds = [f"{sign} {value[key]:g}" for key, sign in signs.items() if abs(value.get(key, FAR)) < FAR]
    return " ".join([text, *([", ".join(bounds)] if bounds else [])])


def _default(value: dict[str, Any], required: bool) -> str:
    if required:
        return "required"
    default = value.get("default")
    if isinstance(default, dict):
        shown = {key: item for key, item in default.items() if item is not None}
        return f"`{json.dumps(shown)}`" if shown and len(json.dumps(shown)) < 60 else "see there"
    return "" if default in (None, "", []) else f"`{json.dumps(default)}`"


# --- body and motion file --------------------------------------------------------------------


def segment_table() -> str:
    """Segments of the reference body."""
    body = human()
    rows = ["| segment | parent | mass [kg] | hinges |", "|---|---|---|---|"]
    for segment in body.segments:
        if not segment.name.startswith("right"):
            hinges = ", ".join(hinge.name.removeprefix("left_") for hinge in segment.hinges)
            name = re.sub(r"^left_", "left, right ", segment.name)
            parent = (segment.parent or "free: 6 degrees of freedom").removeprefix("left_")
            rows.append(f"| {name} | {parent} | {segment.mass:.2f} | {hinges} |")
    return "\n".join(rows) + "\n"


def hinge_table() -> str:
    """Hinges with their ranges and speeds."""
    rows = ["| hinge | axis (left side) | range [deg] | speed [rad/s] |", "|---|---|---|---|"]
    for hinge in (entry for entries in HUMAN_HINGES.values() for entry in entries):
        axis = ", ".join(f"{value:.3g}" for value in np.array(hinge.axis) + 0.0)
        span = f"{hinge.lower_deg:g} to {hinge.upper_deg:g}"
        rows.append(f"| {hinge.name} | {axis} | {span} | {hinge.speed:g} |")
    return "\n".join(rows) + "\n"


def strength_table() -> str:
    """Torque limits of a man and a woman in each direction of each hinge, with their sources."""
    rows = [
        "| hinge | − man | + man | − woman | + woman | source (−; +) |",
        "|---|---|---|---|---|---|",
    ]
    people = ((79.0, 1.75, "male"), (62.0, 1.65, "female"))
    for name, entries in HUMAN_STRENGTH.items():
        values = [f"{torque:.0f}" for person in people for torque in hinge_strength(name, *person)]
        sources = dict.fromkeys(_source(entry) for entry in entries)
        rows.append(f"| {name} | {' | '.join(values)} | {'; '.join(sources)} |")
    return "\n".join(rows) + "\n"


def _source(entry: DirectionStrength) -> str:
    """How large and from where."""
    if isinstance(entry, LegStrength):
        ages = [", ".join(f"{value:.3f}" for value in group) for group in (entry.male, entry.female)]
        return f"{ages[0]} (women {ages[1]}) *mgh*, {entry.source} [{entry.grade}]"
    return f"{entry.per_kg:.3g} N·m/kg, {entry.source} [{entry.grade}]"


def dataset_table() -> str:
    """Datasets of a motion."""
    shapes = {
        "time": "(n,)", "q": "(n, nq)", "v": "(n, nv)", "a": "(n, nv)", "tau": "(n, nv)", "com": "(n, 3)",
        "angular_momentum": "(n, 3)", "margin": "(n,)", "support": "(n, c)", "contact_force": "(n, c, 6)",
    }  # fmt: skip
    rows = ["| dataset | shape | unit | meaning |", "|---|---|---|---|"]
    rows += [f"| `{name}` | {shapes[name]} | {unit} | {text} |" for name, (unit, text) in DATASETS.items()]
    return "\n".join(rows) + "\n"


# --- results ---------------------------------------------------------------------------------


def take_over_results(arguments: Sequence[str]) -> None:
    """Keep the numbers of reports that the tables show.

    Args:
        arguments: Report files of ``manikin run all`` or ``manikin benchmark``.
    """
    for file in arguments:
        given = json.loads(Path(file).read_text(encoding="utf-8"))
        if "families" in given:
            take_over_benchmark(given)
        else:
            RESULTS.write_text(json.dumps(result_tables.reduced(given), indent=1) + "\n", encoding="utf-8")


def take_over_benchmark(report: dict[str, Any]) -> None:
    """Keep the counts of a benchmark in place of the earlier one of its stage."""
    kept = json.loads(BENCHMARK.read_text(encoding="utf-8")) if BENCHMARK.exists() else {}
    kept[report["stage"]] = result_tables.rounded_values(
        {key: value for key, value in report.items() if key not in ("tasks", "complete", "wall_s")}
    )
    BENCHMARK.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def kept_results() -> dict[str, Any]:
    """What was taken over last; see :func:`result_tables.reduced`."""
    return json.loads(RESULTS.read_text(encoding="utf-8"))


def results_table() -> str:
    """The kept results, with their summary."""
    report = kept_results()
    total = f"{counts_line(report)}."
    return f"{result_tables.markdown_table(report)}\n{total}\n"


def beams_table() -> str:
    """Lowest centre of mass and head clearance under the beams beside the published heights."""
    published = json.loads((DOCS / "published.json").read_text(encoding="utf-8"))
    table = result_tables.beam_table(kept_results(), published)
    people, beams = published["source"], published["beam_height_source"]
    return f"{table}\nPeople: {people}. Heights of the beams: {beams}.\n"


# --- benchmark ---------------------------------------------------------------------------------


def families_table() -> str:
    """Families of random scenes with what is drawn, and why a person can do it."""
    rows = []
    for name, family in FAMILIES.items():
        first, _, rest = " ".join((family.draw.__doc__ or "").split()).partition(". ")
        drawn, _, possible = rest.partition("Possible: ")
        rows.append([f"`{name}`", first, drawn.strip() or "-", possible])
    return result_tables.markdown_rows(["family", "task", "drawn as well", "possible because"], rows)


def benchmark_table(stage: str) -> str:
    """Counts of the kept benchmark of a stage."""
    kept = json.loads(BENCHMARK.read_text(encoding="utf-8")) if BENCHMARK.exists() else {}
    if stage not in kept:
        return "No report has been taken over yet.\n"
    report = kept[stage]
    first, count = report["first_seed"], report["seeds"]
    table = result_tables.markdown_rows(summary_table.FAMILY_HEADER, summary_table.family_rows(report))
    limit = f"{report['time_limit_s']:g} s of processor time per task"
    return f"{table}\nSeeds {first} to {first + count - 1}, {limit}, manikin {report['manikin']}.\n"


# --- walls ---------------------------------------------------------------------------------------


PUBLISHED_TRIALS = {
    "trial-1": ("1", "1e3", 3.58, 0.30),
    "trial-2": ("1e3", "1", 3.90, 196.26),
    "trial-3": ("1e3", "1e-3", 3.92, 134.01),
    "trial-4": ("1e4", "1e-3", 5.29, 280.55),
    "trial-5": ("1e4", "10", 5.28, 280.60),
}
"""[Qiu2012] Table 5.1: weights of margin and smoothness, duration [s], margin [N]."""


def walls_trials() -> str:
    """Table 5.1 beside the trials measured by ``docs/walls.py``."""
    found = json.loads((DOCS / "walls.json").read_text(encoding="utf-8"))
    rows = [
        "| trial | $w_1$ | $w_2$ | thesis: duration [s] | margin [N] | ours: duration [s] | margin [N] | "
        "solved in [s] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, (margin_weight, smoothness, duration, margin) in PUBLISHED_TRIALS.items():
        ours = found["trials"][name]
        rows.append(
            f"| {name} | {margin_weight} | {smoothness} | {duration:.2f} | {margin:.2f} | "
            f"{ours['duration_s']:.2f} | {ours['margin_N']:.2f} | {ours['wall_s']:.1f} |"
        )
    ours = found["one_polynomial"]
    rows.append(
        f"| one-polynomial | 1e4 | 1e-3 | 5.29 | 280.55 | {ours['duration_s']:.2f} | "
        f"{ours['margin_N']:.2f} | {ours['wall_s']:.1f} |"
    )
    return "\n".join(rows) + "\n"


def walls_spacing() -> str:
    """Margins of trial 4 within its published duration, over the spacing of the pairs."""
    found = json.loads((DOCS / "walls.json").read_text(encoding="utf-8"))["spacings"]
    rows = ["| pairs apart along y [m] | duration [s] | margin [N] |", "|---|---|---|"]
    for spacing, ours in found.items():
        value = "none found" if ours["margin_N"] is None else f"{ours['margin_N']:.1f}"
        duration = "" if ours["duration_s"] is None else f"{ours['duration_s']:.2f}"
        rows.append(f"| {spacing} | {duration} | {value} |")
    return "\n".join(rows) + "\n"


# --- heuristics ----------------------------------------------------------------------------------


HEURISTIC_SCENES = {"push": "pushing a cupboard", "rise": "getting up from a chair", "climb": "climbing"}


def heuristics_table() -> str:
    """Forces that chosen contacts can exert, measured by ``docs/heuristics.py``."""
    found = json.loads((DOCS / "heuristics.json").read_text(encoding="utf-8"))
    names = list(next(iter(found.values()))["mean_force_N"])
    shown = {"efort": "EFORT", "strength": "EFORT with strengths", "distance": "closest distance"}
    heads = [shown.get(name, name) for name in names]
    rows = [
        f"| scene | {' | '.join(heads)} | EFORT not behind closest distance | contacts |",
        "|---|" + "---|" * (len(names) + 2),
    ]
    for scene, item in found.items():
        forces = " | ".join(f"{item['mean_force_N'][name]:.0f}" for name in names)
        rows.append(
            f"| {HEURISTIC_SCENES[scene]} | {forces} | {100 * item['ahead_of_distance']:.0f} % | "
            f"{item['compared']} of {item['asked']} |"
        )
    return "\n".join(rows) + "\n"


# --- pushed while standing -----------------------------------------------------------------------


def push_map() -> str:
    """Impulses held by direction, of the maps in ``push_map.json`` as ``manikin push --map`` wrote it."""
    found = json.loads((DOCS / "push_map.json").read_text(encoding="utf-8"))
    maps = [found, *found["compared"]]
    rows = [
        "| pushed | ahead | to the left | back | to the right | least | most | share of the bound |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in maps:
        held, directions = one["impulse_Ns"], one["directions_deg"]
        cells = [f"{held[directions.index(angle)]:.0f}" for angle in (0.0, 90.0, 180.0, 270.0)]
        for extreme in (min, max):
            place = held.index(extreme(held))
            cells.append(f"{held[place]:.0f} at {directions[place]:.0f}°")
        shares = np.array(held) / one["bound_Ns"]
        cells.append(f"{shares.min():.2f} to {shares.max():.2f}")
        feet = "both feet" if one["support"] == "both" else f"the {one['support']} foot"
        locked = f", {' and '.join(one['locked'])} locked" if one["locked"] else ""
        rows.append(f"| on {feet}{locked} | {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


# --- pushed while moving -------------------------------------------------------------------------


PREDICTIONS = {
    "best": "the larger of the next two where the plan can wait, else the first of them",
    "plan": "the room that the plan leaves",
    "capture": "the capture point's distance to the edge",
    "margin": "the wrench margin",
}


def pushed_impulses() -> str:
    """Impulses held at each time, measured by ``docs/pushed.py``."""
    found = json.loads((DOCS / "pushed.json").read_text(encoding="utf-8"))
    rows = [
        "| scenario | at [s] | feet | from the back | from the right | from the front | from the left |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, time, feet in dict.fromkeys((i["scenario"], i["time_s"], i["feet"]) for i in found):
        cells = []
        for direction in (0, 90, 180, 270):
            key = (name, time, direction)
            here = [i for i in found if (i["scenario"], i["time_s"], i["direction_deg"]) == key]
            values = {item["returning"]: item["measured_Ns"] for item in here}
            after, before = (f"{values[key]:.0f}" if key in values else "-" for key in (True, False))
            cells.append(f"{after} ({before}; {here[0]['best']:.0f})" if here else "-")
        rows.append(f"| {name} | {time:g} | {feet} | {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def pushed_predictions() -> str:
    """How well each prediction meets what was measured by ``docs/pushed.py``."""
    found = json.loads((DOCS / "pushed.json").read_text(encoding="utf-8"))
    rows = [
        "| predicted from | pushes | correlation | measured / predicted: median | middle half | of one foot |"
        " of both feet |",
        "|---|---|---|---|---|---|---|",
    ]
    held = [item for item in found if item["returning"]]
    measured = np.array([item["measured_Ns"] for item in held])
    single = np.array([item["feet"] == 1 for item in held])
    for key, words in PREDICTIONS.items():
        predicted = np.array([item[key] for item in held])
        ratios, good = measured / np.where(predicted > 0.0, predicted, np.nan), predicted > 0.0
        low, middle, high = np.percentile(ratios[good], (25, 50, 75))
        one, both = (float(np.median(ratios[good & some])) for some in (single, ~single))
        rows.append(
            f"| {words} | {len(held)} | {np.corrcoef(predicted, measured)[0, 1]:.2f} | {middle:.2f} | "
            f"{low:.2f} to {high:.2f} | {one:.2f} | {both:.2f} |"
        )
    return "\n".join(rows) + "\n"


TABLES: dict[str, Callable[[], str]] = {
    "scenario": lambda: schema_tables(json_schema()),
    "stance": lambda: schema_tables(StanceFile.model_json_schema()),
    "contact-plan": lambda: schema_tables(ContactPlanFile.model_json_schema()),
    "study": lambda: schema_tables(study_schema()),
    "segments": segment_table,
    "hinges": hinge_table,
    "strength": strength_table,
    "datasets": dataset_table,
    "results": results_table,
    "beams": beams_table,
    "families": families_table,
    "benchmark-contacts": lambda: benchmark_table("contacts"),
    "benchmark-all": lambda: benchmark_table("all"),
    "walls-trials": walls_trials,
    "walls-spacing": walls_spacing,
    "heuristics": heuristics_table,
    "push-map": push_map,
    "pushed-impulses": pushed_impulses,
    "pushed-predictions": pushed_predictions,
}


if __name__ == "__main__":
    if sys.argv[1:]:
        take_over_results(sys.argv[1:])
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
