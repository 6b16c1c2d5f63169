"""Recorded human motion: readers, and the angles of hips and shoulders.

Skeletons are read from BVH and from ASF with AMC, markers from C3D and TRC, force plates from C3D and MOT.
:func:`reconstruct` makes a motion of our human of any of them, :func:`statistics_of` measures many.
"""

from manikin.mocap.amc import read_amc
from manikin.mocap.anatomy import Anatomy, anatomy_of
from manikin.mocap.asf import Skeleton, read_asf
from manikin.mocap.balance_losses import Cause, Loss, balance_losses, share_by_cause
from manikin.mocap.ball_joints import ball_joint_angles
from manikin.mocap.bvh import read_bvh
from manikin.mocap.c3d import read_c3d
from manikin.mocap.force_plate import ForcePlate
from manikin.mocap.gaps import Gap
from manikin.mocap.markers import Event, MarkerRecording
from manikin.mocap.mot import read_mot
from manikin.mocap.passages import Overhead, Passage, passages, whole_passage
from manikin.mocap.phase_durations import phase_durations
from manikin.mocap.phase_sequence import PhaseSequence
from manikin.mocap.plate_forces import (
    PlateComparison,
    PlateForces,
    compare_with_plates,
    mass_on_plates,
    plate_forces,
)
from manikin.mocap.plate_supports import TimingError, timing_errors
from manikin.mocap.published_phases import (
    published_consistency,
    published_distances,
    published_grasps,
    published_heights,
    published_phases,
)
from manikin.mocap.read import read_recording
from manikin.mocap.reconstruct import person_of, reconstruct
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_clip import RecordedClip, clip_of
from manikin.mocap.recorded_dynamics import RecordedDynamics, dynamics_of, touch_downs_of, with_mass
from manikin.mocap.recorded_forces import motion_on_contacts
from manikin.mocap.recorded_margins import RecordedMargins, recorded_margins
from manikin.mocap.recorded_motion import motion_of, smoothed
from manikin.mocap.recorded_stances import recorded_schedule
from manikin.mocap.recorded_supports import RecordedSupports, Support, SupportPhase
from manikin.mocap.recording import Recording
from manikin.mocap.seat_loads import SeatChange, seat_changes
from manikin.mocap.sequence_consistency import SequenceConsistency, sequence_consistency
from manikin.mocap.shifted_motion import LeastShift, least_shift
from manikin.mocap.spread import Spread
from manikin.mocap.statistics import (
    GroupStatistics,
    StatisticsSettings,
    group_statistics,
    published_statistics,
    statistics_of,
)
from manikin.mocap.subject import Subject
from manikin.mocap.support_distances import (
    SupportDistance,
    largest_distances,
    shares_within,
    support_distances,
)
from manikin.mocap.support_placements import Origin, Placement, com_extreme, first_stance, support_placements
from manikin.mocap.supports import supports_of
from manikin.mocap.targets import Targets
from manikin.mocap.trc import read_trc

__all__ = [
    "Anatomy",
    "Cause",
    "Event",
    "ForcePlate",
    "Gap",
    "GroupStatistics",
    "LeastShift",
    "Loss",
    "MarkerRecording",
    "Origin",
    "Overhead",
    "Passage",
    "PhaseSequence",
    "Placement",
    "PlateComparison",
    "PlateForces",
    "Reconstruction",
    "RecordedClip",
    "RecordedDynamics",
    "RecordedMargins",
    "RecordedSupports",
    "Recording",
    "SeatChange",
    "SequenceConsistency",
    "Skeleton",
    "Spread",
    "StatisticsSettings",
    "Subject",
    "Support",
    "SupportDistance",
    "SupportPhase",
    "Targets",
    "TimingError",
    "anatomy_of",
    "balance_losses",
    "ball_joint_angles",
    "clip_of",
    "com_extreme",
    "compare_with_plates",
    "dynamics_of",
    "first_stance",
    "group_statistics",
    "largest_distances",
    "least_shift",
    "mass_on_plates",
    "motion_of",
    "motion_on_contacts",
    "passages",
    "person_of",
    "phase_durations",
    "plate_forces",
    "published_consistency",
    "published_distances",
    "published_grasps",
    "published_heights",
    "published_phases",
    "published_statistics",
    "read_amc",
    "read_asf",
    "read_bvh",
    "read_c3d",
    "read_mot",
    "read_recording",
    "read_trc",
    "reconstruct",
    "recorded_margins",
    "recorded_schedule",
    "seat_changes",
    "sequence_consistency",
    "share_by_cause",
    "shares_within",
    "smoothed",
    "statistics_of",
    "support_distances",
    "support_placements",
    "supports_of",
    "timing_errors",
    "touch_downs_of",
    "whole_passage",
    "with_mass",
]
