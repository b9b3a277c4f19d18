"""``python -m sdnn`` is the command ``sdnn``."""

import os
import sys

if os.path.realpath(sys.path[0]) == os.getcwd():  # the folder that -m adds
    del sys.path[0]  # import no package from the present folder

from sdnn.cli import main

if __name__ == "__main__":
    main(prog_name="python -m sdnn")
