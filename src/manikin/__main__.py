"""``python -m manikin`` is the command line."""

import sys

from manikin.cli import main

sys.exit(main(sys.argv[1:]))
