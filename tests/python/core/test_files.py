"""The format of agents', trainings' and estimators' files: read as written, refused if damaged."""

import json
import os

import gymnasium as gym
import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

import agent_files
import sdnn
from checksums import with_checksum
from refusals import refuses
from sdnn import SDNNRegressor
from sdnn.agents import SDNNQLearning, Training, load_agent
from sdnn.support import files
from sdnn.support.files import read_file, write_file

KINDS = ("agent", "training", "estimator")
ARRAYS = {
    "b": np.array([[1, -1]], np.int16),
    "a": np.array(2.5),
    "none": np.zeros((0, 3), np.uint8),
    "turned": np.arange(6, dtype=np.int32).reshape(2, 3).T,
}
DESCRIPTION = {"text": "é \ud800", "b": {"z": 1, "a": [None, True, 0.1, float("inf")]}}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Pairs by kind of file: the bytes of a file, and the function that reads such files."""
    folder = tmp_path_factory.mktemp("saved")
    env = gym.make("Pendulum-v1")
    agent = SDNNQLearning(env, approximator=agent_files.SMALL)
    agent.save(folder / "agent")
    Training(agent, env, steps=5).save(folder / "training")
    samples = np.random.default_rng(0).uniform(size=(20, 2))
    SDNNRegressor(n_pattern_units=30, max_iter=2).fit(samples, samples[:, 0]).save(
        folder / "estimator"
    )
    read = {
        "agent": load_agent,
        "training": lambda path: Training.load(path, env),
        "estimator": SDNNRegressor.load,
    }
    return {kind: ((folder / kind).read_bytes(), read[kind]) for kind in KINDS}


def test_a_file_is_read_exactly_as_written(tmp_path):
    path = tmp_path / "file"
    write_file(path, "agent", ARRAYS, DESCRIPTION)
    description, arrays = read_file(path, "training", "agent")
    assert description == DESCRIPTION
    assert arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], array, strict=True)
        assert arrays[name].flags.writeable


def test_a_file_that_is_read_and_written_again_has_the_same_bytes(tmp_path):
    path = tmp_path / "file"
    write_file(path, "agent", ARRAYS, DESCRIPTION)
    content = path.read_bytes()
    description, arrays = read_file(path, "agent")
    write_file(path, "agent", arrays, description)
    assert path.read_bytes() == content


def test_the_checksum_is_the_crc_32_of_all_other_bytes(tmp_path):
    write_file(tmp_path / "file", "agent", ARRAYS, DESCRIPTION)
    content = (tmp_path / "file").read_bytes()
    assert with_checksum(content) == content


def test_files_can_be_read_by_safetensors(tmp_path):
    write_file(tmp_path / "file", "estimator", ARRAYS, DESCRIPTION)
    with safe_open(tmp_path / "file", framework="numpy") as file:
        header = json.loads(file.metadata()["sdnn"])
        np.testing.assert_array_equal(file.get_tensor("turned"), ARRAYS["turned"])
    assert len(header.pop("checksum")) == 8  # 32 bits as hexadecimal digits
    assert header == {
        "kind": "estimator",
        "format": files.FORMAT,
        "version": sdnn.__version__,
        "description": DESCRIPTION,
    }


@pytest.mark.parametrize("kind", KINDS)
def test_readers_refuse_files_of_another_kind(saved, kind, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(saved[kind][0])
    for expected_kind, (_, read) in saved.items():
        # A training's file contains an agent, which can be read from it.
        if expected_kind == kind or (expected_kind, kind) == ("agent", "training"):
            read(path)
        else:
            refuses(kind, read, path)


@pytest.mark.parametrize(
    "metadata", [None, {"sdnn": '{"format": "sdnn-agent-1", "class": "SDNNQLearning"}'}]
)
def test_files_of_other_programs_are_refused(metadata, tmp_path):
    path = tmp_path / "other"
    save_file(ARRAYS, path, metadata)
    refuses("other", read_file, path, *KINDS)


def test_a_changed_byte_is_refused_by_the_checksum(tmp_path):
    path = tmp_path / "file"
    write_file(path, "agent", ARRAYS, {})
    path.write_bytes(path.read_bytes().replace(rb"\"format\":1,", rb"\"format\":2,"))
    refuses("damaged", read_file, path, "agent")


def test_a_file_of_a_newer_format_is_refused_with_the_version_that_wrote_it(tmp_path):
    path = tmp_path / "file"
    write_file(path, "agent", ARRAYS, {})
    content = path.read_bytes().replace(rb"\"format\":1,", rb"\"format\":2,")
    newer = content.replace(sdnn.__version__.encode(), b"9.9.9")
    path.write_bytes(with_checksum(newer))
    refuses("9.9.9", read_file, path, "agent")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (rb"\"kind\":", rb"\"king\":"),
        (rb"\"description\":{}", rb"\"description\":77"),
        (rb"\"format\":1", rb"\"format\":,"),
        (b'"I16"', b'"I17"'),
        (b"[1,2]", b"[1,3]"),
    ],
)
def test_invalid_content_is_refused_despite_a_valid_checksum(old, new, tmp_path):
    path = tmp_path / "crafted"
    write_file(path, "agent", ARRAYS, {})
    content = path.read_bytes()
    assert old in content
    path.write_bytes(with_checksum(content.replace(old, new)))
    refuses("crafted", read_file, path, "agent")


def test_only_regular_files_are_read(tmp_path):
    refuses("nothing", read_file, tmp_path / "nothing", "agent", error=FileNotFoundError)
    others = [tmp_path]
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")  # without a writer, for which reading would wait
        (tmp_path / "link").symlink_to(tmp_path / "pipe")
        others += [tmp_path / "pipe", tmp_path / "link", "/dev/zero"]
    for path in others:
        with pytest.raises(OSError, match=f"{path}"):
            read_file(path, "agent")


def test_a_file_larger_than_the_limit_is_refused(tmp_path, monkeypatch):
    write_file(tmp_path / "file", "agent", ARRAYS, {})
    monkeypatch.setattr(files, "MAX_BYTES", 100)
    refuses("100", read_file, tmp_path / "file", "agent", error=OSError)
