"""Samples in files: the same again for the same body, a clear error for another one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human, insect
from manikin.errors import BodyError
from manikin.planning.contacts import load_samples, sample_limb, sample_limbs, samples_for, save_samples

FIELDS = ("origin", "angles", "positions", "rotations", "products")


@pytest.fixture(scope="module")
def few(person):
    return sample_limbs(person, np.random.default_rng(4), 60, natural=True)


def test_samples_come_back_bit_for_bit(person, few, tmp_path):
    save_samples(tmp_path / "s.npz", few, person)
    again = load_samples(tmp_path / "s.npz", person)
    assert list(again) == list(few)
    for name, item in few.items():
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(again[name], field), getattr(item, field))
            assert not getattr(again[name], field).flags.writeable
        assert (again[name].limb, again[name].segment) == (item.limb, item.segment)
        assert (again[name].threshold, again[name].natural) == (item.threshold, True)


def test_mirrored_limbs_share_their_samples_in_the_file(person, few, tmp_path):
    save_samples(tmp_path / "s.npz", few, person)
    with np.load(tmp_path / "s.npz") as archive:
        kept = {key.split("/")[0] for key in archive.files if "/" in key}
    assert kept == {"left_arm", "left_leg", "left_knee", "left_elbow"}


@pytest.mark.parametrize("other", [human(1.75, 79.0), human(1.76, 79.0), insect()])
def test_samples_of_another_body_are_refused(person, few, tmp_path, other):
    """Without knees and elbows, of another stature, or quite another creature."""
    save_samples(tmp_path / "s.npz", few, person)
    with pytest.raises(BodyError, match=r"is about another body .'human'.*valid: samples of this"):
        load_samples(tmp_path / "s.npz", other)


def test_samples_are_made_once(person, tmp_path):
    file = tmp_path / "s.npz"
    first = samples_for(file, person, np.random.default_rng(1), 50)
    again = samples_for(file, person, np.random.default_rng(2), 50)
    np.testing.assert_array_equal(first["right_arm"].positions, again["right_arm"].positions)
    with pytest.raises(BodyError, match=r"holds 50 samples of .*; valid: 60 samples of"):
        samples_for(file, person, np.random.default_rng(1), 60)
    with pytest.raises(BodyError, match="valid: 50 natural samples of"):
        samples_for(file, person, np.random.default_rng(1), 50, natural=True)


def test_misuse_is_refused(person, creature, few, tmp_path):
    with pytest.raises(BodyError, match="no limb 'left_arm'"):
        save_samples(tmp_path / "s.npz", few, creature)
    arm = sample_limb(person, few["left_arm"].limb, np.random.default_rng(0), 5)
    with pytest.raises(BodyError, match="not of this body's limb"):
        save_samples(tmp_path / "s.npz", {"right_arm": arm}, person)
    with pytest.raises(BodyError, match="does not exist"):
        load_samples(tmp_path / "none.npz", person)
    assert list(tmp_path.iterdir()) == []


@given(st.floats(0.0, 1.0), st.binary(max_size=20))
def test_a_damaged_file_is_refused_or_the_same(person, few, tmp_path, place, junk):
    """Cut short or with other bytes in the middle; the archive's check sums notice."""
    file = tmp_path / "s.npz"
    save_samples(file, few, person)
    whole = file.read_bytes()
    at = int(place * (len(whole) - 1))
    file.write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
    message = ""
    try:
        again = load_samples(file, person)
        np.testing.assert_array_equal(again["left_arm"].angles, few["left_arm"].angles)
    except BodyError as error:
        message = str(error)
    assert "\n" not in message
