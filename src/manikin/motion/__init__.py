"""Whole-body motions in time, and the file they are kept in."""

from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.motion.motion import Motion

__all__ = ["ConfigurationSpline", "Motion"]
