"""Prints the files of the package in which a command calls a function, as a JSON list.

Usage: footprint.py COMMAND... Bodies of modules and classes do not count; nor does what comes after
the first figure, where one is drawn. A line before the list has the number with bodies of classes.
"""

import inspect
import json
import os
import sys
import threading

import sdnn
from sdnn.cli import main

PACKAGE = os.path.dirname(sdnn.__file__) + os.sep
FILES, WITH_CLASSES = set(), set()


def watch(frame, event, _argument):
    code = frame.f_code
    if event == "call" and code.co_name == "savefig":
        finish()
    is_ours = code.co_filename.startswith(PACKAGE) and code.co_filename.endswith(".py")
    if event == "call" and is_ours and code.co_name != "<module>":
        name = code.co_filename.removeprefix(PACKAGE)
        WITH_CLASSES.add(name)
        if code.co_flags & inspect.CO_OPTIMIZED:
            FILES.add(name)


def finish():
    sys.setprofile(None)
    print(f"{len(WITH_CLASSES)} files with bodies of classes", file=sys.stderr)
    print(json.dumps(sorted(FILES)), file=sys.stderr, flush=True)
    os._exit(0)


threading.setprofile(watch)
sys.setprofile(watch)
try:
    main(sys.argv[1:], standalone_mode=False)
finally:
    finish()
