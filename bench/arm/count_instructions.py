"""Counts the instructions of kernels on 64-bit Arm: plain loops as compiled, and written for NEON.

Needs Debian's compilers and an emulator: apt install gcc g++-aarch64-linux-gnu qemu-user. Counts
are exact; of time an emulator says nothing. A kernel's count is that of a run with two calls, less
that of a run with one.

usage: python bench/arm/count_instructions.py
"""

import re
import subprocess
import sysconfig
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
KERNELS = {
    "hidden_pass": "hidden pass, 900 units, 1,200 of 2,400 columns",
    "dense_product": "dense product of 32-bit floats, 900 x 2,400",
    "inner_product": "inner product of two codes of 2,560 columns",
    "signed_sums": "sum of 100 rows of 960 16-bit weights",
    "acrobots": "64 acrobots, one decision interval",
}


def build(folder):
    """Compile the kernels, as users compile the library, and the plugin; return what runs them."""
    here = Path(__file__).parent
    eigen = Path(sysconfig.get_path("purelib"), "cmeel.prefix", "include", "eigen3")
    program, plugin = folder / "passes", folder / "instruction_count.so"
    options = (
        "-std=c++20",
        "-O3",
        "-DNDEBUG",
        "-ffp-contract=off",
        "-DSDNN_NO_CONTRACTION",
        f"-I{ROOT / 'cpp' / 'include'}",
        f"-I{ROOT / 'cpp'}",
    )
    headers = (f"-I{eigen}", "-isystem", "/usr/include/eigen3")
    subprocess.run(
        ["aarch64-linux-gnu-g++", *options, *headers, here / "passes.cpp", "-o", program],
        check=True,
    )
    subprocess.run(
        ["gcc", "-O2", "-shared", "-fPIC", here / "instruction_count.c", "-o", plugin], check=True
    )
    return ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu", "-plugin", plugin, program]


def instructions(command, kernel, level, n):
    """Count the instructions of a whole run."""
    run = subprocess.run(
        [*command, kernel, level, str(n)], capture_output=True, text=True, check=True
    )
    return int(re.search(r"instructions (\d+)", run.stderr)[1])


def main():
    with tempfile.TemporaryDirectory() as folder:
        command = build(Path(folder))
        print("| kernel | portable | NEON | ratio |")
        print("|---|---|---|---|")
        for kernel, title in KERNELS.items():
            counts = {
                level: instructions(command, kernel, level, 2)
                - instructions(command, kernel, level, 1)
                for level in ("portable", "neon")
            }
            ratio = counts["portable"] / counts["neon"]
            print(
                f"| {title} | {counts['portable']:,} | {counts['neon']:,} | {ratio:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
