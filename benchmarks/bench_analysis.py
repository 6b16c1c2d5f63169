"""What the analysis of a recording costs: the numbers, the sheet, the files."""

from pathlib import Path

import pytest

from manikin.analysis import analyze, analyze_file
from manikin.recordings import read_recording
from manikin.reports.analysis_directory import write_analysis
from manikin.reports.analysis_sheet import recording_sheet

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data" / "mocap"
FILES = ("cmu_asf_amc/14_21.amc", "accad_male1_bvh/Male1_B3_Walk.bvh", "grf/btkdata/FunctionalWalk.c3d")

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the recordings are not beside this repository")


@pytest.mark.parametrize("name", FILES)
def test_numbers(benchmark, name):
    recording = read_recording(FOLDER / name)
    found = benchmark.pedantic(analyze, (recording,), rounds=5, warmup_rounds=1)
    benchmark.extra_info["recorded_s"] = found.motion.duration


@pytest.mark.parametrize("name", FILES)
def test_sheet(benchmark, name):
    found = analyze_file(FOLDER / name)
    benchmark.pedantic(recording_sheet, (found, "the recording"), rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("name", FILES)
def test_files(benchmark, name, tmp_path):
    found = analyze_file(FOLDER / name)
    benchmark.pedantic(write_analysis, (found, tmp_path / "out"), {"draw": False}, rounds=5, warmup_rounds=1)
