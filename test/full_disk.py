"""A disk that is full, for this process: the system refuses to write on."""

import resource
import signal
from contextlib import contextmanager


@contextmanager
def full_disk(room):
    """Let this process write no file beyond ``room`` bytes: the system refuses, as a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
