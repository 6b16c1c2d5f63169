"""The viewer in the browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from manikin.motion.file import MotionFile
    from manikin.planning.contacts.single_contact import LiveContacts
    from manikin.scene import Scene
    from manikin.walking import WalkController


__all__ = ["serve", "serve_contacts", "serve_drive"]


def serve(
    content: MotionFile,
    port: int = 8080,
    announce: Callable[[str], None] | None = None,
    *,
    others: Mapping[str, MotionFile] | None = None,
) -> None:
    """Show a motion file in the browser until Ctrl-C, on this computer only.

    Args:
        content: At least one motion, and the body.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.
        others: Motions of others who are there, by name.

    Raises:
        InputError: If the file holds no body or the port is taken.
    """
    from manikin.viewer.session import ViewerSession

    session = ViewerSession(content, port, others)
    if announce is not None:
        announce(session.url)
    session.run()


def serve_contacts(
    live: LiveContacts, port: int = 8080, announce: Callable[[str], None] | None = None
) -> None:
    """Let the user drag a body through its scene and watch the contacts of its limbs, until Ctrl-C.

    Args:
        live: The body, its scene and where it begins.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.

    Raises:
        InputError: If the port is taken.
    """
    from manikin.viewer.contacts import ContactViewer

    session = ContactViewer(live, port)
    if announce is not None:
        announce(session.url)
    session.run()


def serve_drive(
    controller: WalkController,
    scene: Scene | None = None,
    port: int = 8080,
    announce: Callable[[str], None] | None = None,
) -> None:
    """Let the user steer a walker with keys and sliders, in real time, until Ctrl-C.

    Args:
        controller: The walker.
        scene: Drawn around the walker, who does not look at it.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.

    Raises:
        InputError: If the port is taken.
    """
    from manikin.viewer.drive import WalkViewer

    session = WalkViewer(controller, scene, port)
    if announce is not None:
        announce(session.url)
    session.run()
