/* Which of several best actions is taken. Define the type sdnn_score before. */
#ifndef SDNN_TIES_H
#define SDNN_TIES_H

#include <stdint.h>

#define SDNN_LOWEST 0 /* the lowest action */
#define SDNN_MIDDLE 1 /* the middle of the widest run of neighbours */
#define SDNN_DRAWN 2  /* any of them, at random */

struct sdnn_random;

/* An action whose score is `least` or more. Requires that there is one, and `random` where ties are
 * drawn. */
static inline uint32_t sdnn_tied(const sdnn_score* scores, uint32_t n_actions, sdnn_score least,
                                 struct sdnn_random* random) {
  uint32_t action = 0;
#if SDNN_TIES == SDNN_DRAWN
  uint32_t n_tied = 0, skip = 0;
  for (; action < n_actions; ++action) n_tied += scores[action] >= least;
  if (n_tied > 1) skip = (uint32_t)sdnn_below(random, n_tied);
  for (action = 0; scores[action] < least || skip-- > 0;) ++action;
#elif SDNN_TIES == SDNN_MIDDLE
  uint32_t i, run = 0, widest = 0;
  (void)random;
  for (i = 0; i < n_actions; ++i) {
    run = scores[i] >= least ? run + 1 : 0;
    if (run > widest) {
      widest = run;
      action = i - run / 2;
    }
  }
#else
  (void)n_actions;
  (void)random;
  while (scores[action] < least) ++action;
#endif
  return action;
}

#endif /* SDNN_TIES_H */
