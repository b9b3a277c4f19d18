"""The name of the processor and the number of its cores."""

import os
import platform

from sdnn.support import machine


def test_the_name_of_the_processor_is_read_from_cpuinfo(tmp_path, monkeypatch):
    cpuinfo = tmp_path / "cpuinfo"
    monkeypatch.setattr(machine, "_PROCESSOR_FILE", cpuinfo)
    cpuinfo.write_text("processor : 0\nmodel name\t: Fast One @ 1 GHz\nmodel name\t: Other\n")
    assert machine.processor() == "Fast One @ 1 GHz"
    assert machine.description() == f"Fast One @ 1 GHz, {machine.instruction_set()}"


def test_a_processor_without_a_name_is_unknown(tmp_path, monkeypatch):
    monkeypatch.setattr(machine, "_PROCESSOR_FILE", tmp_path / "none")
    monkeypatch.setattr(platform, "processor", lambda: "")
    assert machine.processor() == "unknown"


def test_n_cores_counts_the_cores_available_to_the_process(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 5}, raising=False)
    assert machine.n_cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert machine.n_cores() == 1
