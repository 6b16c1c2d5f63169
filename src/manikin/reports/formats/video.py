"""A motion as a film: shaded pictures from a camera that goes along, as MP4 or GIF.

The pictures are those of :mod:`manikin.reports.figures.raster` with a coarser surface of the person and one
computed point for each pixel, so that a frame takes about a second on a slow processor, not several. The
direction of the camera is the one from which most of the body is seen among the obstacles; its target follows
the smoothed path of the root. What hides the body is drawn as glass.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures.raster import Camera, Window, hiding, picture
from manikin.reports.figures.space import Space
from manikin.reports.solids import DrawnSolid, body_solid, scene_solids
from manikin.scene import Scene

SIZE = (640, 480)
"""Width and height of a film unless the caller says otherwise [pixels]."""
SMALLEST, LARGEST = 64, 3840
MOST_FRAMES = 20_000
"""Longest film [frames]."""
COARSE = 0.012
"""Edge of the cells in which vertices of the surface become one [m]."""
AROUND = 2.5
"""Farther than this from the body obstacles are cut off [m]."""
ROOM = 0.30
"""Shown around the body on every side [m]."""
FASTEST_GIF = 50.0
"""Pictures per second above which programs play a GIF slower [Hz]."""
_SMOOTH, _LOOK = 0.5, 0.2
_POSTURES = 6

Progress = Callable[[float], object]


def film_size(text: str) -> tuple[int, int]:
    """Width and height [pixels] of a text such as ``640x480``; both are even, as encoders want them.

    Raises:
        InputError: If it is no such text, or a side is too small, too large or odd.
    """
    width, _, height = text.lower().partition("x")
    if width.isdecimal() and height.isdecimal():
        return checked_size((int(width), int(height)))
    raise InputError(f"size is {text!r}; valid: WIDTHxHEIGHT in pixels, such as 640x480")


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """The size [pixels], if both sides are even numbers within the limits; else an InputError."""
    if any(side % 2 or not SMALLEST <= side <= LARGEST for side in size):
        valid = f"even numbers of pixels from {SMALLEST} to {LARGEST}"
        raise InputError(f"size is {size[0]}x{size[1]}; valid: {valid}")
    return size


@dataclass(frozen=True, eq=False)
class Film:
    """Pictures of a motion, one for each of its samples.

    Attributes:
        body: Whose motion it is.
        motion: Sampled at the film's rate.
        scene: What stands around, or None.
        size: Width and height of a picture [pixels].
    """

    body: BodyModel
    motion: Motion
    scene: Scene | None = None
    size: tuple[int, int] = SIZE

    def __post_init__(self) -> None:
        checked_size(self.size)
        if len(self.motion.time) > MOST_FRAMES:
            wrong = f"film has {len(self.motion.time)} frames"
            raise InputError(f"{wrong}; valid: at most {MOST_FRAMES}, by a lower rate")
        if body_solid(self.body, self.motion.q[0], coarse=COARSE) is None:
            raise MotionFileError(
                f"body {self.body.name!r} has no shape; valid: a body with shapes for video"
            )

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self.motion.time)

    def pictures(self) -> Iterator[np.ndarray]:
        """(height, width, 3) pictures, 8 bits a colour, one after the other."""
        floor = None if self.scene is None else self.scene.floor_height
        for number in range(len(self)):
            solids = [self._solid(number), *self.obstacles]
            yield picture(
                solids, self.camera(number), self.window, self._scale, clear=self._clear(number),
                floor=floor, finer=1,
            )  # fmt: skip

    @cached_property
    def obstacles(self) -> list[DrawnSolid]:
        """Obstacles near the motion."""
        root = self.motion.q[:, :3]
        near = root.min(axis=0) - AROUND, root.max(axis=0) + AROUND
        return [] if self.scene is None else scene_solids(self.scene, *near)

    @cached_property
    def targets(self) -> FloatArray:
        """(n, 3) what the camera looks at [m]."""
        root = self.motion.q[:, :3]
        if len(root) < 2:
            return root
        step = self.motion.duration / (len(root) - 1)
        return gaussian_filter1d(root, _SMOOTH / step, axis=0, mode="nearest")

    def camera(self, number: int) -> Camera:
        """Camera of a picture."""
        return Camera(self._first.axes, self.targets[number], self._distance)

    @cached_property
    def window(self) -> Window:
        """What is shown around the target, in its plane: the body in all postures, and room [m]."""
        axes = self._first.axes
        places = np.vstack([
            (solid.vertices - self.targets[sample]) @ axes[:2].T for sample, solid in self._samples
        ])  # fmt: skip
        low, high = places.min(axis=0) - ROOM, places.max(axis=0) + ROOM
        width, height = self.size
        middle, scale = (low + high) / 2.0, min(width / (high - low)[0], height / (high - low)[1])
        half = np.array([width, height]) / (2.0 * scale)
        (left, bottom), (right, top) = middle - half, middle + half
        return left, right, bottom, top

    @property
    def _scale(self) -> float:
        left, right, _, _ = self.window
        return self.size[0] / (right - left)

    @cached_property
    def _distance(self) -> float:
        reach = [np.linalg.norm(solid.vertices - self.targets[k], axis=1).max() for k, solid in self._samples]
        return 4.5 * float(max(reach)) + 1.0

    @cached_property
    def _samples(self) -> list[tuple[int, DrawnSolid]]:
        """Some pictures' numbers and bodies, spread over the motion."""
        numbers = np.unique(np.linspace(0, len(self) - 1, _POSTURES).round().astype(int))
        return [(number, self._solid(number)) for number in numbers.tolist()]

    @cached_property
    def _first(self) -> Camera:
        """The camera from the best direction."""
        postures = self.motion.q[[number for number, _ in self._samples]]
        turned = Rotation.from_quat(postures[:, 3:7]).as_matrix()[:, :, 0]
        bodies = [solid for _, solid in self._samples]
        seen = np.vstack([solid.vertices for solid in bodies])
        return Space(bodies, turned, self.scene, (), seen).camera

    def _solid(self, number: int) -> DrawnSolid:
        solid = body_solid(self.body, self.motion.q[number], coarse=COARSE)
        assert solid is not None
        return solid

    def _clear(self, number: int) -> set[str]:
        """Obstacles seen through: before the body about now, so that none flickers."""
        looks, here = self._looks
        near = np.abs(looks - self.motion.time[number]) <= 1.5 * _LOOK
        return set().union(*(names for names, is_near in zip(here, near, strict=True) if is_near))

    @cached_property
    def _looks(self) -> tuple[FloatArray, list[set[str]]]:
        """Instants [s] and the obstacles that are before the body then."""
        time = self.motion.time
        numbers = np.unique(
            np.searchsorted(time, np.arange(time[0], time[-1] + _LOOK, _LOOK)).clip(0, len(self) - 1)
        )
        hidden = [
            hiding([self._solid(k)], self.obstacles, self.camera(k), self.window, 80)
            for k in numbers.tolist()
        ]
        return time[numbers], hidden


def to_mp4(film: Film, rate: float, progress: Progress = lambda _share: None) -> bytes:
    """Content of an MP4 file (H.264, 4:2:0), which browsers and office programs play.

    Args:
        film: What is shown.
        rate: Pictures per second [Hz].
        progress: Told the share that is done.

    Raises:
        InputError: If imageio-ffmpeg is not installed.
    """
    encoder = _encoder()
    with TemporaryDirectory(prefix="manikin-") as folder:
        path = Path(folder) / "motion.mp4"
        writer = encoder.write_frames(
            str(path), film.size, fps=rate, codec="libx264", pix_fmt_in="rgb24", pix_fmt_out="yuv420p",
            quality=None, macro_block_size=2, ffmpeg_log_level="error",
            output_params=["-crf", "20", "-movflags", "+faststart"],
        )  # fmt: skip
        writer.send(None)
        try:
            for number, image in enumerate(film.pictures()):
                writer.send(np.ascontiguousarray(image))
                progress((number + 1) / len(film))
        finally:
            writer.close()
        return path.read_bytes()


def _encoder() -> Any:
    try:
        return import_module("imageio_ffmpeg")
    except ModuleNotFoundError as error:
        if error.name != "imageio_ffmpeg":
            raise
        raise InputError("mp4 needs imageio-ffmpeg; install it with: pip install 'manikin[video]'") from None


def to_gif(film: Film, rate: float, progress: Progress = lambda _share: None) -> bytes:
    """Content of an animated GIF that plays again and again, in the 256 colours of the middle picture.

    A GIF counts time in hundredths of a second: each picture is shown up to the rounded instant of the next.

    Args:
        film: What is shown.
        rate: Pictures per second [Hz].
        progress: Told the share that is done.

    Raises:
        InputError: If the rate is above 50 Hz, which programs play slower.
    """
    if rate > FASTEST_GIF:
        raise InputError(f"rate is {rate:g} Hz; valid for gif: at most {FASTEST_GIF:g} Hz")
    instants = 10 * np.round(100.0 * np.arange(len(film) + 1) / rate).astype(int)
    images = []
    for number, image in enumerate(film.pictures()):
        images.append(Image.fromarray(image))
        progress((number + 1) / len(film))
    palette = images[len(images) // 2].quantize(256)
    drawn = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    content = BytesIO()
    drawn[0].save(
        content, format="GIF", save_all=True, append_images=drawn[1:], duration=np.diff(instants).tolist(),
        loop=0, optimize=False, disposal=1,
    )  # fmt: skip
    return content.getvalue()
