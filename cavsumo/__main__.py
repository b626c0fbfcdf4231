"""``python -m cavsumo``: the command line."""

import sys

from cavsumo.cli import main

if __name__ == "__main__":
    sys.exit(main())
