"""The viewer in the browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from manikin.motion.file import MotionFile
    from manikin.scenarios import Scenario
    from manikin.scene import Scene
    from manikin.viewer.canvas import Page
    from manikin.viewer.door import Door
    from manikin.viewer.drive import LiveContacts
    from manikin.viewer.placing import Plan
    from manikin.viewer.session import FilmMaker
    from manikin.walking import WalkController

__all__ = ["serve", "serve_contacts", "serve_drive", "serve_task"]

THIS_COMPUTER = "127.0.0.1"
"""Address that only this computer can reach."""


def serve(
    content: MotionFile, port: int = 8080, announce: Callable[[str], None] | None = None, *,
    others: Mapping[str, MotionFile] | None = None, host: str = THIS_COMPUTER,
    film: FilmMaker | None = None,
) -> None:  # fmt: skip
    """Show a motion file in the browser until Ctrl-C.

    Args:
        content: At least one motion, and the body.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.
        others: Motions of others who are there, by name.
        host: Address to listen to; any but one of this computer alone lets in who has the token of the page,
            which is part of the address that is announced.
        film: Makes the films that visitors ask for; None for no films.

    Raises:
        InputError: If the file holds no body, or, as of the other pages, the port is taken.
    """
    from manikin.viewer.session import ViewerSession

    _run(ViewerSession(content, _door(port, host), others, film=film), announce)


def serve_task(
    job: Scenario, plan: Plan, port: int = 8080, announce: Callable[[str], None] | None = None, *,
    host: str = THIS_COMPUTER, film: FilmMaker | None = None,
) -> None:  # fmt: skip
    """Let the user place start and goal in a scene, plan the task and watch the motion, until Ctrl-C.

    Args:
        job: Scenario whose scene and body these are.
        plan: Plans what was placed.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.
        host: Address to listen to.
        film: Makes the films that visitors ask for; None for no films.

    Raises:
        InputError: If the body or the scene is of no use here.
    """
    from manikin.viewer.placing import TaskViewer
    from manikin.viewer.session import ViewerSession

    door, session = _door(port, host), None
    while session is None or session.again:
        page = TaskViewer(job, door, plan, session)
        _run(page, announce if session is None else None)
        if page.planned is None or page.planned.content is None:
            return
        job = page.scenario()
        words = page.planned.words
        session = ViewerSession(page.planned.content, door, verdict=words, before=page, film=film)
        _run(session, None)


def serve_contacts(
    live: LiveContacts, port: int = 8080, announce: Callable[[str], None] | None = None, *,
    host: str = THIS_COMPUTER,
) -> None:  # fmt: skip
    """Let the user drag a body through its scene and watch the contacts of its limbs, until Ctrl-C."""
    from manikin.viewer.drive import ContactViewer

    _run(ContactViewer(live, _door(port, host)), announce)


def serve_drive(
    controller: WalkController, scene: Scene | None = None, port: int = 8080,
    announce: Callable[[str], None] | None = None, *, host: str = THIS_COMPUTER,
) -> None:  # fmt: skip
    """Let the user steer a walker with keys and sliders until Ctrl-C; it does not see the scene around it."""
    from manikin.viewer.drive import WalkViewer

    _run(WalkViewer(controller, _door(port, host), scene), announce)


def _door(port: int, host: str) -> Door:
    from manikin.viewer.door import Door

    return Door(port, host)


def _run(page: Page, announce: Callable[[str], None] | None) -> None:
    if announce is not None:
        announce(page.url)
    page.run()
