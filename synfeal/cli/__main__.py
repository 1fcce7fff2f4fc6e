"""``python -m synfeal.cli``."""

import sys

from synfeal.cli.program import main

if __name__ == "__main__":
    sys.exit(main())
