"""The problems of the centre-of-mass planners that a scenario states."""

import numpy as np

from manikin.centroidal import (
    CentroidalProblem,
    GeometricConstraint,
    KeyframeProblem,
    KeyPlane,
    Weights,
    height_band,
)
from manikin.contact import StanceSequence
from manikin.errors import InputError, ScenarioError
from manikin.scenarios.overhead import overhead_constraints
from manikin.scenarios.recordings import load_recording
from manikin.scenarios.sequence import stance_sequence
from manikin.scenarios.values import ScenarioValues
from manikin.scenarios.world import build_body, build_scene
from manikin.spatial import IDENTITY


def centroidal_problem(values: ScenarioValues) -> CentroidalProblem:
    """Build the problem of the timing-free planner, with every height scaled to the body.

    The phases at the end in which the body sits are left out: there the centre of mass is
    not what keeps the balance ([Qiu2012]_ 7.2.2).

    Raises:
        ScenarioError: If the supports or a centre of mass are missing, or a value is out of range.
    """
    options, seat = values.planning, values.seated_from
    rest = (0.0, 0.0, 0.0) if options.zero_end_accelerations else None
    given = {"degree": options.degree, "samples": options.samples}
    try:
        return CentroidalProblem(
            values.moved_mass,
            _standing(values, planning=True),
            values.start_com,
            values.goal_com,
            goal_velocity=values.file.task.goal.velocity_m_s if seat is not None else (0.0, 0.0, 0.0),
            start_acceleration=rest,
            goal_acceleration=rest if seat is None else None,
            margin_space=options.margin_space,
            required_margin=values.required_margin,
            support_distance=values.max_support_distance,
            geometric=_height_constraints(values),
            key_planes=_key_planes(values),
            max_duration=options.max_duration_s,
            weights=Weights(**options.weights.model_dump(exclude_none=True)),
            **{key: value for key, value in given.items() if value is not None},
        )
    except ScenarioError:
        raise
    except InputError as error:
        raise values.refused(("planning",), error) from None


def keyframe_problem(values: ScenarioValues) -> KeyframeProblem | None:
    """Build the problem of the keyframe-based planner; None when the file asks for another one.

    Raises:
        ScenarioError: If the recording cannot be read or was made on other supports.
    """
    options = values.planning
    if options.method != "keyframes" or options.recording is None:
        return None
    path, sequence = values.find_file(options.recording), stance_sequence(values, planning=True)
    try:
        frame = options.recording_frame
        recording = load_recording(
            path, sequence, values.file.body.stature_m, values.support_level(),
            IDENTITY if frame is None else frame.transform_to_world(),
        )  # fmt: skip
        return KeyframeProblem.of(centroidal_problem(values), recording, options.control_points)
    except ScenarioError:
        raise
    except InputError as error:
        raise values.refused(("planning", "recording"), error) from None


def _standing(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """The stances before the body sits: all, where it does not."""
    sequence = stance_sequence(values, planning=planning)
    return StanceSequence(sequence.phases[: values.seated_from])


def _key_planes(values: ScenarioValues) -> tuple[KeyPlane, ...]:
    """Faces of the boxes in which phases want the centre of mass to be when they begin."""
    planes: list[KeyPlane] = []
    for key, phase in enumerate(values.explicit_supports().phases[: values.seated_from]):
        if phase.com_near is None:
            continue
        for axis, (middle, room) in enumerate(zip(phase.com_near, phase.com_within_m, strict=True)):
            planes += [KeyPlane(key, sign * np.eye(3)[axis], sign * middle + room) for sign in (1.0, -1.0)]
    return tuple(planes)


def _height_constraints(values: ScenarioValues) -> tuple[GeometricConstraint, ...]:
    band, entry = values.height_band, values.constraint("overhead")
    found = () if band is None else height_band(band.lower, band.upper)
    if entry is None or entry.overhead is None:
        return found
    names = None if entry.overhead == "automatic" else tuple(entry.overhead)
    overhead = overhead_constraints(
        build_body(values),
        build_scene(values),
        _standing(values),
        (values.start_com, values.goal_com),
        names,
    )
    return (*found, *overhead)
