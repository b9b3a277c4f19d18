import pytest

from sdnn.whole_files import PARTIAL_SUFFIX, csv_bytes, remove_partial_files, write_whole


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
