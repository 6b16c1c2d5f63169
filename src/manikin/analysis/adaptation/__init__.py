"""Recorded motions re-planned on their own stances, and executed ([Qiu2012]_ 5.3.3, 7.3)."""

from manikin.analysis.adaptation.adapt_recording import METHODS, Method, Replan, adapt_recording, crop

__all__ = ["METHODS", "Method", "Replan", "adapt_recording", "crop"]
