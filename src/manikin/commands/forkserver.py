"""Processes that are ready by the time this one knows what they shall do."""

import multiprocessing
from multiprocessing import forkserver


def preload(module: str) -> None:
    """Let a server of processes import a module while this process goes on.

    Importing takes seconds, and the processes that the server starts have it done already. Nothing happens on
    systems without such servers.
    """
    if "forkserver" in multiprocessing.get_all_start_methods():
        forkserver.set_forkserver_preload([module])
        forkserver.ensure_running()
