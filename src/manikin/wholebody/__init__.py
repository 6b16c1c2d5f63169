"""Whole-body motion: swings, their search, and the motion that joins them."""
