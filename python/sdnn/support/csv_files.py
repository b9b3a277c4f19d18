"""Tables as comma-separated values, in pieces that may be compressed."""

from __future__ import annotations

import csv
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from io import StringIO
from itertools import chain

_PIECE_CHARACTERS = 2**20  # least length of a piece but the last; chosen
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of cells that a spreadsheet runs, unless they are numbers."""
_NUMBER = re.compile(r"[+-]?\.?\d[\d.]*(e[+-]?\d+)?")
_GZIP = 16 + 15  # zlib's `wbits` for gzip's header and a window of 2**15 bytes, the largest


def csv_bytes(header: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    """Return a table as comma-separated values, UTF-8, one line feed after each row.

    A text that a spreadsheet would run as a formula gets an apostrophe before it; numbers do not.
    """
    return b"".join(csv_pieces(header, rows))


def csv_pieces(header: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[bytes]:
    """Yield comma-separated values in pieces, for tables that are larger than the memory."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in chain([header], rows):
        writer.writerow([_escape_formula(cell) if isinstance(cell, str) else cell for cell in row])
        if text.tell() >= _PIECE_CHARACTERS:
            yield text.getvalue().encode()
            text.seek(0)
            text.truncate()
    yield text.getvalue().encode()


@lru_cache  # most texts of a table are repeated in many rows
def _escape_formula(text: str) -> str:
    """Return the text of a cell, with an apostrophe before it if a spreadsheet would run it."""
    is_formula = text.startswith(_FORMULA) and not _NUMBER.fullmatch(text)
    return f"'{text}" if is_formula else text


def gzip_pieces(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Compress pieces as gzip does, quickly; equal content gives equal bytes at any time.

    The header has no date, unlike that of `gzip.compress` by default.
    """
    compressor = zlib.compressobj(level=1, wbits=_GZIP)
    for piece in pieces:
        yield compressor.compress(piece)
    yield compressor.flush()
