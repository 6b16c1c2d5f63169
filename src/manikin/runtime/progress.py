"""Progress bars on standard error, and signals that cannot get lost."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn


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


class StageProgress:
    """Shows one bar per stage; call it from the job with (stage, share done, remark).

    On a terminal the bars move; elsewhere each stage is one line when it is done.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._bars: dict[str, TaskID] = {}
        self._done: set[str] = set()
        self._progress = Progress(
            TextColumn("{task.description:<14}"),
            BarColumn(bar_width=30),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[remark]}"),
            console=self._console,
            disable=not self._console.is_terminal,
        )

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def __call__(self, stage: str, share: float, remark: str = "") -> None:
        """Report that ``share`` (0 to 1) of ``stage`` is done."""
        if stage not in self._bars:
            self._bars[stage] = self._progress.add_task(stage, total=1.0, remark=remark)
        self._progress.update(self._bars[stage], completed=share, remark=remark)
        if share >= 1.0 and stage not in self._done:
            self._done.add(stage)
            if self._progress.disable:
                self._console.print(f"{stage}: done {remark}".rstrip(), highlight=False, markup=False)
