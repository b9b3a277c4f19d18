/* How much of a board's stack a program has used: what is no longer painted. */
#include <stdint.h>

#ifdef __x86_64__
static void paint_stack(void) {}
static uint32_t stack_used(void) { return 0; }
#else
extern uint8_t __heap_start[], __stack[]; /* of the linker's script */
#define PAINT 0xA5

static void paint_stack(void) {
  volatile uint8_t* byte = __heap_start;
  const uint8_t* const here = (const uint8_t*)__builtin_frame_address(0);
  while (byte < here - 64) *byte++ = PAINT;
}

static uint32_t stack_used(void) {
  const volatile uint8_t* byte = __heap_start;
  while (byte < __stack && *byte == PAINT) ++byte;
  return (uint32_t)(__stack - (const uint8_t*)byte);
}
#endif
