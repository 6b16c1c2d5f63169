"""The viewer in the browser; needs the extra ``viewer``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from manikin.errors import InputError

if TYPE_CHECKING:
    from manikin.motion.file import MotionFile

__all__ = ["serve"]


def serve(content: MotionFile, port: int = 8080, announce: Callable[[str], None] | None = None) -> None:
    """Show a motion file in the browser until Ctrl-C, on this computer only.

    Args:
        content: At least one motion, and the body.
        port: Port to listen on; 0 picks a free one.
        announce: Told the page's address when it can be opened.

    Raises:
        InputError: If the viewer is not installed, the file holds no body or the port is taken.
    """
    try:
        from manikin.viewer.session import ViewerSession
    except ModuleNotFoundError as error:
        if error.name != "viser":
            raise
        raise InputError(
            "the viewer is not installed; install it with: pip install 'manikin[viewer]'"
        ) from None
    session = ViewerSession(content, port)
    if announce is not None:
        announce(session.url)
    session.run()
