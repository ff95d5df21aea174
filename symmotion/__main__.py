"""`python -m symmotion`: the command line."""

import sys

from symmotion.commands import main

sys.exit(main())
