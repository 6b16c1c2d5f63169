"""Scenario files: what they may hold, how they are read, what they build."""

from manikin.scenarios.load import list_scenarios, list_variants, load_scenario, load_scene
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile, json_schema

__all__ = [
    "Scenario",
    "ScenarioFile",
    "json_schema",
    "list_scenarios",
    "list_variants",
    "load_scenario",
    "load_scene",
]
