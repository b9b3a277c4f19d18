"""Files appear whole or not at all: a partial file is written and then renamed."""

import gzip
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from refusals import refuses
from sdnn.support import files
from sdnn.support.csv_files import csv_bytes, csv_pieces, gzip_pieces
from sdnn.support.files import PARTIAL_SUFFIX, remove_abandoned_files, write_whole

WRITE_SLOWLY = """
import sys, time
from pathlib import Path
from sdnn.support.files import whole_file

with whole_file(Path(sys.argv[1])) as file:
    file.write(b"half")
    file.flush()
    print("half", flush=True)
    time.sleep(600)
"""


def partial_files(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"*{PARTIAL_SUFFIX}"))


def test_write_whole_replaces_a_file_and_leaves_no_partial_one(tmp_path):
    path = tmp_path / "report.html"
    write_whole(path, b"one")
    write_whole(path, b"two")
    assert path.read_bytes() == b"two"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_a_failed_write_keeps_the_existing_path(tmp_path):
    path = tmp_path / "report.html"
    path.mkdir()
    refuses("report.html", write_whole, path, b"new", error=OSError)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_only_partial_files_of_dead_processes_are_removed(tmp_path):
    write_whole(tmp_path / "rows.csv", b"old")
    other_file = tmp_path / f"notes{PARTIAL_SUFFIX}"  # a name that the package never gives
    other_file.write_bytes(b"mine")
    command = [sys.executable, "-c", WRITE_SLOWLY, str(tmp_path / "rows.csv")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"half\n"
            before = partial_files(tmp_path)
            assert len(before) == 2, "the partial file of the process, and the other file"
            remove_abandoned_files(tmp_path)
            assert partial_files(tmp_path) == before
        finally:
            process.kill()
    remove_abandoned_files(tmp_path)
    assert partial_files(tmp_path) == [other_file]
    assert (tmp_path / "rows.csv").read_bytes() == b"old"


@pytest.mark.parametrize(("age_in_seconds", "is_kept"), [(0, True), (3600, False)])
def test_without_file_locks_partial_files_are_removed_after_an_hour(
    tmp_path, monkeypatch, age_in_seconds, is_kept
):
    monkeypatch.setattr(files, "lock", lambda descriptor: None)
    abandoned = tmp_path / f"rows.csv.0123456789abcdef{PARTIAL_SUFFIX}"
    other_files = {tmp_path / "mine.txt", tmp_path / f"mine{PARTIAL_SUFFIX}"}
    for path in (abandoned, *other_files):
        path.write_bytes(b"half")
        os.utime(path, (time.time() - age_in_seconds,) * 2)
    remove_abandoned_files(tmp_path)
    assert set(tmp_path.iterdir()) == other_files | ({abandoned} if is_kept else set())
    write_whole(tmp_path / "rows.csv", b"whole")
    assert (tmp_path / "rows.csv").read_bytes() == b"whole"


def test_a_partial_file_that_is_removed_before_it_is_locked_is_created_again(tmp_path, monkeypatch):
    locks = []

    def remove_the_first_file_and_lock(descriptor: int) -> bool:
        if not locks:
            for path in partial_files(tmp_path):
                path.unlink()
        locks.append(descriptor)
        return True

    monkeypatch.setattr(files, "lock", remove_the_first_file_and_lock)
    write_whole(tmp_path / "rows.csv", b"whole")
    assert len(locks) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a system of POSIX")
def test_write_whole_replaces_pipes_and_links_to_files_and_devices(tmp_path):
    target = tmp_path / "target"
    target.write_bytes(b"old")
    link, dangling, pipe, device = (tmp_path / str(number) for number in range(4))
    link.symlink_to(target)
    dangling.symlink_to(tmp_path / "nothing")
    os.mkfifo(pipe)  # without a reader, for which writing would wait
    device.symlink_to("/dev/null")
    for path in (link, dangling, pipe, device):
        write_whole(path, b"new")
        assert not path.is_symlink()
        assert path.read_bytes() == b"new"
    assert target.read_bytes() == b"old"
    assert set(tmp_path.iterdir()) == {target, link, dangling, pipe, device}


def test_write_whole_writes_to_devices():
    read_end, write_end = os.pipe()
    device = Path(f"/dev/fd/{write_end}")  # like /dev/stdout
    if device.exists():
        write_whole(device, b"through")
        assert os.read(read_end, 100) == b"through"
    os.close(read_end)
    os.close(write_end)


def test_concurrent_writers_leave_the_whole_file_of_one_of_them(tmp_path):
    path = tmp_path / "report.html"
    contents = [b"a" * 300_000, b"b" * 300_000]
    write_whole(path, contents[0])

    def write(content):
        for _ in range(30):
            write_whole(path, [content[:1000], content[1000:]])

    with ThreadPoolExecutor() as pool:
        writers = [pool.submit(write, content) for content in contents]
        while not all(writer.done() for writer in writers):
            assert path.read_bytes() in contents
    assert [writer.result() for writer in writers] == [None, None], "without an error"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_csv_quotes_cells_with_commas():
    assert csv_bytes(("a", "b"), [(1, "x, y"), (2.5, "µ")]) == 'a,b\n1,"x, y"\n2.5,µ\n'.encode()


def test_pieces_of_a_large_csv_table_are_the_whole_table():
    rows = [(number, "x" * 100) for number in range(30_000)]
    pieces = list(csv_pieces(("a", "b"), rows))
    assert len(pieces) > 2
    assert b"".join(pieces) == csv_bytes(("a", "b"), rows)


def test_a_csv_table_without_rows_is_one_piece():
    assert list(csv_pieces(("a",), [])) == [b"a\n"]


def test_compressed_pieces_hold_the_content_and_have_the_same_bytes_again(tmp_path):
    pieces = [b"a" * 100_000, b"b" * 100_000]
    path = tmp_path / "rows.csv.gz"
    write_whole(path, gzip_pieces(pieces))
    assert gzip.decompress(path.read_bytes()) == b"".join(pieces)
    assert b"".join(gzip_pieces(pieces)) == path.read_bytes()


def test_an_error_between_pieces_leaves_no_file(tmp_path):
    def pieces():
        yield b"one"
        raise ValueError("no second piece")

    refuses("second", write_whole, tmp_path / "rows.csv", pieces())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device here")
def test_an_error_of_a_full_device_names_it():
    refuses("/dev/full", write_whole, Path("/dev/full"), b"much", error=OSError)


def test_a_missing_folder_is_an_error_with_the_path(tmp_path):
    with pytest.raises(FileNotFoundError) as refused:
        write_whole(tmp_path / "none" / "out.txt", b"x")
    assert refused.value.filename == str(tmp_path / "none" / "out.txt")
