"""Sections of a scenario file, one pydantic model each; lengths are metres and angles degrees."""
