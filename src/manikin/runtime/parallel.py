"""Work in several processes, by joblib, or on a Dask cluster, and a limit of its processor time."""

import math
import os
import signal
import threading
import time as clock
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from types import FrameType
from typing import Any, TypeVar

from joblib import Parallel, delayed
from joblib.externals.loky.backend import resource_tracker
from threadpoolctl import ThreadpoolController

from manikin.errors import InputError, ManikinError, TimeLimitError
from manikin.runtime.child import end_with

CLUSTER_TIMEOUT = 10.0
"""Time in which a cluster answers [s]."""
T = TypeVar("T")
R = TypeVar("R")


def side_by_side(
    work: Callable[[T], R], items: Sequence[T], workers: int, name: str
) -> Generator[tuple[int, R]]:
    """Do the same work on many items, each in one of several processes, or all of it in this one.

    Every process works on one thread, so that results do not depend on the number of workers. Processes are
    started afresh, which takes a second or more, and stay for further work of this kind. They end with this
    process, however it ends, and at once when the iterator is closed early or an item raises.

    Args:
        work: Can be pickled, as items and results can; depends on nothing but its item.
        items: What to work on.
        workers: Processes; with 1, and for a single item, all is done in this one.
        name: Of the work, for the message of an error.

    Yields:
        Number of an item and its result, as they are done; ManikinError if a process ends before its time.
    """
    count = min(workers, len(items))
    if count < 2:
        threads = ThreadpoolController()
        for number, item in enumerate(items):
            with threads.limit(limits=1):
                result = work(item)
            yield number, result
        return
    pool = Parallel(
        count, backend="loky", return_as="generator_unordered", max_nbytes=None, inner_max_num_threads=1,
        batch_size=1,  # type: ignore[arg-type]  # a number is allowed; the type is that of the default
        initializer=_prepare, initargs=(os.getpid(),),
    )  # fmt: skip
    results: Any = None
    try:
        with _interrupt_held():
            results = pool(delayed(_numbered)(work, number, item) for number, item in enumerate(items))
        for result in results:
            yield result
    except BrokenProcessPool:
        raise ManikinError(f"a process of the {name} ended before its time, for want of memory?") from None
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of results that nobody waits for
            if results is not None:
                results.close()


def on_cluster(
    work: Callable[[T], R], items: Sequence[T], address: str, name: str
) -> Generator[tuple[int, R]]:
    """Do the same work on many items on the workers of a Dask cluster that runs already.

    Workers have the same version of this package and see the same files. Each does one item at a time, on one
    thread, as :func:`side_by_side`. They work outside of their main thread, where no limit of processor time
    holds. What has not begun is taken back when the iterator is closed early.

    Args:
        work: As of :func:`side_by_side`.
        items: What to work on.
        address: Of the scheduler, such as ``"tcp://10.0.0.1:8786"``.
        name: Of the work, for the message of an error.

    Yields:
        Number of an item and its result, as they are done; InputError if ``distributed`` is not installed or
        nobody answers at the address, ManikinError if a worker fails.
    """
    try:
        distributed = import_module("distributed")
    except ImportError:
        problem = "the package distributed is not installed"
        raise InputError(f"cluster {address}: {problem}; valid: pip install 'manikin[cluster]'") from None
    try:
        client = distributed.Client(address, timeout=CLUSTER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        problem = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"cluster {address}: {problem}; valid: tcp://HOST:PORT of a scheduler") from None
    with client:
        futures = client.map(partial(_alone, work), range(len(items)), items, pure=False, batch_size=100)
        try:
            done = distributed.as_completed(
                futures, loop=client.loop, with_results=True, raise_errors=False
            )  # fmt: skip
            for future, result in done:
                if future.status != "finished":
                    raise ManikinError(f"a worker of the {name} on {address} failed: {result[1]}")
                yield result
        finally:
            client.cancel(futures)


_ONE_AT_A_TIME = threading.Lock()


def _alone(work: Callable[[T], R], number: int, item: T) -> tuple[int, R]:
    """Work in a thread of a process that may have more of them, as the only one, on one thread."""
    with _ONE_AT_A_TIME, ThreadpoolController().limit(limits=1):
        return number, work(item)


@dataclass(frozen=True)
class Deadline:
    """Instant after which nothing else is tried, in processor time of this process.

    Unlike :func:`processor_time_limit` it ends nothing: who can try again asks it first. Results depend on
    time where it is over alone.

    Attributes:
        at: Reading of :func:`time.process_time` [s].
    """

    at: float = math.inf

    @classmethod
    def after(cls, seconds: float) -> "Deadline":
        """That in so many seconds from now."""
        return cls(clock.process_time() + seconds)

    @property
    def is_over(self) -> bool:
        """Whether its instant has come."""
        return clock.process_time() >= self.at


NO_DEADLINE = Deadline()
"""The one that never comes."""


class _TimeIsUp(BaseException):
    """Unwinds the work; no Exception, so that nobody takes it for a failure of their own."""


@contextmanager
def processor_time_limit(seconds: float) -> Iterator[None]:
    """Context that ends when this process has computed for so long, however busy the machine is.

    TimeLimitError if the seconds of processor time are over. A native library that computes is left first.
    Outside of the main thread, and where the system has no such timer, there is no limit.
    """
    if not hasattr(signal, "ITIMER_PROF") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise _TimeIsUp

    before = signal.signal(signal.SIGPROF, stop)
    try:
        # Again every second: a native library may swallow the first.
        signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
    except _TimeIsUp:
        raise TimeLimitError(f"did not end within {seconds:g} s of processor time") from None
    finally:
        signal.signal(signal.SIGPROF, before)


@contextmanager
def _interrupt_held() -> Iterator[None]:
    """Hold Ctrl-C back while processes start: they inherit that, and an interrupted start would hang."""
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    resource_tracker.ensure_running()  # its own start would let the signal through
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _numbered(work: Callable[[T], R], number: int, item: T) -> tuple[int, R]:
    return number, work(item)


def _prepare(parent: int) -> None:
    """Make a new process deaf to Ctrl-C, which its parent sees to, and end it with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(parent)
