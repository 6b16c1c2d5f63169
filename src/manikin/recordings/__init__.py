"""Recorded human motion: readers, reconstruction, supports, dynamics and statistics.

Skeletons are read from BVH and from ASF with AMC, markers from C3D and TRC, force plates from C3D and MOT.
:func:`reconstruct` makes a motion of our human of any of them, :func:`statistics_of` measures many.
"""

from manikin.recordings.dynamics.plate_forces import (
    PlateComparison,
    PlateForces,
    compare_with_plates,
    mass_on_plates,
    plate_forces,
    without_offsets,
)
from manikin.recordings.dynamics.recorded_dynamics import (
    RecordedDynamics,
    RecordedMargins,
    dynamics_of,
    motion_of,
    recorded_margins,
    smoothed,
    touch_downs_of,
    with_mass,
)
from manikin.recordings.dynamics.recorded_forces import motion_on_contacts
from manikin.recordings.dynamics.shifted_motion import LeastShift, least_shift
from manikin.recordings.readers import read_recording
from manikin.recordings.readers.acclaim import read_amc, read_asf
from manikin.recordings.readers.bvh import read_bvh
from manikin.recordings.readers.c3d import read_c3d
from manikin.recordings.readers.marker_map import MarkerMap, read_marker_map
from manikin.recordings.readers.markers import Event, ForcePlate, MarkerRecording
from manikin.recordings.readers.opensim import read_mot, read_trc
from manikin.recordings.readers.skeleton_recording import Recording, Subject
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.reconstruction.reconstruct import person_of, reconstruct
from manikin.recordings.statistics.clip_statistics import (
    GroupStatistics,
    StatisticsSettings,
    published_statistics,
    statistics_of,
)
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.passages import (
    Origin,
    Overhead,
    SupportPlacement,
    com_extreme,
    first_stance,
    largest_distances,
    passages,
    shares_within,
    support_distances,
    support_placements,
    whole_passage,
)
from manikin.recordings.statistics.phases import (
    PhaseSequence,
    phase_durations,
    published_consistency,
    published_distances,
    published_heights,
    published_phases,
    sequence_consistency,
)
from manikin.recordings.supports.body_supports import RecordedSupports, Support, SupportPhase
from manikin.recordings.supports.recorded_stances import recorded_schedule
from manikin.recordings.supports.supports import TimingError, supports_of, timing_errors

__all__ = [
    "Event", "ForcePlate", "GroupStatistics", "LeastShift", "MarkerMap", "MarkerRecording", "Origin",
    "Overhead", "PhaseSequence", "PlateComparison", "PlateForces", "Reconstruction", "RecordedClip",
    "RecordedDynamics", "RecordedMargins", "RecordedSupports", "Recording", "StatisticsSettings",
    "Subject", "Support", "SupportPhase", "SupportPlacement", "TimingError", "com_extreme",
    "compare_with_plates", "dynamics_of", "first_stance", "largest_distances", "least_shift",
    "mass_on_plates", "motion_of", "motion_on_contacts", "passages", "person_of", "phase_durations",
    "plate_forces", "published_consistency", "published_distances", "published_heights",
    "published_phases", "published_statistics", "read_amc", "read_asf", "read_bvh", "read_c3d",
    "read_marker_map", "read_mot", "read_recording", "read_trc", "reconstruct", "recorded_margins",
    "recorded_schedule", "sequence_consistency", "shares_within", "smoothed", "statistics_of",
    "support_distances", "support_placements", "supports_of", "timing_errors", "touch_downs_of",
    "whole_passage", "with_mass", "without_offsets",
]  # fmt: skip
