"""The program: `touch2touch`, or `python -m touch2touch`, is the studio; with a verb it is its command line."""

import signal
import sys

from . import _native


def main() -> int:
    # Python itself looks at Ctrl-C only when the program has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["touch2touch", *sys.argv[1:]], [sys.executable, "-m", "touch2touch"])


if __name__ == "__main__":
    sys.exit(main())
