import gzip
import os
import threading
import time
from pathlib import Path

import pytest

from sdnn.whole_files import (
    PARTIAL_SUFFIX,
    csv_bytes,
    csv_pieces,
    gzip_pieces,
    remove_abandoned_files,
    write_whole,
)


def test_a_file_is_written_as_a_whole(tmp_path):
    path = tmp_path / "report.html"
    write_whole(path, b"one")
    write_whole(path, b"two")
    assert path.read_bytes() == b"two"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path):
    path = tmp_path / "report.html"
    path.mkdir()
    with pytest.raises(OSError, match=r"report\.html"):
        write_whole(path, b"new")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "no" / "folder", b"")


def test_what_a_kill_left_is_removed_and_nothing_else(tmp_path):
    left = tmp_path / f"results.csv.1.0{PARTIAL_SUFFIX}"
    left.write_bytes(b"half")
    (tmp_path / f"results.csv.2.0{PARTIAL_SUFFIX}").write_bytes(b"another process is writing")
    mine = [tmp_path / "mine.txt", tmp_path / f"mine{PARTIAL_SUFFIX}"]
    long_ago = time.time() - 3600
    for path in (left, *mine):
        path.write_bytes(b"old")
        os.utime(path, (long_ago, long_ago))
    remove_abandoned_files(tmp_path)
    assert set(tmp_path.iterdir()) == {tmp_path / f"results.csv.2.0{PARTIAL_SUFFIX}", *mine}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a system of POSIX")
def test_links_and_pipes_stay_what_they_are(tmp_path):
    target, link, pipe = tmp_path / "target", tmp_path / "link", tmp_path / "pipe"
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_whole(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"through")
    reader.join()
    assert read == [b"through"]
    assert pipe.is_fifo()
    ends = os.pipe()
    if Path(f"/dev/fd/{ends[1]}").exists():  # as /dev/stdout: a link to no name
        write_whole(Path(f"/dev/fd/{ends[1]}"), b"through, too")
        assert os.read(ends[0], 100) == b"through, too"
    for end in ends:
        os.close(end)
    assert len(list(tmp_path.iterdir())) == 3


def test_two_writers_of_one_file_leave_one_of_their_files(tmp_path):
    path = tmp_path / "report.html"
    contents = [bytes([letter]) * 300_000 for letter in b"ab"]
    write_whole(path, contents[0])
    errors = []

    def write(content):
        try:
            for _ in range(30):
                write_whole(path, [content[:1000], content[1000:]])
        except OSError as error:
            errors.append(error)

    writers = [threading.Thread(target=write, args=(content,)) for content in contents]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert path.read_bytes() in contents
    assert errors == []
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_csv_quotes_what_needs_it():
    assert csv_bytes(("a", "b"), [(1, "x, y"), (2.5, "µ")]) == 'a,b\n1,"x, y"\n2.5,µ\n'.encode()


def test_large_tables_are_written_in_pieces(tmp_path):
    rows = [(number, "x" * 100) for number in range(30_000)]
    pieces = list(csv_pieces(("a", "b"), rows))
    assert len(pieces) > 2
    assert b"".join(pieces) == csv_bytes(("a", "b"), rows)
    assert len(list(csv_pieces(("a",), []))) == 1
    path = tmp_path / "rows.csv.gz"
    write_whole(path, gzip_pieces(pieces))
    assert gzip.decompress(path.read_bytes()) == b"".join(pieces)
    assert b"".join(gzip_pieces(pieces)) == path.read_bytes()


def test_pieces_that_fail_leave_no_file(tmp_path):
    def pieces():
        yield b"one"
        raise ValueError("no second piece")

    with pytest.raises(ValueError, match="second"):
        write_whole(tmp_path / "rows.csv", pieces())
    assert list(tmp_path.iterdir()) == []
