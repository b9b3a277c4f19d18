"""``python -m sdnn`` is the command ``sdnn``."""

from sdnn.cli import main

if __name__ == "__main__":
    main(prog_name="python -m sdnn")
