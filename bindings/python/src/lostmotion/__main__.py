"""``python -m lostmotion``."""

import sys

from lostmotion.cli import main

sys.exit(main())
