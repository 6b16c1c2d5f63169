"""Motions as comma-separated values, one row per sample, units in the header."""

from io import StringIO

import numpy as np

from manikin.motion import Motion

_AXES = ("x", "y", "z")


def to_csv(motion: Motion) -> str:
    """Text of a CSV file: time, pelvis, hinge angles, CoM, margin, supports, contact forces.

    Numbers have 9 significant digits; the separator is a comma, the decimal sign a point.
    """
    columns = _columns(motion)
    text = StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.9g", delimiter=",")
    return text.getvalue()


def _columns(motion: Motion) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {"time [s]": motion.time}
    for index, axis in enumerate(_AXES):
        columns[f"pelvis_{axis} [m]"] = motion.q[:, index]
    for index, axis in enumerate(("x", "y", "z", "w")):
        columns[f"pelvis_quaternion_{axis} [-]"] = motion.q[:, 3 + index]
    for index, name in enumerate(motion.joint_names):
        columns[f"{name} [rad]"] = motion.q[:, 7 + index]
    for index, axis in enumerate(_AXES):
        columns[f"com_{axis} [m]"] = motion.com[:, index]
    columns["margin [N.m]"] = motion.margin
    for number, name in enumerate(motion.contact_names):
        columns[f"{name}_support [-]"] = motion.support[:, number]
        for index, axis in enumerate(_AXES):
            columns[f"{name}_force_{axis} [N]"] = motion.contact_force[:, number, index]
        for index, axis in enumerate(_AXES):
            columns[f"{name}_moment_{axis} [N.m]"] = motion.contact_force[:, number, 3 + index]
    return columns
