"""Prints the files of the package in which a command calls a function, as a JSON list.

Usage: footprint.py COMMAND... Bodies of modules and classes do not count; nor does what comes after
the first figure, where one is drawn.
"""

import inspect
import json
import os
import sys
import threading

import sdnn
from sdnn.cli import main

PACKAGE = os.path.dirname(sdnn.__file__) + os.sep
FILES = set()


def watch(frame, event, _argument):
    code = frame.f_code
    if event == "call" and code.co_name == "savefig":
        finish()
    is_function = event == "call" and code.co_flags & inspect.CO_OPTIMIZED
    if is_function and code.co_filename.startswith(PACKAGE) and code.co_filename.endswith(".py"):
        FILES.add(code.co_filename.removeprefix(PACKAGE))


def finish():
    sys.setprofile(None)
    print(json.dumps(sorted(FILES)), file=sys.stderr, flush=True)
    os._exit(0)


threading.setprofile(watch)
sys.setprofile(watch)
try:
    main(sys.argv[1:], standalone_mode=False)
finally:
    finish()
