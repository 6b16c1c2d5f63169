"""CoM trajectories through a sequence of stances ([Qiu2012]_ chapter 5)."""

from manikin.centroidal.certificate import Residual, Residuals
from manikin.centroidal.constraints import BentSurface, GeometricConstraint, height_band
from manikin.centroidal.feasibility import Failure, Feasibility, assess_feasibility, intersection_radii
from manikin.centroidal.key_planes import KeyPlane
from manikin.centroidal.keyframe_problem import KeyframeProblem
from manikin.centroidal.keyframes import KeyframeResult, plan_com_through_key_frames
from manikin.centroidal.near_key_frames import NearKeyFramesResult, plan_com_near_key_frames
from manikin.centroidal.overhead import CeilingHeight, Zone, height_below, keep_out
from manikin.centroidal.problem import CentroidalProblem, MarginSpace, Weights
from manikin.centroidal.recording import Recording
from manikin.centroidal.timing_free import CentroidalResult, plan_com
from manikin.centroidal.trajectory import CentroidalTrajectory

__all__ = [
    "BentSurface",
    "CeilingHeight",
    "CentroidalProblem",
    "CentroidalResult",
    "CentroidalTrajectory",
    "Failure",
    "Feasibility",
    "GeometricConstraint",
    "KeyPlane",
    "KeyframeProblem",
    "KeyframeResult",
    "MarginSpace",
    "NearKeyFramesResult",
    "Recording",
    "Residual",
    "Residuals",
    "Weights",
    "Zone",
    "assess_feasibility",
    "height_band",
    "height_below",
    "intersection_radii",
    "keep_out",
    "plan_com",
    "plan_com_near_key_frames",
    "plan_com_through_key_frames",
]
