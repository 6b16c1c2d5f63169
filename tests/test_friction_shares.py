"""Every run that the tests share stays inside the friction cone that its scenario asks for.

Done last, when the runs are there; ``benchmarks/friction_shares.py`` does the same for every scenario.
"""

import json

from manikin.scenarios import load_scenario

ROUNDING = 1e-6


def test_forces_of_every_stage_of_every_run_lie_in_the_cone_that_was_asked_for(runs):
    """Planned forces and executed ones, at the worst sample: shares of the friction limit."""
    runs("platform")
    beyond, stages = {}, 0
    for file in runs.folder.glob("*/run/summary.json"):
        summary, scenario = json.loads(file.read_text()), load_scenario(file.parent / "scenario.yaml")
        for stage in ("centroidal", "wholebody", "act", "execution"):
            used = (summary.get(stage) or {}).get("friction")
            if used is not None:
                stages += 1
                assert used["model"] == scenario.contact_model.friction
                if not 0.0 <= used["max_share"] <= 1.0 + ROUNDING:
                    beyond[f"{scenario.name}, {stage}"] = used["max_share"]
    assert stages >= 3
    assert beyond == {}
