"""The figure of the ways of all who walk: drawn from a run's own files."""

import json
import shutil

import numpy as np
import pytest

from manikin.errors import FigureError, MotionFileError
from manikin.pipeline.run_directory import RunRecord, read_run
from manikin.reports.figures.walks import KINDS, walk_paths_figure


@pytest.fixture(scope="module")
def caught(runs, tmp_path_factory):
    return shutil.copytree(
        runs("catch").directory,
        tmp_path_factory.mktemp("runs") / "catch",
    )


def test_everybody_is_drawn_where_the_run_says(caught):
    record = read_run(caught)
    assert set(record.walks) == {"the body", "catcher"}
    np.testing.assert_allclose(record.walks["the body"][0], [0.0, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(record.walks["the body"][-1, 1:3], [-0.07, 0.0], atol=0.01)
    figure = walk_paths_figure(record)
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    assert set(KINDS) <= labels
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {"the body, 0 s", "catcher, 0 s"} <= texts


def test_damaged_ways_are_refused_in_one_line(caught):
    file = caught / "stages" / "walk_paths.json"
    kept = file.read_text()
    try:
        file.write_text(json.dumps({"the body": {"time_s": [0.0, 1.0]}}))
        with pytest.raises(MotionFileError, match=r"walk_paths.*damaged"):
            read_run(caught)
    finally:
        file.write_text(kept)


def test_without_a_walk_there_is_no_figure(caught):
    with pytest.raises(FigureError, match="way over the floor"):
        walk_paths_figure(RunRecord("empty", read_run(caught).content))
