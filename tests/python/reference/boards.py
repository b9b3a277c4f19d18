"""Boards that QEMU emulates whole: their processor and memory map.

Programs link as firmware does, at the chip's addresses and within its flash and RAM, of which 2 kB
are the stack. They read and write by semihosting, as under a debugger. No board was used.
"""

from dataclasses import dataclass

from c_policies import Target

K = 1024


@dataclass(frozen=True)
class Board:
    """A machine of the emulator and its memory; sizes are those of a chip with this processor."""

    machine: str
    processor: str
    flash: int
    flash_bytes: int
    ram: int
    ram_bytes: int

    def target(self, floats=("-mfloat-abi=soft",)):
        """Return the compiler, on Arm with options for floating point, and the emulator."""
        is_arm = self.processor.startswith("-mcpu")
        memory = {
            "__flash": self.flash, "__flash_size": self.flash_bytes,
            "__ram": self.ram, "__ram_size": self.ram_bytes, "__stack_size": 2 * K,
        }  # fmt: skip
        options = (
            self.processor, *(("-mthumb", *floats) if is_arm else _RISCV),
            "--specs=picolibc.specs", "--oslib=semihost", "--crt0=hosted", "-ffreestanding",
            "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections",
            *(f"-Wl,--defsym={name}={value:#x}" for name, value in memory.items()),
        )  # fmt: skip
        arguments = (
            "-M", self.machine, *_QUIET, *(("-bios", "none") if self.machine == "virt" else ()),
            "-kernel",
        )  # fmt: skip
        compiler = "arm-none-eabi-gcc" if is_arm else "riscv64-unknown-elf-gcc"
        runner = f"qemu-system-{'arm' if is_arm else 'riscv32'}"
        return Target(compiler, runner, options, arguments=arguments, stdio=STDIO)


_RISCV = ("-mabi=ilp32", "-mcmodel=medany")
_QUIET = (
    "-display", "none", "-serial", "none", "-monitor", "none",
    "-semihosting-config", "enable=on,target=native",
)  # fmt: skip
_ZERO, _SRAM = 0, 0x2000_0000
BOARDS = {
    # The micro:bit: nRF51822. The last 28 kB of its flash are for states that programs save.
    "cortex-m0": Board("microbit", "-mcpu=cortex-m0", _ZERO, (256 - 28) * K, _SRAM, 16 * K),
    # LM3S6965, the chip of this board.
    "cortex-m3": Board("lm3s6965evb", "-mcpu=cortex-m3", _ZERO, 256 * K, _SRAM, 64 * K),
    # STM32F405, the chip of this board.
    "cortex-m4": Board("netduinoplus2", "-mcpu=cortex-m4", 0x0800_0000, 1024 * K, _SRAM, 128 * K),
    # An FPGA with the memory of an STM32F745.
    "cortex-m7": Board("mps2-an500", "-mcpu=cortex-m7", _ZERO, 512 * K, _SRAM, 320 * K),
    # An FPGA with the memory of an STM32L562.
    "cortex-m33": Board(
        "mps2-an505", "-mcpu=cortex-m33", 0x1000_0000, 512 * K, 0x8000_0000, 256 * K
    ),
    # The HiFive1: FE310, of whose flash a program gets 1 MB.
    "fe310": Board("sifive_e", "-march=rv32imc", 0x2040_0000, 1024 * K, 0x8000_0000, 16 * K),
    # A machine without a model, with less memory than an ESP32-C3 has.
    "rv32imc": Board("virt", "-march=rv32imc", 0x8000_0000, 1024 * K, 0x8020_0000, 256 * K),
}

STDIO = """
#pragma once
#include <stddef.h>
#include <stdint.h>
#define stdin 0
#define stdout 1
int printf(const char *format, ...);
int sys_semihost_open(const char *path, int mode);
uintptr_t sys_semihost_read(int file, void *data, size_t size); /* how many bytes it did not */
uintptr_t sys_semihost_write(int file, const void *data, uintptr_t size);
static inline int opened(int file) {
  static int files[2] = {-1, -1};
  static const char *const paths[2] = {"/dev/stdin", "/dev/stdout"};
  if (files[file] < 0) files[file] = sys_semihost_open(paths[file], file == stdin ? 1 : 5);
  return files[file];
}
static inline size_t fread(void *data, size_t size, size_t n, int file) {
  size_t left = size * n;
  while (left > 0) {
    const size_t now = sys_semihost_read(opened(file), (char *)data + (size * n - left), left);
    if (now == left) return 0;
    left = now;
  }
  return n;
}
static inline size_t fwrite(const void *data, size_t size, size_t n, int file) {
  return sys_semihost_write(opened(file), data, size * n) == 0 ? n : 0;
}
"""
"""<stdio.h> as far as the programs need it; a part of an input's last row counts as its end."""
