"""Use of the machine: atomic files, signals, progress, work in processes."""

__version__ = "0.2.0"
"""Version of the library."""
