"""The climb between two walls: polytopes of its stances, and the plan with the force margin."""

from manikin.planning.com import plan_com
from manikin.planning.com.feasibility import polytopes_of
from manikin.scenarios import load_scenario


def test_polytopes_of_the_walls(benchmark):
    """Nineteen stances of three shapes."""
    problem = load_scenario("walls", "trial-4").build_centroidal_problem()
    polytopes = benchmark.pedantic(polytopes_of, args=(problem,), rounds=3)
    benchmark.extra_info["facets"] = max(len(polytope) for polytope in polytopes)


def test_plan_of_trial_4(benchmark):
    """Table 5.1, trial 4: the thesis needed less than a minute."""
    problem = load_scenario("walls", "trial-4").build_centroidal_problem()
    result = benchmark.pedantic(plan_com, args=(problem,), rounds=3, warmup_rounds=1)
    assert result.succeeded
    benchmark.extra_info["margin_N"] = result.d_min
    benchmark.extra_info["duration_s"] = result.trajectory.duration
