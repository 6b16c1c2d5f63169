"""Report pages in HTML that need no other file: of a run and of a measured recording.

Their text and layout are the Jinja templates in the folder ``templates``.
"""

import base64
import shlex
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache, partial
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from PIL import Image, UnidentifiedImageError

from manikin.analysis import Analysis
from manikin.ergonomics.load_report import load_lines
from manikin.ergonomics.working_postures import VERDICTS as LEVELS
from manikin.pipeline.run_directory import REPORT, SCENARIO, RunRecord, read_run, read_summary
from manikin.pipeline.study import PAGE
from manikin.reports.figures import png_of
from manikin.reports.figures.study_maps import VERDICTS, study_maps
from manikin.reports.player import player_data
from manikin.reports.summary_table import FAMILY_HEADER, family_rows, verdict_line
from manikin.reports.taken_objects import object_places
from manikin.runtime import __version__
from manikin.runtime.display import readable
from manikin.runtime.files import FIGURES, write_result
from manikin.scenarios.families import FAMILIES

FIRST = ("scene", "operations", "postures", "margin", "com", "contacts")
"""Figures that come first, in this order; the others follow by name."""
LEFT_OUT = ("requirements", "failure", "verdict", "planned", "proved", "succeeded")
"""Keys of the summary that the page says in other words."""


COLOURS_OF_A_PICTURE = 160
"""Colours of a picture in a page."""
KEY_NUMBERS = {
    "centroidal.limiting_contact": "limiting contact",
    "execution.min_margin": "least margin, executed [N.m]",
    "wholebody.min_margin": "least margin, planned [N.m]",
    "execution.min_force_at_com_N": "least force that ends balance, executed [N]",
    "wholebody.min_clearance_m": "least clearance [m]",
    "wholebody.closest_pair": "nearest to each other",
    "wholebody.max_torque_share": "largest share of a joint's strength",
    "wholebody.max_torque_joint": "at",
    "execution.friction.max_share": "largest share of friction, executed",
    "ergonomics.rula_max": "RULA, largest",
    "ergonomics.reba_max": "REBA, largest",
    "ergonomics.owas_max": "OWAS, largest",
    "ergonomics.working_postures.rare": "working postures, below 2 movements a minute",
    "ergonomics.working_postures.frequent": "working postures, more often",
    "ergonomics.force_risk": "risk multiplier of the force of the hands",
    "ergonomics.force_verdict": "force of the hands",
    "ergonomics.l5s1_max_compression_N": "largest compression at L5/S1 [N]",
    "ergonomics.l5s1_level": "low back",
    "ergonomics.capable_min_share.male": "share of men strong enough",
    "ergonomics.capable_min_share.female": "share of women strong enough",
}
"""What of the summary stands on a run's page before the figures, by its words there."""


def render(template: str, **values: Any) -> str:
    """Fill in a page of ``templates``, such as ``"run"``, with values; every text in it is escaped."""
    return _environment().get_template(f"{template}.html.jinja").render(**values)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("manikin.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.globals["version"] = __version__
    environment.filters |= {
        "readable": readable, "shown": _shown, "fixed": _fixed, "width": _width,
        "mm": lambda value, decimals=1: "-" if value is None else f"{1e3 * value:.{decimals}f}",
        "share": lambda value: _fixed(value, "%", 100.0),
        "level": LEVELS.__getitem__,
        "base64": lambda png: base64.b64encode(png).decode("ascii"),
    }  # fmt: skip
    return environment


def _shown(value: Any, decimals: int | None = None) -> str:
    """Text of a value; of a float with four digits in all unless ``decimals`` are given."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if decimals is None else f"{value:.{decimals}f}"
    if isinstance(value, str | int):
        return str(value)
    return ", ".join(_shown(item, decimals) for item in value)


def _fixed(value: float | None, unit: str, factor: float = 1.0) -> str | None:
    return None if value is None else f"{factor * value:.1f} {unit}"


def _width(png: bytes) -> int:
    """Half the pixels across a PNG file; 0 if it does not say."""
    return int.from_bytes(png[16:20], "big") // 2 if png[12:16] == b"IHDR" else 0


def write_run_page(directory: str | Path) -> Path:
    """Write ``report.html`` of a finished run, with every figure in its directory, and return the file.

    Raises:
        MotionFileError: If the summary cannot be read or the page cannot be written.
    """
    folder = Path(directory)
    return write_result(folder / REPORT, run_page(folder, read_summary(folder)))


def run_page(folder: Path, summary: Mapping[str, Any]) -> str:
    """HTML of a run in a folder: verdict, requirements, motion to be played, contacts, figures, numbers."""
    files = {file.stem: file for file in sorted((folder / FIGURES).glob("*.png"))}
    names = dict.fromkeys([*FIRST, *files])
    pictures = {readable(name): _smaller(files[name].read_bytes()) for name in names if name in files}
    values = dict(_flat({key: value for key, value in summary.items() if key not in LEFT_OUT}))
    record = read_run(folder) if (folder / SCENARIO).exists() else None
    return render(
        "run", summary=summary, verdict=verdict_line(summary), pictures=pictures, values=values,
        motion=_motion(record), contacts=_contacts(record), key_numbers=_key_numbers(values),
        commands="" if record is None else _commands(folder, summary),
    )  # fmt: skip


def _smaller(png: bytes) -> bytes:
    """The picture of a PNG file in :data:`COLOURS_OF_A_PICTURE` colours, which takes a third of the bytes."""
    content = BytesIO()
    with suppress(UnidentifiedImageError):
        image = (
            Image.open(BytesIO(png)).convert("RGB").quantize(COLOURS_OF_A_PICTURE, Image.Quantize.FASTOCTREE)
        )
        image.save(content, format="png", compress_level=6)
    return content.getvalue() or png


def _motion(record: RunRecord | None) -> dict[str, Any] | None:
    """What the player shows of the last motion of a run, or None without a body to show."""
    if record is None or not record.motions or record.body is None or record.body.is_point_mass:
        return None
    motion = list(record.motions.values())[-1]
    places = partial(object_places, record, motion)
    return player_data(record.body, motion, record.scene, record.schedule, places)


def _contacts(record: RunRecord | None) -> list[dict[str, Any]]:
    """One row for each phase: its begin and end [s], and what is held in it."""
    if record is None or record.schedule is None:
        return []
    edges = pairwise(record.schedule.instants.tolist())
    return [
        {"start": start, "end": end, "held": ", ".join(map(readable, phase.stance.effectors)) or "flight"}
        for (start, end), phase in zip(edges, record.schedule.sequence, strict=True)
    ]


def _key_numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of :data:`KEY_NUMBERS` that a run has, by their words."""
    return {words: values[key] for key, words in KEY_NUMBERS.items() if values.get(key) is not None}


def _commands(folder: Path, summary: Mapping[str, Any]) -> str:
    """Commands that run the scenario again, play its motion and export it."""
    place, seed, adapted = shlex.quote(str(folder)), summary.get("seed", 0), summary.get("adaptation")
    again = f"run {shlex.quote(str(folder / SCENARIO))} --seed {seed}"
    if adapted is not None:  # the scenario has no recording: it plans the same way by itself
        again = f"adapt {shlex.quote(adapted['recording'])}"
    return "\n".join((
        f"manikin {again} --out again", f"manikin view {place}", f"manikin export {place} --format glb",
    ))  # fmt: skip


def analysis_page(analysis: Analysis, summary: Mapping[str, Any], sheets: tuple[str, str]) -> str:
    """HTML of a measured recording with its numbers.

    The ``sheets`` are SVG of :func:`manikin.reports.analysis_sheet.recording_sheet` and
    :func:`manikin.reports.gait_sheet.gait_sheet`; empty for none.
    """
    sheet, cycles = sheets
    missing = [f"{part}: {reason}" for part, reason in summary["ergonomics"]["missing"].items()]
    shown = {"name": analysis.name, "sheet": sheet, "cycles": cycles, "missing": missing}
    shown["loads"] = load_lines(summary["ergonomics"])
    shown["motion"] = player_data(analysis.body, analysis.motion) if sheet else None
    return render("analysis", summary=summary, **shown)


def write_benchmark_page(directory: Path, result: Mapping[str, Any]) -> Path:
    """Write ``report.html`` of a benchmark beside its results, and return the file.

    Raises:
        MotionFileError: If it cannot be written.
    """
    descriptions = {name: family.description for name, family in FAMILIES.items()}
    rows = family_rows(result)
    page = render("benchmark", result=result, header=FAMILY_HEADER, rows=rows, descriptions=descriptions)
    return write_result(directory / REPORT, page)


def write_study_page(directory: Path, result: Mapping[str, Any]) -> Path:
    """Write ``study.html`` of a study beside its results, and return the file.

    Raises:
        MotionFileError: If it cannot be written.
    """
    return write_result(directory / PAGE, study_page(result))


def study_page(result: Mapping[str, Any]) -> str:
    """HTML of a study: maps of success and margin, groups, and who can and who cannot, with the reasons."""
    pictures = {words: png_of(figure) for words, figure in study_maps(result).items()}
    people = {
        verdict: [person for person in result["people"] if person["verdict"] == verdict]
        for verdict in VERDICTS
    }
    count = {verdict: len(members) for verdict, members in people.items()}
    swept, percent = list(result["settings"][0]), f"{100.0 * result['confidence']:g} %"
    shown = {"pictures": pictures, "people": people, "count": count, "swept": swept, "percent": percent}
    return render("study", result=result, **shown)


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and their values; of a list of mappings, one entry each."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
            yield from _flat({str(number): item for number, item in enumerate(value)}, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
