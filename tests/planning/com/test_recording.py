"""What a recording keeps of the samples, and what it refuses."""

import numpy as np
import pytest

from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.planning.com import RecordedCom

TIME = np.arange(2.0, 5.0, 0.01)
COM = np.column_stack([0.1 * TIME, np.sin(TIME), 0.9 + 0.0 * TIME])


def foot(name, y):
    return sole(name, (0.0, y, 0.0), length=0.28, width=0.12, friction=0.7)


LEFT, RIGHT = foot("left_foot", 0.1), foot("right_foot", -0.1)
SEQUENCE = StanceSequence([Phase(Stance(c, 1500.0), 0.4) for c in ([LEFT, RIGHT], [RIGHT], [LEFT, RIGHT])])
KEYS = (2.1, 3.004, 3.5, 4.9)


def test_samples_start_at_zero_and_end_at_the_last_key_frame():
    recording = RecordedCom(TIME, COM, SEQUENCE, KEYS)
    assert recording.time[0] == 0.0
    np.testing.assert_allclose(recording.key_times, [0.0, 0.9, 1.4, 2.8], atol=1e-12)
    np.testing.assert_array_equal(recording.com[recording.key_frames[1]], COM[100])
    assert recording.key_frames[-1] == len(recording.time) - 1


def test_the_stances_have_the_recorded_durations():
    """The recording's timing replaces the bounds, also where a phase is shorter than its lower bound."""
    recording = RecordedCom(TIME, COM, SEQUENCE, (2.1, 3.0, 3.1, 4.9))
    for phase, duration in zip(recording.sequence, (0.9, 0.1, 1.8), strict=True):
        assert phase.min_duration == phase.max_duration == pytest.approx(duration)


def test_arrays_cannot_be_changed():
    recording = RecordedCom(TIME, COM, SEQUENCE, KEYS)
    for array in (recording.time, recording.com, recording.key_frames):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def bad(values, index, value):
    changed = np.array(values, dtype=float)
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("time", "com", "keys", "says"),
    [
        (TIME, bad(COM, (7, 2), np.nan), KEYS, "recording com"),
        (bad(TIME, 5, np.inf), COM, KEYS, "recording time"),
        (bad(TIME, 5, TIME[4]), COM, KEYS, "strictly increasing"),
        (TIME[::-1], COM, KEYS, "strictly increasing"),
        (TIME[:1], COM[:1], KEYS, "have 1 entries"),
        (TIME, COM[:-1], KEYS, "shape"),
        (TIME, COM[:, :2], KEYS, "shape"),
        (TIME, COM, (2.1, 3.0, 2.9, 4.9), "key times"),
        (TIME, COM, (2.1, 3.0, 4.9), "key times"),
        (TIME, COM, (1.5, 3.0, 3.5, 4.9), "inside the recording"),
        (TIME, COM, (2.1, 3.0, 3.5, 6.0), "inside the recording"),
        (TIME, COM, (2.1, 3.0, 3.003, 4.9), "no sample between"),
    ],
)
def test_bad_recordings_are_refused_in_one_line(time, com, keys, says):
    with pytest.raises(InputError, match=says) as error:
        RecordedCom(time, com, SEQUENCE, keys)
    assert "\n" not in str(error.value)
    assert "valid:" in str(error.value)


def test_a_phase_without_support_is_refused():
    flight = StanceSequence([Phase(Stance(c, 1500.0)) for c in ([LEFT, RIGHT], [], [LEFT, RIGHT])])
    with pytest.raises(InputError, match="no support in phase 1"):
        RecordedCom(TIME, COM, flight, KEYS)


def test_the_rate_of_the_angular_momentum_is_cut_like_the_samples():
    rate = np.column_stack([TIME, -TIME, 0.0 * TIME])
    recording = RecordedCom(TIME, COM, SEQUENCE, KEYS, rate)
    np.testing.assert_allclose(recording.angular_momentum_rate[:, 0], recording.time + 2.1, atol=1e-9)
    assert RecordedCom(TIME, COM, SEQUENCE, KEYS).angular_momentum_rate is None
    again = recording.with_angular_momentum_rate(recording.angular_momentum_rate)
    np.testing.assert_array_equal(again.com, recording.com)
    with pytest.raises(InputError, match="angular momentum rate"):
        RecordedCom(TIME, COM, SEQUENCE, KEYS, rate[:-1])
