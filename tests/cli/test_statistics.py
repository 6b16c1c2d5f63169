"""``manikin statistics``: tables, JSON and figures of recordings and of the published motions."""

import json
from pathlib import Path

import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE


def test_published_motions_need_no_file(capsys, tmp_path):
    assert main(["statistics", "--published", "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["groups"]["H3C1"]["durations"]["number"]["DS-3"]["mean_s"] == pytest.approx(0.578, abs=1e-3)
    assert found["com_lowest_m"] == {"H1": 0.85, "H2": 0.80, "H3": 0.65}
    assert main(["statistics", "--published", "--out", str(tmp_path / "q")]) == DONE
    assert "SS-3" in capsys.readouterr().out
    rows = (tmp_path / "q" / "phases.csv").read_text().splitlines()
    assert len(rows) == 1 + 28 * 6 + 2 * 8 + 1  # and the last double support of one motion
    for name in ("phase_durations", "com_heights", "com_distances"):
        assert (tmp_path / "q" / "figures" / f"{name}.png").stat().st_size > 10_000


def test_the_good_file_is_measured_and_the_bad_one_told(capsys, tmp_path):
    folder = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "mocap"
    good = folder / "accad_male1_bvh" / "Male1_B3_Walk.bvh"
    if not good.exists():
        pytest.skip("the real recordings are not beside this repository")
    (tmp_path / "bad.bvh").write_text("no motion")
    out = tmp_path / "found"
    words = ["statistics", f"walk={good}", f"{tmp_path}/*.bvh", "--bar", "1.5", "--out", str(out), "--json"]
    assert main(words) == BAD_INPUT
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert list(found["groups"]) == ["walk"]
    assert found["groups"]["walk"]["durations"]["kind"]["SS"]["count"] > 2
    assert len(found["refused"]) == 1
    assert sum(line.startswith("manikin: ") for line in captured.err.splitlines()) == 1
    assert json.loads((out / "statistics.json").read_text()) == found
    assert (out / "figures" / "placements.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "no FILE is given"),
        (["nowhere/*.amc"], "no recording there"),
        (["a.bvh", "--published"], "FILE does not go with this run"),
        (["a.bvh", "--by", "size"], "'--by': 'size' is not one of 'number'"),
        (["a.bvh", "--origin", "here"], "'--origin': 'here' is not one of 'stance'"),
        (["a.bvh", "--effectors", "hands"], "'--effectors': 'hands' is not one of 'all'"),
        (["a.bvh", "--limit", "-1"], "--limit"),
        (["a.bvh", "--bar", "1", "--box", "0", "1", "0", "1", "2"], "a box is given"),
        (["a.bvh", "--sex", "none"], "'--sex': 'none' is not one of 'male'"),
        (["a.bvh"], "a.bvh"),
    ],
)
def test_mistakes_are_told_in_one_line(capsys, words, told):
    assert main(["statistics", *words]) == BAD_INPUT
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("manikin: ")]
    assert len(lines) == 1
    assert told in lines[0]
