"""The window, from Python."""

import os
import subprocess
import sys


def studio(data: str | os.PathLike[str] | None = None) -> subprocess.Popen[bytes]:
    """Opens the studio on a folder, a file or a built-in data set such as "demo", by default on the last one.

    The window runs in a separate process and the call returns at once; `studio("demo").wait()` waits until it is closed.
    """
    return subprocess.Popen([sys.executable, "-m", "touch2touch", *([] if data is None else [os.fspath(data)])])
