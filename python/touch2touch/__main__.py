"""`touch2touch`, or `python -m touch2touch`, opens the studio; with a verb it runs the command line."""

import signal
import sys

from . import _native


def main() -> int:
    # Python handles Ctrl-C only after the program has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["touch2touch", *sys.argv[1:]], [sys.executable, "-m", "touch2touch"])


if __name__ == "__main__":
    sys.exit(main())
