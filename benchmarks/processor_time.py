"""The processor time that another process has used."""

from __future__ import annotations

from pathlib import Path


def processor_time(pid: int) -> int:
    """Return the processor time of all threads of a process [ns]."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)
