"""Prints the files of the package in which a command calls a function, as a JSON list.

Usage: footprint.py COMMAND... Executed bodies of modules and classes are no calls. The command ends
when it saves its first figure. A line before the list has the number of files that is reached if
bodies of classes count as calls.
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
    """Record the file of a call, if it is of the package; the function of a profiler."""
    code = frame.f_code
    if event == "call" and code.co_name == "savefig":
        finish()
    is_ours = code.co_filename.startswith(PACKAGE) and code.co_filename.endswith(".py")
    if event == "call" and is_ours and code.co_name != "<module>":
        name = code.co_filename.removeprefix(PACKAGE)
        WITH_CLASSES.add(name)
        if code.co_flags & inspect.CO_OPTIMIZED:  # a function, not the body of a class
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
