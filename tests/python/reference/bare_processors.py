"""Compilers for microcontrollers without a C library, and an emulator of Linux programs for them.

The programs call Linux themselves to read and write. Their compiled code is tested, not a board.
"""

from c_policies import Target

_ALONE = (
    "-ffreestanding", "-nostdlib", "-fuse-ld=lld", "-fomit-frame-pointer", "-Wno-unused-function",
)  # fmt: skip
_BARE = {
    "armv6-m": ("--target=thumbv6m-none-eabi", "qemu-arm"),
    "armv7e-m": ("--target=thumbv7em-none-eabi", "qemu-arm"),
    "riscv32": ("--target=riscv32-none-elf", "qemu-riscv32", "-march=rv32im", "-mno-relax"),
}
STDIO = """
#include <stddef.h>
#include <stdint.h>
#define stdin 0
#define stdout 1
static intptr_t called(intptr_t number, intptr_t file, intptr_t data, intptr_t size) {
#ifdef __arm__
  register intptr_t what __asm__("r7") = number;
  register intptr_t a __asm__("r0") = file;
  register intptr_t b __asm__("r1") = data;
  register intptr_t c __asm__("r2") = size;
  __asm__ volatile("svc 0" : "+r"(a) : "r"(what), "r"(b), "r"(c) : "memory");
#else
  register intptr_t what __asm__("a7") = number + 60; /* Linux: 63, 64, and 93 for 33 */
  register intptr_t a __asm__("a0") = file;
  register intptr_t b __asm__("a1") = data;
  register intptr_t c __asm__("a2") = size;
  __asm__ volatile("ecall" : "+r"(a) : "r"(what), "r"(b), "r"(c) : "memory");
#endif
  return a;
}
static size_t moved(intptr_t number, intptr_t file, intptr_t data, size_t size, size_t n) {
  size_t done = 0;
  while (done < size * n) {
    const intptr_t got = called(number, file, data + (intptr_t)done, (intptr_t)(size * n - done));
    if (got <= 0) break;
    done += (size_t)got;
  }
  return done == size * n ? n : 0;
}
static size_t fread(void *data, size_t size, size_t n, int file) {
  return moved(3, file, (intptr_t)data, size, n);
}
static size_t fwrite(const void *data, size_t size, size_t n, int file) {
  return moved(4, file, (intptr_t)data, size, n);
}
int main(void);
void _start(void);
void _start(void) {
  const int code = main();
#ifdef __arm__
  called(1, code, 0, 0);
#else
  called(33, code, 0, 0);
#endif
  for (;;) {
  }
}
#if defined(__arm__) && !defined(__ARM_ARCH_7EM__)
/* What is called of the compiler's library: 64 bits by parts of 32 bits. */
typedef union {
  uint64_t whole;
  uint32_t parts[2];
} Wide;
uint64_t __aeabi_lmul(uint64_t a, uint64_t b);
uint64_t __aeabi_llsl(uint64_t a, int n);
uint64_t __aeabi_llsr(uint64_t a, int n);
int64_t __aeabi_lasr(int64_t a, int n);
uint64_t __aeabi_lmul(uint64_t a, uint64_t b) {
  Wide x, y, z;
  uint32_t low, middle, other, i, j;
  x.whole = a;
  y.whole = b;
  i = x.parts[0];
  j = y.parts[0];
  low = (i & 65535) * (j & 65535);
  middle = (i >> 16) * (j & 65535) + (low >> 16);
  other = (i & 65535) * (j >> 16) + (middle & 65535);
  z.parts[0] = other << 16 | (low & 65535);
  z.parts[1] = (i >> 16) * (j >> 16) + (middle >> 16) + (other >> 16) + i * y.parts[1] +
               x.parts[1] * j;
  return z.whole;
}
uint64_t __aeabi_llsl(uint64_t a, int n) {
  Wide x;
  x.whole = a;
  if (n >= 32) {
    x.parts[1] = x.parts[0] << (n - 32);
    x.parts[0] = 0;
  } else if (n > 0) {
    x.parts[1] = x.parts[1] << n | x.parts[0] >> (32 - n);
    x.parts[0] <<= n;
  }
  return x.whole;
}
static uint64_t to_the_right(uint64_t a, int n, uint32_t sign) {
  Wide x;
  x.whole = a;
  if (n >= 32) {
    x.parts[0] = x.parts[1];
    x.parts[1] = sign;
    n -= 32;
  }
  if (n > 0) {
    x.parts[0] = x.parts[0] >> n | x.parts[1] << (32 - n);
    x.parts[1] = x.parts[1] >> n | (sign ? sign << (32 - n) : 0);
  }
  return x.whole;
}
uint64_t __aeabi_llsr(uint64_t a, int n) { return to_the_right(a, n, 0); }
int64_t __aeabi_lasr(int64_t a, int n) {
  Wide x;
  x.whole = (uint64_t)a;
  x.whole = to_the_right(x.whole, n, x.parts[1] >> 31 ? UINT32_MAX : 0);
  return (int64_t)x.whole;
}
#endif
"""
"""<stdio.h> as far as the programs need it."""

BARE_TARGETS = {
    name: Target("clang", runner, (option, *more, *_ALONE), stdio=STDIO)
    for name, (option, runner, *more) in _BARE.items()
}
