"""Footprints of walks."""
