"""Use of the machine: atomic files, signals, progress, work in processes."""

__version__ = "0.1.0"
"""Version of the library."""
