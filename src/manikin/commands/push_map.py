"""``manikin push --map``: the largest impulse held, by direction, of one or several ways to stand."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from manikin.commands.console import DONE, print_json, stdout_kept_clean
from manikin.commands.push_options import PushOptions, conditions
from manikin.interruption import Interruption

if TYPE_CHECKING:
    from manikin.simulation import DirectionSearch, HeldImpulse, PushMap

STAGE = "map"


@dataclass(frozen=True)
class MapRequest:
    """What is searched.

    Attributes:
        options: Of the map that is asked for.
        compare: What further maps differ in, each as :meth:`PushOptions.changed` takes it.
        directions: How many, all around.
        tolerance: Of the impulses [N.s].
    """

    options: PushOptions
    compare: tuple[str, ...]
    directions: int
    tolerance: float

    def searches(self) -> "list[tuple[PushMap, list[DirectionSearch]]]":
        """Each map, empty, with the searches of its directions.

        Raises:
            InputError: If a value is not usable.
        """
        from manikin.simulation import DirectionSearch, PushMap, equal_directions
        from manikin.spatial import finite_number
        from manikin.stages.recovery import push_trials

        directions = equal_directions(self.directions)
        tolerance = finite_number(self.tolerance, "--tolerance", at_least=0.01, at_most=100.0)
        found = []
        for options in (self.options, *(self.options.changed(text) for text in self.compare)):
            job = options.scenario("push-map")
            trials = push_trials(job)
            searches = [DirectionSearch(trials, direction, tolerance) for direction in directions]
            empty = PushMap.empty(conditions(job, tolerance), directions, trials.bound(directions))
            found.append((empty, searches))
        return found


def search_map(
    request: MapRequest,
    directory: Path | None,
    interruption: Interruption,
    *,
    jobs: int | None,
    draw: bool,
    json: bool,
) -> int:
    """Search, keep every direction as soon as it is known, draw and print.

    Args:
        request: What is searched.
        directory: Where the files go, or None to write nothing.
        interruption: Asked whether to go on after each direction.
        jobs: Processes; one per core when None.
        draw: Whether the figure is drawn.
        json: Whether the maps are printed as JSON.

    Returns:
        The exit status.
    """
    from manikin.batch import usable_cores
    from manikin.map_directory import MapDirectory, maps_as_dict
    from manikin.progress import StageProgress
    from manikin.simulation import search_directions

    asked = request.searches()
    maps = [empty for empty, _ in asked]
    kept = None if directory is None else MapDirectory(directory, maps)
    if kept is not None:
        maps = list(kept.maps)
    waiting = [(number, place) for number, one in enumerate(maps) for place in one.missing]
    total = sum(len(one.directions) for one in maps)
    with stdout_kept_clean(), StageProgress() as bars:
        bars(STAGE, 1.0 - len(waiting) / total, f"{total - len(waiting)} of {total} directions")
        searches = [asked[number][1][place] for number, place in waiting]
        done = search_directions(searches, jobs=jobs or usable_cores())
        for count, (index, found) in enumerate(done, total - len(waiting) + 1):
            number, place = waiting[index]
            maps[number] = maps[number].with_found(place, found)
            if kept is not None:
                kept.keep(maps)
            interruption.check()
            bars(STAGE, count / total, _remark(count, total, maps[number], place, found))
        if kept is not None and draw:
            from manikin.products import write_push_map_figure

            write_push_map_figure(maps, asked[0][1][0].trials, kept.figures)
    if json:
        print_json(maps_as_dict(maps))
    else:
        _print_maps(maps)
        if directory is not None:
            typer.echo(f"files in {directory}", err=True)
    return DONE


def _remark(count: int, total: int, one: "PushMap", place: int, found: "HeldImpulse") -> str:
    held = "none" if found.held is None else f"{found.held:.1f} N.s"
    return f"{count} of {total} directions; {held} towards {one.directions[place]:g} deg"


def _print_maps(maps: "list[PushMap]") -> None:
    """Directions and the largest impulses held, one column per map."""
    from manikin.simulation.push_conditions import told_apart

    common, names = told_apart([one.conditions for one in maps])
    typer.echo(f"largest impulse that is held [N.s]: {common}")
    rows = [["towards [deg]", *(name or "held" for name in names)]]
    for place, direction in enumerate(maps[0].directions):
        rows.append([f"{direction:g}", *(_impulse(one.found[place]) for one in maps)])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        typer.echo("  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)))


def _impulse(found: "HeldImpulse | None") -> str:
    if found is None or found.held is None:
        return "-"
    return f"{found.held:.1f}" if found.beyond is not None else f">= {found.held:.1f}"
