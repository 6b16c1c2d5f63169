"""Recorded human motion: readers, and the angles of hips and shoulders.

Skeletons are read from BVH and from ASF with AMC, markers from C3D and TRC, force plates from C3D and MOT.
:func:`reconstruct` makes a motion of our human of any of them.
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
from manikin.mocap.plate_forces import (
    PlateComparison,
    PlateForces,
    compare_with_plates,
    mass_on_plates,
    plate_forces,
)
from manikin.mocap.plate_supports import TimingError, timing_errors
from manikin.mocap.read import read_recording
from manikin.mocap.reconstruct import person_of, reconstruct
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_dynamics import RecordedDynamics, dynamics_of, with_mass
from manikin.mocap.recorded_forces import motion_on_contacts
from manikin.mocap.recorded_margins import RecordedMargins, recorded_margins
from manikin.mocap.recorded_motion import motion_of, smoothed
from manikin.mocap.recorded_stances import recorded_schedule
from manikin.mocap.recorded_supports import RecordedSupports, Support, SupportPhase
from manikin.mocap.recording import Recording
from manikin.mocap.seat_loads import SeatChange, seat_changes
from manikin.mocap.subject import Subject
from manikin.mocap.supports import supports_of
from manikin.mocap.targets import Targets
from manikin.mocap.trc import read_trc

__all__ = [
    "Anatomy",
    "Cause",
    "Event",
    "ForcePlate",
    "Gap",
    "Loss",
    "MarkerRecording",
    "PlateComparison",
    "PlateForces",
    "Reconstruction",
    "RecordedDynamics",
    "RecordedMargins",
    "RecordedSupports",
    "Recording",
    "SeatChange",
    "Skeleton",
    "Subject",
    "Support",
    "SupportPhase",
    "Targets",
    "TimingError",
    "anatomy_of",
    "balance_losses",
    "ball_joint_angles",
    "compare_with_plates",
    "dynamics_of",
    "mass_on_plates",
    "motion_of",
    "motion_on_contacts",
    "person_of",
    "plate_forces",
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
    "share_by_cause",
    "smoothed",
    "supports_of",
    "timing_errors",
    "with_mass",
]
