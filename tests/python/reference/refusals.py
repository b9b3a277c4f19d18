"""Check of errors: only what a message must name is compared, not its other words."""

import re

import pytest


def refuses(name, call, /, *arguments, error=ValueError, **options):
    """Check that a call raises an error whose message has ``name`` as a word; return the error.

    ``name`` is that of an argument or a file, or a value, so that messages can be reworded.
    """
    assert not re.search(r"[a-z] ", name), "a name, not words"
    with pytest.raises(error) as refused:
        call(*arguments, **options)
    message = str(refused.value)
    assert re.search(rf"(?<!\w){re.escape(name)}(?!\w)", message), f"{name} in: {message}"
    return refused.value
