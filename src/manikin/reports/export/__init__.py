"""Motions for other programs: BVH and CSV."""

from manikin.reports.export.write import BVH_RATE, FORMATS, check_format, export_motion, pick_motion

__all__ = ["BVH_RATE", "FORMATS", "check_format", "export_motion", "pick_motion"]
