"""Ctrl-C and termination that cannot get lost."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self


class Interruption:
    """Context in which SIGINT and SIGTERM raise :class:`KeyboardInterrupt`.

    Both unwind the program, so that temporary files are removed.  SIGINT is listened to even
    where a shell starts background jobs with it ignored.  A native solver may swallow the
    exception and carry on with what it has; :meth:`check` raises it again.

    Attributes:
        requested: Whether one of the signals has come.
    """

    def __init__(self) -> None:
        self.requested = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        # Elsewhere than in the main thread the host program decides about its signals.
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._stop)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raise if a signal has come.

        Raises:
            KeyboardInterrupt: If so.
        """
        if self.requested:
            raise KeyboardInterrupt

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True
        raise KeyboardInterrupt
