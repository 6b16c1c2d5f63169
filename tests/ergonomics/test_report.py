"""Everything in one report, of our motions and of recordings."""

import csv
import io
import json

import numpy as np
import pytest

from manikin.body import insect, kudoh
from manikin.body.strength import carrying
from manikin.ergonomics import Circumstances, ergonomics_of, upright_neck
from manikin.ergonomics.load_report import ergonomics_in_short, load_lines
from manikin.errors import BodyError, InputError
from manikin.recordings import motion_of, read_recording, reconstruct
from manikin.runtime.files import to_json

from .conftest import posture, still

ELBOWS = ("left_elbow_flexion", "right_elbow_flexion")


def test_standing_is_acceptable(body):
    """Hanging arms: RULA 2 (the straight elbow costs one), REBA 1, negligible."""
    found = ergonomics_of(body, still(body, body.standing_posture()))
    assert found.posture.rula.score.tolist() == [2] * 21
    assert found.posture.reba.score.tolist() == [1] * 21
    report = found.as_dict()
    assert report["rula"]["share_of_time"] == {"1": 1.0, "2": 0.0, "3": 0.0, "4": 0.0}
    assert report["reba"]["action"] == "negligible"
    assert report["strength"] is None
    assert report["missing"]["strength"] == "the motion has no joint torques"
    assert report["missing"]["margin"] == "the motion has no margin"


def test_a_load_raises_both_scores(body):
    motion = still(body, body.standing_posture())
    plain, loaded = (
        ergonomics_of(body, motion, given=given)
        for given in (None, Circumstances(load_kg=15.0, coupling="poor", repeated=True, rapid=True))
    )
    assert loaded.posture.rula.score[0] > plain.posture.rula.score[0]
    assert loaded.posture.reba.score[0] >= plain.posture.reba.score[0] + 2


def test_report_and_series_of_a_run(finished_run):
    """Plain JSON, and a table with a row per frame that reads back as it was written."""
    found = ergonomics_of(finished_run.body, finished_run.executed, schedule=finished_run.schedule)
    report = json.loads(to_json(found.as_dict()))
    assert report["missing"] == {}
    assert report["frames"] == len(finished_run.executed.time)
    assert sum(report["reba"]["share_of_time"].values()) == pytest.approx(1.0)
    assert report["margin"]["reproduced"] is False  # the motion's margins are made up
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == len(found.time)
    series = found.series()
    assert list(rows[0]) == list(series)
    last = np.array([float(value or "nan") for value in rows[-1].values()])
    np.testing.assert_allclose(last, [column[-1] for column in series.values()], rtol=1e-5, atol=1e-6)


def test_one_frame_is_enough(body):
    q = body.standing_posture()
    motion = still(body, q, duration=0.0, rate=1.0, tau=np.ones(body.nv))
    report = ergonomics_of(body, motion).as_dict()
    assert report["rula"]["mean"] == 2.0
    assert report["strength"]["max_share"] > 0.0
    assert report["effort"] is None


def test_other_bodies(finished_run):
    """Kudoh's body is scored as a human is; an insect has joints and strength but no such scores."""
    standing = ergonomics_of(kudoh(), still(kudoh(), kudoh().standing_posture()))
    assert standing.posture.reba.score[0] == 1
    creature = insect()
    motion = still(creature, creature.zero_posture(), tau=np.ones(creature.nv), contacts=())
    found = ergonomics_of(creature, motion)
    assert found.posture is None
    assert "RULA and REBA are of humans" in found.missing["posture"]
    assert found.strength is not None
    with pytest.raises(BodyError, match="not those of body 'insect'"):
        ergonomics_of(creature, finished_run.planned)


def test_a_recording_that_says_nothing_of_the_trunk_has_no_scores(body):
    """Legs alone tell nothing of arms and back; a head that was not seen is only noted."""
    motion = still(body, body.standing_posture())
    legs = ergonomics_of(body, motion, untold=("lumbar", "thorax", "neck"))
    assert legs.posture is None
    assert "says nothing about the trunk" in legs.as_dict()["missing"]["posture"]
    headless = ergonomics_of(body, motion, untold=("neck",))
    assert headless.posture is not None
    assert headless.as_dict()["untold"] == ["neck"]


@pytest.mark.parametrize(
    ("values", "message"),
    [({"load_kg": -1.0}, "load"), ({"load_pattern": "often"}, "valid: intermittent, static, shock"),
     ({"coupling": "glue"}, "valid: good, fair, poor, unacceptable"), ({"neck_upright_deg": 90.0}, "neck")],
)  # fmt: skip
def test_circumstances_out_of_their_range_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        Circumstances(**values)


@pytest.fixture(scope="module")
def picked_up():
    """Somebody stands, stoops to a box on the ground, lifts it and stands (recorded)."""
    from pathlib import Path

    folder = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "mocap"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this repository")
    found = reconstruct(read_recording(folder / "accad_male1_bvh" / "Male1_A5_PickUpBox.bvh"))
    neck = float(np.rad2deg(upright_neck(found.body, found.q)))
    return ergonomics_of(found.body, motion_of(found), given=Circumstances(neck_upright_deg=neck)), neck


def test_a_recorded_pick_up_is_bad_where_it_stoops(picked_up):
    """Standing before and after is acceptable or nearly so; bent by more than 60 degrees the risk is high."""
    found, neck = picked_up
    rula, reba, angles = found.posture.rula, found.posture.reba, found.posture.angles
    assert 10.0 < neck < 30.0
    stooped = np.rad2deg(angles.trunk_flexion) > 60.0
    upright = np.abs(np.rad2deg(angles.trunk_flexion)) < 5.0
    assert stooped.sum() > 20
    assert upright.sum() > 60
    assert rula.score[stooped].min() >= 6
    assert reba.score[stooped].min() >= 4
    assert np.median(reba.score[stooped]) >= 8
    assert rula.score[upright].max() <= 3
    assert reba.score[upright].max() <= 2
    assert found.posture.bearing.source == "heights of the soles"
    assert found.strength is None


def test_a_run_keeps_the_worst_of_a_person_in_short(finished_run):
    """Its values are those of the whole report; a creature has none."""
    report = ergonomics_of(finished_run.body, finished_run.executed, schedule=finished_run.schedule)
    whole = report.as_dict()
    short = ergonomics_in_short(finished_run.body, finished_run.executed, finished_run.schedule)
    assert short["rula_max"] == whole["rula"]["max"]
    assert short["owas_code"] == whole["owas"]["code"]
    assert short["l5s1_max_compression_N"] == whole["low_back"]["max_compression_N"]
    assert short["lifting_index"] is None
    assert short["capable_min_share"]["female"] == whole["capable"]["female"]["min_share"]
    creature = insect()
    assert ergonomics_in_short(creature, still(creature, creature.zero_posture(), contacts=())) is None


def test_a_lift_is_told_in_a_line_and_what_is_none_is_a_reason(body):
    """With a load in one hand the report says why there is no index."""
    frames = [posture(body, **dict.fromkeys(ELBOWS, angle)) for angle in (20.0, 100.0)]
    for hand, missing in (("both", None), ("left", "the load is in one hand")):
        carrier = carrying(body, 8.0, hand)
        motion = still(carrier, np.array(frames), duration=1.0, rate=1.0)
        report = ergonomics_of(carrier, motion, given=Circumstances(load_kg=8.0, lifts_per_minute=4.0))
        told = report.as_dict()
        assert told["missing"].get("lifting") == missing
        lines = load_lines(told)
        assert ("lifting index" in lines) == (missing is None)
        assert {"OWAS", "static postures", "low back L5/S1"} <= set(lines)
        if missing is None:
            lift = told["lifting"]
            assert lift["index"] == pytest.approx(8.0 / lift["recommended_kg"])
            assert lift["origin"]["multipliers"]["frequency"] == 0.84
            assert f"{lift['index']:.2f}: 8.0 kg" in lines["lifting index"]


def test_a_recorded_pick_up_loads_the_back_where_it_stoops(picked_up):
    """Without force plates: near the weight of the trunk in standing, several times as much bent forward."""
    found, _ = picked_up
    back, angles = found.loads.low_back, np.rad2deg(found.posture.angles.trunk_flexion)
    assert back.known.all()
    standing = np.median(back.compression[np.abs(angles) < 5.0])
    stooped = np.median(back.compression[angles > 60.0])
    assert 400.0 < standing < 1000.0
    assert 2000.0 < stooped < 5000.0
    assert found.loads.lifting is None
