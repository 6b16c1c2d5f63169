"""``manikin analyze``: reports, tables, and one line for each file that is no recording."""

import csv
import json
import math

import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, FAILED
from manikin.motion.file import read_motions
from manikin.runtime.files import LOCK


def damaged(text: str) -> dict[str, bytes]:
    """What may come instead of a recording, by file name."""
    head, motion = text.split("Frames: 60")
    return {
        "cut.bvh": text[: len(text) * 3 // 4].encode(),
        "empty.bvh": b"",
        "junk.bvh": bytes(range(256)) * 40,
        "single.bvh": (head + "Frames: 1" + "\n".join(motion.split("\n")[:3]) + "\n").encode(),
        "mislabelled.c3d": text.encode(),
        "nan.bvh": (head + "Frames: 60" + motion.replace("0.000000", "nan", 3)).encode(),
    }


def test_a_file_gets_a_report(standing_file, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["analyze", str(standing_file), "--out", str(out)]) == DONE
    shown = capsys.readouterr()
    assert "lowest margin" in shown.out
    assert "report.html" in shown.err
    assert sorted(file.name for file in out.iterdir() if file.name != LOCK) == [
        "motion.h5", "report.html", "series.csv", "summary.json",
    ]  # fmt: skip
    with (out / "series.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "time_s"
    assert len(rows) == 61
    recorded = read_motions(out).recorded
    assert recorded is not None
    assert recorded.contact_names == ("left_foot", "right_foot")
    page = (out / "report.html").read_text()
    assert page.count("<svg") == page.count("</svg>") == 1
    assert "http" not in page
    summary = json.loads((out / "summary.json").read_text())
    assert main(["analyze", str(standing_file), "--json"]) == DONE
    printed = json.loads(capsys.readouterr().out)
    assert {**printed, "wall_s": 0} == {**summary, "wall_s": 0}


def test_bad_files_are_one_line_each_and_stop_no_other(standing_file, tmp_path, capsys):
    folder, out = tmp_path / "recordings", tmp_path / "out"
    (folder / "good").mkdir(parents=True)
    text = standing_file.read_text()
    (folder / "good/standing.bvh").write_text(text)
    bad = damaged(text)
    for name, content in bad.items():
        (folder / name).write_bytes(content)
    options = ["--no-figures", "--jobs", "1"]
    assert main(["analyze", str(folder), "--out", str(out), *options]) == BAD_INPUT
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("manikin: ")]
    assert len(told) == len(bad)
    for name in bad:
        assert sum(name in line for line in told) == 1
    assert (out / "good/standing/report.html").is_file()
    with (out / "analyses.csv").open(newline="") as file:
        rows = {row["file"].split("/")[-1]: row for row in csv.DictReader(file)}
    assert len(rows) == len(bad) + 1
    assert float(rows["standing.bvh"]["margin_share_positive"]) == 1.0
    assert all(rows[name]["refused"] for name in bad)
    overview = json.loads((out / "analyses.json").read_text())
    assert len(overview["refused"]) == len(bad)
    assert "good/standing/report.html" in (out / "index.html").read_text()


@pytest.mark.parametrize(
    "name", ["cut.bvh", "empty.bvh", "junk.bvh", "single.bvh", "mislabelled.c3d", "nan.bvh"]
)
def test_a_bad_file_alone_is_one_line(standing_file, tmp_path, capsys, name):
    path = tmp_path / name
    path.write_bytes(damaged(standing_file.read_text())[name])
    assert main(["analyze", str(path), "--json"]) == BAD_INPUT
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert name in shown.err


def test_what_is_there_already_is_not_overwritten(standing_file, tmp_path, capsys):
    (tmp_path / "thesis.txt").write_text("mine")
    assert main(["analyze", str(standing_file), "--out", str(tmp_path)]) == BAD_INPUT
    assert "it is not an earlier analysis" in capsys.readouterr().err
    assert (tmp_path / "thesis.txt").read_text() == "mine"


def test_options_of_one_file_are_refused_of_several(standing_file, tmp_path, capsys):
    folder = standing_file.parent
    assert main(["analyze", str(folder), "--frames", "0", "20", "--json"]) == BAD_INPUT
    assert "--frames" in capsys.readouterr().err
    assert main(["analyze", str(standing_file), "--jobs", "2", "--json"]) == BAD_INPUT
    assert "--jobs" in capsys.readouterr().err
    assert main(["analyze", str(tmp_path / "no"), "--json"]) == BAD_INPUT
    assert "there is no such file" in capsys.readouterr().err


def test_a_map_of_markers_is_checked_before_any_recording(standing_file, tmp_path, capsys):
    file = tmp_path / "map.yaml"
    file.write_text("left_asis: M1\nleft_knee_latral: M2\n")
    assert main(["analyze", str(standing_file), "--markers", str(file), "--json"]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert "map.yaml:2: 'left_knee_latral' is no landmark or segment; valid: left_knee_lateral" in line


def test_what_no_person_does_is_named_and_is_no_success(standing_file, tmp_path, capsys):
    """A person who shoots up and down by 0.75 m at 3 Hz needs 1 + 27 body weights: (2 pi 3)^2 0.75 / 9.81."""
    head, rest = standing_file.read_text().split("Frame Time:")
    step, *rows = rest.strip().split("\n")
    moved = []
    for number, row in enumerate(rows):
        x, height, *others = row.split()
        lift = 75.0 * math.sin(2.0 * math.pi * 3.0 * number * float(step))
        moved.append(" ".join([x, f"{float(height) + lift:.6f}", *others]))
    file = tmp_path / "shaken.bvh"
    file.write_text("\n".join([f"{head}Frame Time: {step}", *moved, ""]))
    out = tmp_path / "out"
    assert main(["analyze", str(file), "--as-recorded", "--no-figures", "--out", str(out)]) == FAILED
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("implausible: ")]
    assert len(told) == 2  # the force, and that nothing carries who shakes so
    assert "external force of" in told[0]
    assert "body weights" in told[0]
    assert json.loads((out / "summary.json").read_text())["implausible"] == [
        line.split(": ", 1)[1] for line in told
    ]
    assert "Implausible" in (out / "report.html").read_text()
