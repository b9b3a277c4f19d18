"""``python -m sdnn`` is the command ``sdnn``."""

import os
import sys

if os.path.realpath(sys.path[0]) == os.getcwd():  # put there by -m
    del sys.path[0]  # packages that are missing are not looked for in the present folder

from sdnn.cli import main

if __name__ == "__main__":
    main(prog_name="python -m sdnn")
