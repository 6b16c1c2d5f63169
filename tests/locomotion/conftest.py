"""Walks that several tests of this room share."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.locomotion import walking_path
from manikin.spline import BSpline


@pytest.fixture(scope="session")
def aside():
    """A path of 1.2 m to the left that keeps its heading, in 6 s from rest to rest."""
    path = walking_path((0, 0, 0), (0, 1.2, 0), max_speed=0.6)
    share = np.linspace(0.0, 1.0, 200)
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    places = np.column_stack([0.0 * share, 1.2 * way, 0.0 * share])
    spline = BSpline.fit(path.spline.degree, path.spline.knots, share, places)
    return replace(path, spline=spline, duration=6.0)
