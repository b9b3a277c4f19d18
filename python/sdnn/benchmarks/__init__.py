"""Benchmarks: how long the parts of a decision take here.

``sdnn bench`` on the command line; `run_benchmarks` from Python.
"""

from sdnn.benchmarks.measurements import run_benchmarks

__all__ = ["run_benchmarks"]
