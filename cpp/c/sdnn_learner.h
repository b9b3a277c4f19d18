/* Parts of all agents that learn: random numbers, the scale of rewards, images. */
#ifndef SDNN_LEARNER_H
#define SDNN_LEARNER_H

#include "sdnn_integers.h"

/* xoshiro256** of Blackman and Vigna. */
typedef struct sdnn_random {
  uint64_t words[4];
} sdnn_random;

/* The next 64 random bits, by xoshiro256**. */
static inline uint64_t sdnn_bits(sdnn_random* random) {
  uint64_t* const s = random->words;
  const uint64_t five = s[1] * 5, shifted = s[1] << 17;
  const uint64_t result = (five << 7 | five >> 57) * 9;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= shifted;
  s[3] = s[3] << 45 | s[3] >> 19;
  return result;
}

/* A number below n, all with the same probability. Of the 2^64 numbers that may be drawn, the first
 * 2^64 modulo n are rejected, so that each rest of a division by n is left equally often. */
static inline uint64_t sdnn_below(sdnn_random* random, uint64_t n) {
  uint64_t rejected, drawn, rest;
  sdnn_quotient(0 - n, n, &rejected);
  do {
    drawn = sdnn_bits(random);
  } while (drawn < rejected);
  sdnn_quotient(drawn, n, &rest);
  return rest;
}

/* The size of rewards in powers of two; INT32_MIN if all were 0. Rewards that are far larger than
 * recent ones are not learned. See cpp/include/sdnn/agents/reward_scale.hpp. */
typedef struct {
  uint64_t n_rewards;
  int32_t size, size_in_window, headroom;
} sdnn_scale;

/* Returns whether a reward is to be learned. */
static inline int sdnn_accepts(sdnn_scale* scale, int32_t reward) {
  uint32_t bits = reward < 0 ? 0 - (uint32_t)reward : (uint32_t)reward;
  int32_t size = -1 - SDNN_FRACTION_BITS;
  ++scale->n_rewards;
  if (reward == 0) return 1;
  for (; bits > 0; bits >>= 1) ++size;
  if (scale->size != INT32_MIN && size > scale->size + scale->headroom) {
    scale->headroom = scale->headroom + 4 < 2500 ? scale->headroom + 4 : 2500;
    return 0;
  }
  if (size > scale->size) scale->size = size;
  if (size > scale->size_in_window) scale->size_in_window = size;
  return 1;
}

/* Ends a window of 1,024 rewards. Returns the size of its rewards, or INT32_MIN. */
static inline int32_t sdnn_end_window(sdnn_scale* scale) {
  const int32_t size = scale->size_in_window;
  if ((scale->n_rewards & 1023) != 0) return INT32_MIN;
  if ((scale->n_rewards & 65535) == 0 && scale->headroom > 16) --scale->headroom;
  if (size == INT32_MIN) return INT32_MIN;
  scale->size_in_window = INT32_MIN;
  if (scale->size > size + 16) scale->size = size + 16;
  scale->size -= (scale->size - size + 3) >> 2;
  return size;
}

/* Sets n bytes to 0. The compiler makes no call of memset of a volatile store. */
static inline void sdnn_clear(void* memory, uint32_t n) {
  volatile uint8_t* bytes = (volatile uint8_t*)memory;
  for (; n > 0; --n) *bytes++ = 0;
}

/* Copies n numbers. The compiler makes no call of memcpy of a volatile store. */
static inline void sdnn_copy_32(int32_t* to, const int32_t* from, uint32_t n) {
  volatile int32_t* target = to;
  for (; n > 0; --n) *target++ = *from++;
}

/* Writes an integer as n bytes, the lowest first; returns where they end. */
static inline uint8_t* sdnn_put(uint8_t* at, uint64_t value, uint32_t n_bytes) {
  for (; n_bytes > 0; --n_bytes, value >>= 8) *at++ = (uint8_t)(value & 255);
  return at;
}

/* An integer of up to 8 bytes, the lowest first. */
static inline uint64_t sdnn_get(const uint8_t* at, uint32_t n_bytes) {
  uint64_t value = 0;
  while (n_bytes-- > 0) value = value << 8 | at[n_bytes];
  return value;
}

/* The signed integer with these bits; C leaves the conversion of large ones to the compiler. */
static inline int32_t sdnn_signed(uint32_t value) {
  return value >> 31 ? -(int32_t)~value - 1 : (int32_t)value;
}

static inline int32_t sdnn_get_32(const uint8_t* at) {
  return sdnn_signed((uint32_t)sdnn_get(at, 4));
}

/* Reads n numbers of 32 bits from an image, or writes them to it; returns where it continues. */
static inline uint8_t* sdnn_carry_32(uint8_t* at, void* numbers, uint32_t n, int reads) {
  uint32_t* number = (uint32_t*)numbers;
  for (; n > 0; --n, at += 4, ++number) {
    if (reads) {
      *number = (uint32_t)sdnn_get(at, 4);
    } else {
      sdnn_put(at, *number, 4);
    }
  }
  return at;
}

/* Reads numbers of 64 bits from an image or writes them to it; returns the end of their bytes. */
static inline uint8_t* sdnn_carry_64(uint8_t* at, void* numbers, uint32_t n, int reads) {
  uint64_t* number = (uint64_t*)numbers;
  for (; n > 0; --n, at += 8, ++number) {
    if (reads) {
      *number = sdnn_get(at, 8);
    } else {
      sdnn_put(at, *number, 8);
    }
  }
  return at;
}

/* Reads the scale of rewards from an image or writes it. */
static inline uint8_t* sdnn_carry_scale(uint8_t* at, sdnn_scale* scale, int reads) {
  at = sdnn_carry_64(at, &scale->n_rewards, 1, reads);
  at = sdnn_carry_32(at, &scale->size, 1, reads);
  at = sdnn_carry_32(at, &scale->size_in_window, 1, reads);
  return sdnn_carry_32(at, &scale->headroom, 1, reads);
}

/* Whether an image has possible numbers of a scale at this place. */
static inline int sdnn_is_scale(const uint8_t* at) {
  const int32_t size = sdnn_get_32(at + 8), size_in_window = sdnn_get_32(at + 12);
  const int32_t headroom = sdnn_get_32(at + 16);
  return (size == INT32_MIN || (size >= -1100 && size <= 1100)) && size_in_window <= size &&
         (size_in_window == INT32_MIN || size_in_window >= -1100) && headroom >= 16 &&
         headroom <= 2500;
}

/* Continues the CRC-32 of zlib, which begins with 2^32 - 1 and whose complement is the checksum. */
static inline uint32_t sdnn_add_to_checksum(uint32_t crc, const uint8_t* bytes, uint32_t n) {
  uint32_t bit;
  for (; n > 0; --n) {
    crc ^= *bytes++;
    for (bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? UINT32_C(0xedb88320) : 0);
  }
  return crc;
}

/* n bytes of an image, from `offset` on. */
typedef struct {
  uint8_t* bytes;
  uint32_t offset, n;
} sdnn_part;

/* Moves those bytes of a part that are in an array of 32-bit words, which begins at `first` in the
 * image: from the array to the part or, if `reads`, from the part to the array. */
static inline void sdnn_carry_words(const sdnn_part* part, void* words, uint32_t first,
                                    uint32_t n_words, int reads) {
  uint32_t* const array = (uint32_t*)words;
  uint32_t i;
  for (i = 0; i < part->n; ++i) {
    const uint32_t k = part->offset + i - first,
                   shift = 8 * (k & 3); /* before `first`, k wraps to above 2^31 */
    if (k >= 4 * n_words) continue;
    if (reads) {
      const uint32_t others = array[k >> 2] & ~(UINT32_C(255) << shift);
      array[k >> 2] = others | (uint32_t)part->bytes[i] << shift;
    } else {
      part->bytes[i] = (uint8_t)(array[k >> 2] >> shift & 255);
    }
  }
}

/* The random generators of an agent. SDNN-C rounds at random, too. */
enum { SDNN_EXPLORATION, SDNN_ACTING, SDNN_EVALUATION, SDNN_REPETITIONS, SDNN_ROUNDING };

/* Whether the head of an image has possible generators at this place. */
static inline int sdnn_are_generators(const uint8_t* randoms) {
  uint32_t i, j;
  for (i = 0; i < SDNN_N_RANDOMS; ++i) {
    uint8_t any = 0;
    for (j = 0; j < 32; ++j) any |= *randoms++;
    if (any == 0) return 0;
  }
  return 1;
}

#endif /* SDNN_LEARNER_H */
