"""Crafted files: whatever they hold, with the checksum that it should have."""

import zlib

BEFORE = b'{"__metadata__":{"sdnn":"{\\"checksum\\":\\"'


def with_checksum(content):
    """Return the bytes of a file with the right checksum in its place."""
    start = 8 + len(BEFORE)
    assert content[8:start] == BEFORE
    crc = zlib.crc32(content[:start] + content[start + 8 :])
    return content[:start] + f"{crc:08x}".encode() + content[start + 8 :]
