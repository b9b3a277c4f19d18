/* The calls that boards.py measures, on rows of the input: model.h has the types IN and OUT of rows and
 * results, BEGIN and CALL(in, out). Each row is called so many times as the
 * first number of the input says, and then written; at the end come the bytes of stack used.
 */
#include <stdio.h>

#include "stack.h"
#include "model.h"

static IN x;
static OUT y;

__attribute__((noinline)) static void call(void) {
  CALL(x, y);
  __asm__ volatile("" ::: "memory");
}

int main(void) {
  uint32_t n_calls, i, stack;
  paint_stack();
  if (fread(&n_calls, sizeof n_calls, 1, stdin) != 1) return 1;
  BEGIN;
  while (fread(&x, sizeof x, 1, stdin) == 1) {
    for (i = 0; i < n_calls; ++i) call();
    fwrite(&y, sizeof y, 1, stdout);
  }
  stack = stack_used();
  fwrite(&stack, sizeof stack, 1, stdout);
  return 0;
}
