"""Recorded motions planned anew on their own stances, and executed ([Qiu2012]_ 5.3.3, 7.3)."""

from manikin.replan.against import against_recording
from manikin.replan.com import METHODS, Method
from manikin.replan.planned_anew import Replan, replan
from manikin.replan.window import window

__all__ = ["METHODS", "Method", "Replan", "against_recording", "replan", "window"]
