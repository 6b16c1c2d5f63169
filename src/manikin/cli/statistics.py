"""``manikin statistics``: timing, supports and centre of mass of recordings, or of the published ones."""

from collections.abc import Mapping
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from manikin.cli import console
from manikin.cli.console import Interruption, JsonOption, SexOption, argument, flag, option
from manikin.errors import InputError

if TYPE_CHECKING:
    from manikin.recordings.statistics.clip_statistics import From, GroupStatistics, StatisticsSettings
    from manikin.recordings.statistics.phases import By


Box = tuple[float, float, float, float, float]
_FILES = "Recordings (.bvh .amc .c3d .trc); the group is the folder's name unless given."


def statistics(
    context: typer.Context,
    files: Annotated[list[str] | None, argument("[GROUP=]FILE|DIR|PATTERN", _FILES)] = None,
    published: Annotated[
        bool, flag("--published", "The motions under a beam of Qiu (2012) instead.")
    ] = False,
    bar: Annotated[float | None, option("M", "Height of a bar that is passed under [m].")] = None,
    box: Annotated[
        Box | None, option("X0 X1 Y0 Y1 M", "Place and height of the underside of a box [m].")
    ] = None,
    limit: Annotated[
        float | None, option("M", "Distance from the centre of mass to a support. Default: 1.08.")
    ] = None,
    effectors: Annotated[
        Literal["all", "feet"], option("all|feet", "Whose supports tell phases and sequences.")
    ] = "all",
    phases: Annotated[int | None, option("N", "Compare the first N phases of sequences only.", min=1)] = None,
    start: Annotated[
        str | None, option("KIND", "Compare sequences from the first such phase on: DS.")
    ] = None,
    origin: Annotated[
        Literal["stance", "lowest", "highest"],
        option("stance|lowest|highest", "From where placements are seen: stance, or CoM."),
    ] = "stance",
    by: Annotated[
        Literal["number", "kind", "effectors"], option("number|kind|effectors", "What phases have in common.")
    ] = "kind",
    sex: SexOption = "male",
    out: Annotated[Path | None, option("DIR", "Write statistics.json, phases.csv and figures there.")] = None,
    json: JsonOption = False,
) -> int:
    """Phase durations, sequences, placements, centre of mass over sets of recordings."""
    if published:
        options = {
            "FILE": files, "--bar": bar, "--box": box, "--limit": limit, "--phases": phases, "--start": start,
        }  # fmt: skip
        console.refuse_given(options, "the published motions are numbers already")
        return _published(out, json=json)
    if not files:
        raise InputError("no FILE is given; valid: recordings, folders or patterns, or --published")
    settings = _settings(bar, box, limit, effectors, phases, start, origin)
    return _recorded(files, settings, by, sex or "male", out, context.obj, json=json)


def _recorded(
    files: list[str], settings: "StatisticsSettings", by: "By", sex: str, out: Path | None,
    interruption: Interruption, *, json: bool,
) -> int:  # fmt: skip
    from manikin.recordings.statistics.clip_statistics import clip_as_dict, statistics_of
    from manikin.recordings.statistics.clips import grouped_files, read_clips

    chosen = grouped_files(files)
    with console.bars(interruption) as progress:
        read = read_clips(chosen, sex=sex, report=lambda share, remark: progress("recordings", share, remark))
        result = statistics_of(read.clips, settings)
        content: dict[str, Any] = {
            "limit_m": settings.limit,
            "overhead_m": None if settings.overhead is None else settings.overhead.height,
            "groups": {group: item.as_dict() for group, item in result.items()},
            "clips": [clip_as_dict(clip, settings) for clip in read.clips],
            "refused": [{"file": str(path), "reason": reason} for path, reason in read.refused.items()],
        }
        if out is not None and read.clips:
            from manikin.reports.directories import clip_figures, write_statistics

            sequences = [settings.phases_of(clip) for clip in read.clips]
            write_statistics(out, content, sequences, clip_figures(read.clips, result, settings, by))
    if json:
        console.print_json(content)
    else:
        _print(result, by, settings.limit)
    for reason in read.refused.values():
        console.complain(reason, console.BAD_INPUT)
    if out is not None and read.clips:
        typer.echo(f"files in {out}", err=True)
    return console.BAD_INPUT if read.refused else console.DONE


def _published(out: Path | None, *, json: bool) -> int:
    from manikin.recordings.statistics.clip_statistics import published_statistics
    from manikin.recordings.statistics.phases import published_heights, published_phases

    result, heights = published_statistics(), published_heights()
    content = {
        "groups": {group: item.as_dict() for group, item in result.items()},
        "com_standing_m": heights.standing,
        "com_lowest_m": dict(heights.lowest),
        "overhead_m": dict(heights.beams),
    }
    if out is not None:
        from manikin.reports.directories import published_figures, write_statistics

        write_statistics(out, content, published_phases(), published_figures())
        typer.echo(f"files in {out}", err=True)
    if json:
        console.print_json(content)
    else:
        _print(result, "number", None)
    return console.DONE


def _settings(
    bar: float | None, box: Box | None, limit: float | None, effectors: str, phases: int | None,
    start: str | None, origin: "From",
) -> "StatisticsSettings":  # fmt: skip
    """Settings of the statistics; a bar and a box exclude each other."""
    from manikin.body.segments import FEET
    from manikin.numerics.spatial import finite_number
    from manikin.recordings.statistics.clip_statistics import StatisticsSettings
    from manikin.recordings.statistics.passages import LIMIT, Overhead

    console.refuse(bar is not None and box is not None, "--bar", "a box is given")
    above = None if bar is None else Overhead(bar)
    overhead = above if box is None else Overhead(box[4], box[:2], box[2:4])
    within = LIMIT if limit is None else finite_number(limit, "--limit [m]", above=0.0)
    active = None if effectors == "all" else FEET
    return StatisticsSettings(overhead, within, active, phases, start, origin=origin)


def _print(groups: Mapping[str, "GroupStatistics"], by: "By", limit: float | None) -> None:
    from manikin.recordings.statistics.phases import initials

    for group, item in groups.items():
        typer.echo(f"{group}: {len(item.motions)} motions")
        spreads = item.durations[by]
        width = max((len(name) for name in spreads), default=0)
        for name, s in spreads.items():
            typer.echo(
                f"  {name:{width}}  n {s.count:3d}  mean {s.mean:.3f} s  SD {_known(s.deviation)}"
                f"  CV {_known(s.variation)}  {s.smallest:.3f} to {s.largest:.3f}"
            )
        known = item.consistency
        steps = ", ".join(f"{name} {count}" for name, count in known.first_steps.items()) or "none"
        typer.echo(
            f"  sequence of {known.counts.get(known.modal, 0)} of {known.motions}"
            f" ({known.mirrored_share:.0%} with mirror images): {initials(known.modal)}"
        )
        typer.echo(f"  first steps: {steps}")
        for effector, s in item.distances.items():
            within = f"; {100 * item.within[effector]:.1f} % within {limit:g} m" if item.within else ""
            typer.echo(
                f"  largest distance to {effector}: {s.mean:.3f} m, SD {_known(s.deviation)}, "
                f"{s.smallest:.3f} to {s.largest:.3f}{within}"
            )
        for motion, low in item.whole.items():
            tops = "".join(f", {part} {top:.2f}" for part, top in low.tops.items())
            typer.echo(f"  {motion}: lowest CoM {low.com_lowest:.2f} m at {low.com_lowest_at:.2f} s{tops}")
        for motion, under in item.under:
            room = "" if under.room is None else f", room {under.room:.2f}"
            typer.echo(
                f"  {motion}: under it {under.start:.2f} to {under.end:.2f} s, CoM {under.com_lowest:.2f} m, "
                f"{under.below:.2f} below it{room}"
            )


def _known(value: float) -> str:
    """A number, or a dash for what one motion does not tell."""
    return "-" if isnan(value) else f"{value:.3f}"
