"""Scenarios made from values: one walk, one push."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate

Place = tuple[float, float, float]
"""x [m], y [m] and heading [deg, counter-clockwise from x]."""


def walk_task(
    to: Place, *, start: Place = (0.0, 0.0, 0.0), body: Mapping[str, Any] | None = None,
    max_speed: float | None = None, weights: str | None = None, around: Scenario | None = None,
    execute: bool = False,
) -> Scenario:  # fmt: skip
    """A walk to a place; ScenarioError if a value is out of its range.

    Args:
        body: Section ``body`` of the scenario; its default when omitted.
        max_speed: Limit of the speed over the floor [m/s].
        weights: Weights of the path's criterion, by name.
        around: Scenario whose obstacles stand there.
        execute: In balance, and in the physics engine.
    """
    given = {"max_speed_m_s": max_speed, "weights": weights, "whole_body": None if execute else "recorded"}
    ends = {"start": start, "goal": to}
    data: dict[str, Any] = {
        "name": "walk-to-" + "-".join(f"{value:g}" for value in to),
        "walking": {key: value for key, value in given.items() if value is not None},
        "task": {end: {"at": list(place[:2]), "heading_deg": place[2]} for end, place in ends.items()},
    }
    if body is not None:
        data["body"] = dict(body)
    if around is not None:
        kept = around.file.model_dump(mode="json", exclude_none=True)
        data |= {"scene": kept["scene"], "floor_height_m": around.file.floor_height_m}
    folder = Path() if around is None else around.folder
    return Scenario(validate(ScenarioFile, data, "manikin walk"), "manikin walk", folder, {})


def push_task(
    force: float, direction: float, *, duration: float = 0.1, name: str | None = None,
    body: Mapping[str, Any] | None = None, recovery: Mapping[str, Any] | None = None,
    where: Mapping[tuple[str | int, ...], str] | None = None,
) -> Scenario:  # fmt: skip
    """A push of a standing body, which lasts until that may rest again; InputError if out of range.

    Args:
        force: [N].
        direction: Of the force, counter-clockwise from the body's forward axis [deg].
        duration: Of the push [s].
        body: Section of the scenario; its defaults when omitted.
        recovery: The same.
        where: What messages call the values, by key.
    """
    from manikin.simulation.push_search import PUSH_BEGINS, run_duration  # loads the engine

    data: dict[str, Any] = {
        "name": name or f"push-{force:g}N-{direction:g}deg",
        "body": dict(body or {}),
        "recovery": {"duration_s": run_duration(duration), **(recovery or {})},
        "push": {"force_N": force, "direction_deg": direction, "duration_s": duration, "at_s": PUSH_BEGINS},
    }
    names = dict(where or {})
    return Scenario(validate(ScenarioFile, data, "push", names), "push", Path.cwd(), names)
