"""Python in processes of their own, which find the modules that this one finds."""

import os
import subprocess
import sys
from pathlib import Path


def environment(**variables):
    path = os.pathsep.join(str(Path(folder).resolve()) for folder in sys.path if folder)
    return os.environ | {"PYTHONPATH": path} | variables


def python(*arguments, **options):
    """Run Python to its end."""
    settings = {"capture_output": True, "text": True, "check": False, "env": environment()}
    return subprocess.run([sys.executable, *map(str, arguments)], **(settings | options))
