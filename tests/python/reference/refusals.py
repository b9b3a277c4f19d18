"""Errors name what they refuse: the one place where tests look at the words of a message."""

import re

import pytest


def refuses(name, call, /, *arguments, error=ValueError, **options):
    """Check that a call is refused, and that the error names an argument, a file or a value.

    No words around the name are looked at, so that messages can be written better. Returns the
    error.
    """
    assert not re.search(r"[a-z] ", name), "a name, not words"
    with pytest.raises(error) as refused:
        call(*arguments, **options)
    message = str(refused.value)
    assert re.search(rf"(?<!\w){re.escape(name)}(?!\w)", message), f"{name} in: {message}"
    return refused.value
