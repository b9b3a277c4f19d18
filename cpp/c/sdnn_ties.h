/* Which of several best actions is taken. Define the type sdnn_score before. */
#ifndef SDNN_TIES_H
#define SDNN_TIES_H

#include <stdint.h>

#define SDNN_LOWEST 0 /* the lowest action */
#define SDNN_MIDDLE 1 /* the middle of the widest run of neighbours */
#define SDNN_DRAWN 2  /* any of them, at random, where the agent explores */

/* A greedy action: its score is `least` or more, as at least one is. It is not drawn: where the
 * agent draws ties, it is the middle of the widest run of neighbours. */
static inline uint32_t sdnn_tied(const sdnn_score* scores, uint32_t n_actions, sdnn_score least) {
  uint32_t action = 0;
#if SDNN_TIES == SDNN_LOWEST
  (void)n_actions;
  while (scores[action] < least) ++action; /* cppcheck-suppress uninitvar */
#else
  uint32_t i, run = 0, widest = 0;
  for (i = 0; i < n_actions; ++i) {
    run = scores[i] >= least ? run + 1 : 0;
    if (run > widest) {
      widest = run;
      action = i - run / 2;
    }
  }
#endif
  return action;
}

#ifdef SDNN_N_RANDOMS
/* An action whose score is `least` or more, as at least one is, while the agent explores. */
static inline uint32_t sdnn_draw_tied(const sdnn_score* scores, uint32_t n_actions,
                                      sdnn_score least, sdnn_random* random) {
#if SDNN_TIES == SDNN_DRAWN
  uint32_t action, n_tied = 0, skip = 0;
  for (action = 0; action < n_actions; ++action) n_tied += scores[action] >= least;
  if (n_tied > 1) skip = (uint32_t)sdnn_below(random, n_tied);
  for (action = 0; scores[action] < least || skip-- > 0;) ++action;
  return action;
#else
  (void)random;
  return sdnn_tied(scores, n_actions, least);
#endif
}
#endif

#endif /* SDNN_TIES_H */
