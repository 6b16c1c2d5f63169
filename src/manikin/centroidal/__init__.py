"""CoM trajectories through a sequence of stances ([Qiu2012]_ chapter 5)."""

from manikin.centroidal.certificate import Residual, Residuals
from manikin.centroidal.constraints import BentSurface, GeometricConstraint, height_band
from manikin.centroidal.feasibility import Failure, Feasibility, assess_feasibility, intersection_radii
from manikin.centroidal.problem import CentroidalProblem, MarginSpace, Weights
from manikin.centroidal.timing_free import CentroidalResult, plan_com
from manikin.centroidal.trajectory import CentroidalTrajectory

__all__ = [
    "BentSurface",
    "CentroidalProblem",
    "CentroidalResult",
    "CentroidalTrajectory",
    "Failure",
    "Feasibility",
    "GeometricConstraint",
    "MarginSpace",
    "Residual",
    "Residuals",
    "Weights",
    "assess_feasibility",
    "height_band",
    "intersection_radii",
    "plan_com",
]
