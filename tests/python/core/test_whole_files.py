import gzip

import pytest

from sdnn.whole_files import (
    PARTIAL_SUFFIX,
    csv_bytes,
    csv_pieces,
    gzip_pieces,
    remove_partial_files,
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
    (tmp_path / f"results.csv{PARTIAL_SUFFIX}").write_bytes(b"half")
    (tmp_path / "mine.txt").write_bytes(b"whole")
    remove_partial_files(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


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
