"""The strip of a recorded motion shows its supports."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from manikin.body import human
from manikin.errors import FigureError
from manikin.kinematics import PointTargets
from manikin.recordings import Reconstruction, RecordedSupports, Support

spec = importlib.util.spec_from_file_location(
    "support_strip", Path(__file__).resolve().parents[3] / "docs/support_strip.py"
)
docs = importlib.util.module_from_spec(spec)
spec.loader.exec_module(docs)


@pytest.fixture(scope="module")
def stood():
    """A second of standing, on the right foot alone from the middle on, the left knee down at the end."""
    body = human(1.75, 75.0)
    time = np.arange(21) / 20.0
    q = np.tile(body.standing_posture(), (21, 1))
    targets = PointTargets(("pelvis",), ("pelvis",), np.zeros((1, 3)), q[:, None, :3], np.ones(1))
    place = np.zeros(3)
    spans = (("left_foot", 0.0, 0.5), ("right_foot", 0.0, 1.0), ("left_knee", 0.8, 1.0))
    supports = tuple(Support(name, a, b, place, place, place, a > 0.0, b < 1.0) for name, a, b in spans)
    return Reconstruction(body, time, q, targets, np.zeros((21, 1))), RecordedSupports(
        supports, 0.0, 1.0, (0.0,)
    )


def test_a_strip_has_a_bar_for_each_support(stood):
    found, supports = stood
    _, heights, bars = docs.support_strip_figure(found, supports, "stood").axes
    names = [label.get_text() for label in bars.get_yticklabels()]
    assert names == ["left foot", "right foot", "left hand", "right hand", "left knee"]
    drawn = [[path.get_extents().intervalx for path in row.get_paths()] for row in bars.collections]
    assert [len(row) for row in drawn] == [1, 1, 0, 0, 1]
    np.testing.assert_allclose(drawn[0][0], [0.0, 0.5])
    np.testing.assert_allclose(drawn[4][0], [0.8, 1.0])
    assert heights.get_xlim() == bars.get_xlim() == (0.0, 1.0)


def test_a_strip_shows_a_part(stood):
    found, supports = stood
    assert docs.support_strip_figure(found, supports, "stood", (0.2, 0.6)).axes[2].get_xlim() == (0.2, 0.6)


def test_a_strip_of_no_instant_is_refused(stood):
    found, supports = stood
    with pytest.raises(FigureError, match="valid: from 0 to 1 s"):
        docs.support_strip_figure(found, supports, "stood", (2.0, 3.0))
