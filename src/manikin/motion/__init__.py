"""Whole-body motions in time, and the file they are kept in."""

from manikin.motion.motion import Motion

__all__ = ["Motion"]
