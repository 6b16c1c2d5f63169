"""Memory of a process: how much it may use, and that it gives back what it no longer needs."""

import ctypes
import os
import sys
from pathlib import Path


def limit_memory(more: int) -> None:
    """Let this process use so many bytes more than it does now, and no more; OSError on another system."""
    try:
        import resource
    except ImportError as error:
        raise OSError(f"memory cannot be limited here: {error}") from None
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    most = int(pages) * os.sysconf("SC_PAGE_SIZE") + more
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))


def give_memory_back() -> None:
    """Give memory that is free back to the system, where the allocator keeps it for later (glibc).

    Whole-body fits leave holes of hundreds of megabytes between what is kept.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
