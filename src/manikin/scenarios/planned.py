"""Scenarios made from values: footprints of a walk, one walk, one push."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from manikin.contact import Contact
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate
from manikin.scenarios.world import flat_sequence
from manikin.walking.footprints import FEET, Footprint, Footprints

STATURE = 1.75
"""Stature of the body that the lengths here are for [m]."""
COM_HEIGHT = 0.96
"""Centre of mass of a person who stands before and after a walk, above the floor ([Qiu2012]_ 5.4.4) [m]."""
COM_BAND = (0.92, 0.97)
"""Heights of the CoM in a walk, knees neither locked nor deeply bent; our choice, as the next ones [m]."""
WALKED_MAX_SUPPORT_DISTANCE = 0.985
"""Largest distance of the CoM from the middle of a sole that stands [m]."""
LEAST = {1: 0.4, 2: 0.15}
"""Least durations of supports on one and two feet; a support that lasts longer in the walk lasts as long in
the plan ([Qiu2012]_ 5.4.4). Feet that roll need about 0.26 s on both [s]."""
STANDING = 0.3
"""Least duration of the first and the last support [s]."""
MARGIN = 10.9
"""Margin about the CoM that the plan of a walk must keep, of a person of 1.75 m and 70 kg [N.m]."""
WEIGHTS: dict[str, Any] = {
    "margin": 1.0,
    "smoothness": 10.0,
    "duration": 2.0,
    "acceleration": [1.0, 1.0, 1.0],
}
WALKED_PLANNING: Mapping[str, Any] = {"degree": 4, "samples": 4, "weights": WEIGHTS}
"""Options of the planner: phases are short, so that few samples in each are enough."""
_SAME_PLACE = 0.002


def walking_supports(footprints: Footprints, scenario: Scenario) -> Scenario:
    """A scenario in which the body walks on given footprints, from standing to standing on a level floor.

    Friction, soles and force caps are those of the scenario's supports where it has some; its supports, task,
    constraints on the centre of mass and options of the planner, but the friction model, are replaced. The
    centre of mass starts and ends above the middle between the feet; durations are bounded by those of the
    walk, from below only.
    InputError if the footprints begin and end at different heights.
    """
    first, last = _middle(footprints.first()), _middle(footprints.last())
    if abs(first[2] - last[2]) > _SAME_PLACE:
        raise InputError(f"footprints rise by {last[2] - first[2]:.3f} m; valid: a walk on a level floor")
    scale = (scenario.file.reference_stature_m or scenario.file.body.stature_m) / STATURE
    lower, upper = (first[2] + scale * height for height in COM_BAND)
    return scenario.replaced(
        supports=_settings(scenario) | {"phases": _phases(footprints)},
        contacts=None,
        task={
            end: {"com": [float(x), float(y), float(z + scale * COM_HEIGHT)]}
            for end, (x, y, z) in (("start", first), ("goal", last))
        },
        com_constraints=[
            {"height_band": {"lower": f"{lower:.6g}", "upper": f"{upper:.6g}"}},
            {"max_support_distance_m": scale * WALKED_MAX_SUPPORT_DISTANCE},
        ],
        planning={
            **WALKED_PLANNING,
            "min_margin": walk_margin(scenario),
            "friction_model": scenario.file.planning.friction_model,
        },
        manner="walking",
    )


def walk_before(footprints: Footprints, scenario: Scenario) -> Scenario:
    """A scenario with a walk before its own supports, all in one motion.

    The walk ends on the first stance of the supports, from which the plan continues; no stop is asked for.
    The constraints on the centre of mass stay; it starts as high as in the scenario. InputError if this has
    no supports that begin on both feet, or the walk ends elsewhere.
    """
    own = scenario.explicit_supports()
    stance = {contact.effector: contact for contact in flat_sequence(scenario)[0].stance}
    last = footprints.last()
    for foot in FEET:
        _check_end(last[foot], stance.get(foot))
    start = _middle(footprints.first())
    start[2] += scenario.start_com[2] - scenario.start_level
    if scenario.file.reference_stature_m is not None:
        start[2] = scenario.start_level + (start[2] - scenario.start_level) / scenario.stature_scale
    phases = [phase.model_dump(mode="json", exclude_none=True) for phase in own.phases]
    task = scenario.file.task.model_dump(mode="json", exclude_none=True)
    planning = scenario.file.planning.model_dump(mode="json", exclude_none=True)
    planning.pop("max_duration_s", None)
    # The stance at the seam is the last of the walk; its places are those of the plan.
    walked = _phases(footprints)
    walked[-1]["min_duration_s"] = max(walked[-1]["min_duration_s"], phases[0]["min_duration_s"])
    for foot in FEET:
        landing = [phase for phase in walked if phase.get(foot) not in (None, "same")][-1]
        landing[foot] = phases[0][foot]
    margin = min(scenario.file.planning.min_margin, walk_margin(scenario))
    return scenario.replaced(
        supports=_settings(scenario) | {"phases": [*walked, *phases[1:]]},
        task={**task, "start": {"com": start.tolist()}},
        planning={**planning, **WALKED_PLANNING, "min_margin": margin},
        manner="walking",
    )


def walk_margin(scenario: Scenario, margin: float = MARGIN) -> float:
    """The margin of a walk, for the body that the scenario's own margin is for [N.m]."""
    mass = scenario.file.reference_mass_kg or scenario.mass
    stature = scenario.file.reference_stature_m or scenario.file.body.stature_m
    return margin * mass / 70.0 * stature / STATURE


def _settings(scenario: Scenario) -> dict[str, Any]:
    """Friction, soles and caps of the scenario's supports, or those of its body; feet that roll."""
    supports = scenario.file.supports
    if supports is not None:
        return supports.model_dump(mode="json", exclude_none=True) | {"foot": "rolling"}
    scale = scenario.file.body.stature_m / STATURE
    friction = scenario.contacts.friction
    sole = scenario.sole
    size = {"length_m": 0.28 * scale, "width_m": 0.12 * scale} if sole is None else sole.model_dump()
    return {"friction": friction, "sole": size, "foot": "rolling"}


def _phases(footprints: Footprints) -> list[dict[str, Any]]:
    phases: list[dict[str, Any]] = []
    before: dict[str, Footprint] = {}
    for held, seconds in footprints.phases():
        phase: dict[str, Any] = {}
        for foot, step in held.items():
            entry = {"position": step.position.tolist(), "yaw_deg": math.degrees(step.yaw)}
            phase[foot] = "same" if before.get(foot) is step else entry
        phases.append(phase | {"min_duration_s": max(LEAST[len(held)], seconds)})
        before = held
    phases[0]["min_duration_s"] = phases[-1]["min_duration_s"] = STANDING
    return phases


def _check_end(step: Footprint, contact: Contact | None) -> None:
    if contact is None:
        raise InputError(f"footprints end with {step.effector} on the floor, the plan goes on without it; "
                         "valid: supports that begin on both feet")  # fmt: skip
    gap = float(np.abs(step.position - contact.position).max())
    turn = abs(math.remainder(step.yaw - contact.yaw, 2.0 * math.pi))
    if max(gap, turn) > _SAME_PLACE:
        raise InputError(
            f"footprints end with {step.effector} {gap:.3g} m and {math.degrees(turn):.3g} degrees from "
            "where the plan goes on; valid: on the same place"
        )


def _middle(held: Mapping[str, Footprint]) -> FloatArray:
    return np.mean([step.position for step in held.values()], axis=0)


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
    given = {"max_speed_m_s": max_speed, "weights": weights, "whole_body": "balanced" if execute else None}
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
