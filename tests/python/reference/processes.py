"""Separate processes of Python, which find the modules that this one finds."""

import os
import subprocess
import sys
from pathlib import Path


def environment(**variables):
    """Return the variables of this process, with its module path and further variables."""
    path = os.pathsep.join(str(Path(folder).resolve()) for folder in sys.path if folder)
    return os.environ | {"PYTHONPATH": path} | variables


def python(*arguments, **options):
    """Run Python with these arguments to its end, and return the finished process."""
    settings = {"capture_output": True, "text": True, "check": False, "env": environment()}
    return subprocess.run([sys.executable, *map(str, arguments)], **(settings | options))
