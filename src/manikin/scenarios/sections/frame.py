"""Section of a scenario file: a frame other than the world's."""

from typing import Annotated

from pydantic import Field

from manikin.scenarios.validation import Moves, Number, Section, Vector2
from manikin.spatial import PlanarTransform


class FrameSection(Section):
    """A frame in the world, as high as that."""

    at: Annotated[Vector2, Moves.POINT] = Field(
        default=(0.0, 0.0), description="where its origin is, x and y [m]"
    )
    yaw_deg: Annotated[Number, Moves.HEADING] = Field(
        default=0.0, description="where its x axis points, counter-clockwise from world x [deg]"
    )

    def transform_to_world(self) -> PlanarTransform:
        """Transform from this frame to the world."""
        return PlanarTransform(*self.at, self.yaw_deg)
