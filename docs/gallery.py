"""The moving pictures of the gallery, from run directories.

    python docs/gallery.py NAME=RUN...      python docs/gallery.py platform=runs/platform stairs=runs/stairs

writes ``docs/images/gallery/NAME.webp``. Each shows a whole motion in :data:`SECONDS`, from one eye.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from manikin.motion.file import MotionFile, read_motions
from manikin.reports.figures.raster import hiding, picture
from manikin.reports.figures.space import Space
from manikin.reports.figures.views import distinct_contacts
from manikin.reports.solids import body_solid, contact_solids

FOLDER = Path(__file__).resolve().parent / "images" / "gallery"
SECONDS, RATE = 3.0, 12
"""Length of a moving picture [s] and pictures per second, with half a second more of the last one."""
WIDTH, MOST_HIGH = 360, 400
"""Size of a picture, at most [pixels]."""
MOST_BYTES = 300_000


def frames(content: MotionFile) -> list[Image.Image]:
    """The pictures of a run's last motion."""
    motion, body = list(content.motions.values())[-1], content.body
    assert body is not None  # a run directory with a motion has its body
    samples = np.linspace(0, len(motion.time) - 1, round(SECONDS * RATE)).round().astype(int)
    contacts = [] if content.schedule is None else distinct_contacts(content.schedule)
    postures = motion.q[samples]
    space = Space.of(content.scene, [motion.com], contacts=contacts, body=body, postures=postures[::6])
    left, right, bottom, top = space.window
    scale = min(WIDTH / (right - left), MOST_HIGH / (top - bottom))
    clear = hiding(space.bodies, space.obstacles, space.camera, space.window)
    still = [*space.obstacles, *contact_solids(contacts)]
    floor = None if content.scene is None else content.scene.floor_height
    shown = [body_solid(body, q) for q in postures]
    return [
        Image.fromarray(
            picture([*still, solid], space.camera, space.window, scale, clear=clear, floor=floor)
        )
        for solid in shown
        if solid is not None
    ]


def write(name: str, run: Path) -> Path:
    """Write the moving picture of a run, in the best quality that keeps it below :data:`MOST_BYTES`."""
    first, *rest = frames(read_motions(run))
    times = [round(1000 / RATE)] * len(rest) + [500]
    FOLDER.mkdir(parents=True, exist_ok=True)
    file = FOLDER / f"{name}.webp"
    for quality in (80, 65, 50, 35, 20):
        first.save(
            file, save_all=True, append_images=rest, duration=times, loop=0, quality=quality, method=4
        )
        if file.stat().st_size <= MOST_BYTES:
            return file
    raise SystemExit(f"{file} is larger than {MOST_BYTES} bytes")


if __name__ == "__main__":
    for given in sys.argv[1:]:
        name, _, run = given.partition("=")
        file = write(name, Path(run))
        print(f"{file}: {file.stat().st_size / 1000:.0f} kB")
