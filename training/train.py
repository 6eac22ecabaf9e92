"""``python -m training.train``: see :mod:`training.learners.sb3`."""

import sys

from training.learners.sb3 import main

if __name__ == "__main__":
    sys.exit(main())
