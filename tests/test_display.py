"""Values print as one line, whatever they hold."""

import numpy as np
import pytest

from manikin.balance import evaluate_balance, wrench_polytope
from manikin.body import human
from manikin.contact import Stance, sole
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.runtime.display import Displayed, html_table
from manikin.scenarios import load_scenario


def motion(samples: int) -> Motion:
    return Motion(
        np.arange(samples) * 0.01, np.zeros((samples, 8)), np.zeros((samples, 7)), np.zeros((samples, 7)),
        np.zeros((samples, 7)), np.zeros((samples, 3)), np.zeros((samples, 3)), np.zeros(samples),
        np.zeros((samples, 1), dtype=bool), np.zeros((samples, 1, 6)), ("left_foot",), ("knee",),
    )  # fmt: skip


def values() -> list[Displayed]:
    scenario = load_scenario("platform")
    feet = [
        sole(f"{side}_foot", (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)
        for side, y in (("left", 0.1), ("right", -0.1))
    ]
    stance = Stance(feet, 1500.0)
    walk = motion(1000)
    return [
        human(), scenario, scenario.build_scene(), scenario.build_sequence(), feet[0], stance,
        wrench_polytope(stance), evaluate_balance(stance, 79.0, (0.0, 0.0, 0.9)), walk,
        MotionFile(planned=walk, body=human()),
    ]  # fmt: skip


@pytest.mark.parametrize("value", values(), ids=lambda value: type(value).__name__)
def test_a_value_prints_as_one_line_of_less_than_200_characters(value: Displayed) -> None:
    line = repr(value)
    assert line.startswith(f"{type(value).__name__}(")
    assert "\n" not in line
    assert len(line) < 200
    assert value._repr_html_().startswith("<table>")


def test_text_of_a_table_cannot_become_markup() -> None:
    assert "<b>" not in html_table("<b>", {"<b>": "<b>"})


def test_a_motion_as_a_table_has_one_row_for_each_sample_and_units_in_the_header() -> None:
    frame = motion(5).to_frame()
    assert frame.index.name == "time_s"
    assert np.allclose(frame.index, [0.0, 0.01, 0.02, 0.03, 0.04])
    assert {"com_x_m", "margin_N.m", "knee_rad", "left_foot_force_z_N"} <= set(frame.columns)
