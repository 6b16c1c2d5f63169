"""The figure of scores and torque shares."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.ergonomics import ergonomics_of
from manikin.errors import FigureError
from manikin.reports.figures import ergonomics_figure


def test_scores_and_shares_are_drawn_as_they_are(finished_run):
    """A panel each for scores, low back and torques; both sides in a score's panel (6 hundredths apart)."""
    found = ergonomics_of(finished_run.body, finished_run.planned)
    figure = ergonomics_figure(found, "a title")
    rula, reba, back, shares = figure.axes
    for line, force in zip(back.get_lines(), ("compression", "shear"), strict=True):
        np.testing.assert_allclose(line.get_ydata(), getattr(found.loads.low_back, force) / 1e3)
    for axes, one in ((rula, found.posture.rula), (reba, found.posture.reba)):
        left, right = (line.get_ydata() for line in axes.get_lines())
        np.testing.assert_allclose(left - 0.06, one.sides["left"])
        np.testing.assert_allclose(right + 0.06, one.sides["right"])
    assert len(shares.get_lines()) == 5 + 2
    assert shares.get_xlabel() == "time [s]"


def test_without_torques_there_are_three_panels(finished_run):
    motion = finished_run.planned
    unknown = replace(motion, tau=np.full_like(motion.tau, np.nan))
    assert len(ergonomics_figure(ergonomics_of(finished_run.body, unknown)).axes) == 3


def test_nothing_to_draw_is_refused(finished_run):
    found = replace(ergonomics_of(finished_run.body, finished_run.planned), posture=None, strength=None)
    with pytest.raises(FigureError, match="scores or torques"):
        ergonomics_figure(found)
