"""Pictures of every page that manikin shows or writes, by a headless Chromium.

    python docs/screenshots/pages.py RUN ANALYSIS STUDY [PAGE...]

makes ``docs/images/pages/PAGE.png`` of a run directory, an analysis and a study; all pages unless some are
named. Needs Node and ``npm install`` in ``docs/screenshots``. The pages of the viewer are served here, in the
state in which they are shown; ``shoot.mjs`` says what a page complains of.
"""

import subprocess
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from manikin.motion.file import read_motions
from manikin.reports.export import film_of_motion
from manikin.scenarios import load_scenario, load_scene
from manikin.scenarios.world import contact_rules, start_posture
from manikin.viewer.canvas import Page
from manikin.viewer.door import Door
from manikin.viewer.drive import ContactViewer, LiveContacts, WalkViewer
from manikin.viewer.placing import TaskViewer
from manikin.viewer.session import ViewerSession
from manikin.walking import WalkController

HERE = Path(__file__).resolve().parent
FOLDER = HERE.parent / "images" / "pages"
SIZE, WAIT = (1000, 720), 45.0
"""Width and height of a page of the viewer [pixels], and how long a slow computer draws it [s]."""
WIDE, HIGH, SECONDS = 1000, 1100, 4.0
"""Width and height of what is shown of a written page [pixels], and how long it draws [s]."""
SHOWN = 640
"""Width of the pictures [pixels]."""
COLOURS = 256


def player(run: Path) -> Page:
    """A run in the middle of its way."""
    page = ViewerSession(read_motions(run), Door(0), film=film_of_motion)
    page.show(0.55 * float(page.motion.time[-1]))
    return page


def compared(run: Path) -> Page:
    """The planned motion beside the executed one, coloured by the margin."""
    page = ViewerSession(read_motions(run), Door(0))
    page.put_beside("planned")
    page.paint_by("margin")
    page.show(0.45 * float(page.motion.time[-1]))
    return page


def placing(_run: Path) -> Page:
    """A scene in which start and goal are placed."""
    page = TaskViewer(load_scene("platform"), Door(0), lambda _job, _progress: None)  # pyright: ignore
    page.place("goal", np.array([1.2, 0.3, 0.0]), 30.0)
    return page


def drive(_run: Path) -> Page:
    """A walker that turns to the left."""
    page = WalkViewer(WalkController(), Door(0))
    page.steer(np.array([1.0, 0.0, 0.4]))
    for _ in range(80):
        page.advance(0.05)
    return page


def contacts(_run: Path) -> Page:
    """The contacts of a climber's limbs."""
    job = load_scenario("climb")
    body, scene = job.build_body(), job.build_scene()
    live = LiveContacts(
        body, scene, start_posture(job, body, scene), samples=2000, rules=contact_rules(job, body)
    )
    page = ContactViewer(live, Door(0))
    page.update()
    return page


VIEWER: dict[str, Callable[[Path], Page]] = {
    "player": player, "compare": compared, "placing": placing, "drive": drive, "contacts": contacts,
}  # fmt: skip
WRITTEN = ("report", "analysis", "study")


def shoot(name: str, address: str, size: tuple[int, int], wait: float) -> Image.Image:
    """Picture of a page."""
    with TemporaryDirectory() as folder:
        options = ["--width", str(size[0]), "--height", str(size[1]), "--wait", str(wait)]
        command = ["node", str(HERE / "shoot.mjs"), folder, *options, f"{name}={address}"]
        subprocess.run(command, check=False, timeout=400)  # what it complains of it says itself
        return Image.open(BytesIO((Path(folder) / f"{name}.png").read_bytes())).convert("RGB")


def keep(name: str, image: Image.Image) -> Path:
    """Write a picture, smaller and with few colours."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    small = image.resize((SHOWN, round(image.height * SHOWN / image.width)), Image.Resampling.LANCZOS)
    path = FOLDER / f"{name}.png"
    small.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
    return path


def main(run: Path, analysis: Path, study: Path, *names: str) -> None:
    """Make the pictures."""
    places = run / "report.html", analysis / "report.html", study / "study.html"
    files = dict(zip(WRITTEN, places, strict=True))
    for name in names or (*WRITTEN, *VIEWER):
        if name in files:
            image = shoot(name, str(files[name]), (WIDE, HIGH), SECONDS)
        else:
            page = VIEWER[name](run)
            try:
                image = shoot(name, page.url, SIZE, WAIT)
            finally:
                page.close()
        path = keep(name, image)
        print(f"{path.relative_to(HERE.parent)}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), *sys.argv[4:])
