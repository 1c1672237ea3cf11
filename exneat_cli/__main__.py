"""`python -m exneat_cli`: the same program as `exneat`."""

import sys

from exneat_cli.main import program

if __name__ == "__main__":
    sys.exit(program())
