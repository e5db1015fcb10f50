"""The window, from Python."""

import os
import subprocess
import sys


def studio(data: str | os.PathLike[str] | None = None) -> subprocess.Popen[bytes]:
    """Opens the studio on a folder, a file or a built-in data set such as "demo", else on what was open last.

    The window has a process of its own, so that the caller goes on: `studio("demo").wait()` waits until it is closed.
    """
    return subprocess.Popen([sys.executable, "-m", "touch2touch", *([] if data is None else [os.fspath(data)])])
