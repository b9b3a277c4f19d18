"""Benchmarks: how long the parts of a decision take here, and what this machine allows.

``sdnn bench`` on the command line; `run_benchmarks` from Python.
"""

from __future__ import annotations

from sdnn.benchmarks.run import BenchmarkError, run_benchmarks

__all__ = ["BenchmarkError", "run_benchmarks"]
