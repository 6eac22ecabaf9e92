"""``python -m training.bench``."""

import sys

from training.bench.command import main

if __name__ == "__main__":
    sys.exit(main())
