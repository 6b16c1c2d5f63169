"""A page in the browser: its server, and the loop that serves it."""

import threading
import time as clock
from abc import ABC, abstractmethod

from manikin.viewer.stage import HOST, start_server, stop_server


class Page(ABC):
    """Serves one page until it is closed.

    Attributes:
        server: The viser server.
    """

    def __init__(self, port: int, frame_rate: float) -> None:
        """Start the server.

        Args:
            port: Port to listen on; 0 picks a free one.
            frame_rate: Largest number of pictures per second.

        Raises:
            InputError: If the port is taken.
        """
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._frame_rate = frame_rate
        self.server = start_server(port)

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.server.get_port()}"

    @abstractmethod
    def advance(self, seconds: float) -> None:
        """Show what has come of ``seconds`` of real time [s]."""

    def run(self) -> None:
        """Serve until :meth:`close` is called or Ctrl-C is pressed."""
        before = clock.monotonic()
        try:
            while not self._closed.wait(max(0.0, before + 1.0 / self._frame_rate - clock.monotonic())):
                now = clock.monotonic()
                self.advance(now - before)
                before = now
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """Stop the server; a second call does nothing."""
        if not self._closed.is_set():
            self._closed.set()
            stop_server(self.server)
