"""Compilers for microcontrollers without a C library, and emulators of Linux programs for them.

QEMU runs a program as a Linux program of that processor, so that it can read and write by system
calls. The compiled code of the headers is tested, not a board.
"""

from c_policies import Target

_ALONE = (
    "-ffreestanding", "-nostdlib", "-fuse-ld=lld", "-fomit-frame-pointer", "-Wno-unused-function",
)  # fmt: skip
_BARE = {
    "armv6-m": ("qemu-arm", "--target=thumbv6m-none-eabi"),
    "armv7e-m": ("qemu-arm", "--target=thumbv7em-none-eabi"),
    "riscv32": ("qemu-riscv32", "--target=riscv32-none-elf", "-march=rv32im", "-mno-relax"),
}
STDIO = """
#include <stddef.h>
#include <stdint.h>
#define stdin 0
#define stdout 1
/* Calls Linux by the numbers of 32-bit Arm: 1 exit, 3 read, 4 write. */
static intptr_t system_call(intptr_t number, intptr_t file, intptr_t data, intptr_t size) {
#ifdef __arm__
  register intptr_t n __asm__("r7") = number;
  register intptr_t a __asm__("r0") = file;
  register intptr_t b __asm__("r1") = data;
  register intptr_t c __asm__("r2") = size;
  __asm__ volatile("svc 0" : "+r"(a) : "r"(n), "r"(b), "r"(c) : "memory");
#else
  register intptr_t n __asm__("a7") = number == 1 ? 93 : number + 60; /* 93, 63 and 64 on RISC-V */
  register intptr_t a __asm__("a0") = file;
  register intptr_t b __asm__("a1") = data;
  register intptr_t c __asm__("a2") = size;
  __asm__ volatile("ecall" : "+r"(a) : "r"(n), "r"(b), "r"(c) : "memory");
#endif
  return a;
}
/* Reads or writes n objects, which takes several calls where a pipe is full. Returns n, or 0. */
static size_t transfer(intptr_t number, intptr_t file, intptr_t data, size_t size, size_t n) {
  size_t done = 0;
  while (done < size * n) {
    const size_t left = size * n - done;
    const intptr_t moved = system_call(number, file, data + (intptr_t)done, (intptr_t)left);
    if (moved <= 0) break;
    done += (size_t)moved;
  }
  return done == size * n ? n : 0;
}
static size_t fread(void *data, size_t size, size_t n, int file) {
  return transfer(3, file, (intptr_t)data, size, n);
}
static size_t fwrite(const void *data, size_t size, size_t n, int file) {
  return transfer(4, file, (intptr_t)data, size, n);
}
int main(void);
void _start(void);
void _start(void) {
  system_call(1, main(), 0, 0);
  for (;;) {
  }
}
#if defined(__arm__) && !defined(__ARM_ARCH_7EM__)
/* Functions of the compiler's library that the compiled code calls on this processor: products and
 * shifts of 64 bits, made of 32 bits. parts[0] are the lower bits. */
typedef union {
  uint64_t whole;
  uint32_t parts[2];
} Wide;
uint64_t __aeabi_lmul(uint64_t a, uint64_t b);
uint64_t __aeabi_llsl(uint64_t a, int n);
uint64_t __aeabi_llsr(uint64_t a, int n);
int64_t __aeabi_lasr(int64_t a, int n);
/* By hand, in digits of 16 bits: the full product of the lower parts, and of the others only what
 * is below 2^64. */
uint64_t __aeabi_lmul(uint64_t a, uint64_t b) {
  Wide x, y, product;
  uint32_t low, middle, other, i, j;
  x.whole = a;
  y.whole = b;
  i = x.parts[0];
  j = y.parts[0];
  low = (i & 65535) * (j & 65535);
  middle = (i >> 16) * (j & 65535) + (low >> 16);
  other = (i & 65535) * (j >> 16) + (middle & 65535);
  product.parts[0] = other << 16 | (low & 65535);
  product.parts[1] = (i >> 16) * (j >> 16) + (middle >> 16) + (other >> 16) + i * y.parts[1] +
                     x.parts[1] * j;
  return product.whole;
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
/* Shifts to the right; the bits of `sign`, all 0 or all 1, come in from the left. */
static uint64_t shift_right(uint64_t a, int n, uint32_t sign) {
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
uint64_t __aeabi_llsr(uint64_t a, int n) { return shift_right(a, n, 0); }
int64_t __aeabi_lasr(int64_t a, int n) {
  Wide x;
  x.whole = (uint64_t)a;
  x.whole = shift_right(x.whole, n, x.parts[1] >> 31 ? UINT32_MAX : 0);
  return (int64_t)x.whole;
}
#endif
"""
"""The file stdio.h: reading, writing, and the start of a program, without a C library."""

BARE_TARGETS = {
    name: Target("clang", runner, (*options, *_ALONE), stdio=STDIO)
    for name, (runner, *options) in _BARE.items()
}
