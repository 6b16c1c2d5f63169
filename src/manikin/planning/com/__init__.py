"""CoM trajectories through a sequence of stances ([Qiu2012]_ chapter 5)."""

from manikin.planning.com.com_certificate import Residual, Residuals
from manikin.planning.com.com_constraints import (
    BentSurface,
    CeilingHeight,
    GeometricConstraint,
    KeyPlane,
    Zone,
    height_band,
    height_below,
    keep_out,
)
from manikin.planning.com.com_problem import CentroidalProblem, CentroidalTrajectory, MarginSpace, Weights
from manikin.planning.com.feasibility import Failure, Feasibility, assess_feasibility, intersection_radii
from manikin.planning.com.keyframe_problem import KeyframeProblem, RecordedCom
from manikin.planning.com.keyframes import KeyframeResult, plan_com_through_key_frames
from manikin.planning.com.near_key_frames import NearKeyFramesResult, plan_com_near_key_frames
from manikin.planning.com.timing_free import CentroidalResult, plan_com

__all__ = [
    "BentSurface", "CeilingHeight", "CentroidalProblem", "CentroidalResult", "CentroidalTrajectory",
    "Failure", "Feasibility", "GeometricConstraint", "KeyPlane", "KeyframeProblem", "KeyframeResult",
    "MarginSpace", "NearKeyFramesResult", "RecordedCom", "Residual", "Residuals", "Weights", "Zone",
    "assess_feasibility", "height_band", "height_below", "intersection_radii", "keep_out", "plan_com",
    "plan_com_near_key_frames", "plan_com_through_key_frames",
]  # fmt: skip
