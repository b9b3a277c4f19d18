"""SDNNQLambda on one page: the library's default agent in plain NumPy.

    python docs/examples/sdnn_q_lambda.py --env-id CartPole-v1 --steps 5000

It is true online TD(lambda) (van Seijen et al. 2016, algorithm 2) with the cut traces of Watkins's
Q(lambda) (1989). Numbered comments mark the differences. The library learns the same weights, bit
for bit, and faster; a test compares them. Two things are not on this page: the warm-up that fits
ranges and selects inputs, and what the library does if the size of rewards changes by far.

Numbers are integers in units of 2^-b: a product of one with b and one with c such bits has b + c,
and ``rounded(product, c)`` has b again. Limits such as 2^33 keep all products within 64 bits.
"""

import argparse
import dataclasses
import math

import gymnasium as gym
import numpy as np
from sdnn_q_learning import CODE_BOOKS, EXPLORATION, PERMUTATIONS, TIES, Random, code_book

GREEDY_TIES, REPETITIONS = 7, 11  # more streams of random numbers


@dataclasses.dataclass
class Settings:
    """The library's defaults. Each field is an option of the command."""

    env_id: str = "CartPole-v1"
    steps: int = 5000
    seed: int = 1
    n_anchor_patterns: int = 9
    n_interpolated: int = 44  # patterns between two anchors
    n_box_actions: int = 3  # of each dimension of a Box of actions
    learning_rate: float = 1.0  # alpha
    final_learning_rate: float = 0.03
    epsilon: float = 0.05  # falls to 0
    schedule_steps: int = 20_000
    max_action_repeat: int = 100
    discount: float = 0.99  # gamma
    trace_decay: float = 0.8  # lambda
    averaging_interval: int = 30


def rounded(x, n_bits):
    """Return x / 2^n_bits, rounded to the nearest, halves up."""
    return x if n_bits == 0 else (x + (1 << (n_bits - 1))) >> n_bits


def clipped(x, n_bits):
    """Return x within the numbers of n_bits bits and a sign."""
    return np.clip(x, 1 - 2**n_bits, 2**n_bits - 1)


class SDNNCode:
    """(1) Features of a state in [0, 1]^l: the pattern of each input, gated by that of each other.

    A pattern has +1 and -1 in its units. Those of neighbouring bins differ in few units, those of
    distant ones in half of them (docs/explanation/method.md, sections 1.2 and 1.3).
    """

    def __init__(self, n_inputs, s):
        n_groups = n_inputs * (n_inputs - 1)
        # Units of a pattern, in words of 64: as many as make about 3,072 features in all groups; or
        # 256, which keep chance correlations small, while these make at most 14,336 features.
        n_units = max((3072 // n_groups + 32) // 64 * 64, min(256, 14336 // n_groups // 64 * 64))
        s.n_pattern_units = min(max(n_units, 64), 768)
        self.books = [code_book(s, Random(s.seed, CODE_BOOKS, mu)) for mu in range(n_inputs)]
        pairs = [(mu, nu) for mu in range(n_inputs) for nu in range(n_inputs) if mu != nu]
        self.orders = {
            pair: np.argsort(Random(s.seed, PERMUTATIONS, i).shuffled(range(s.n_pattern_units)))
            for i, pair in enumerate(pairs)
        }
        self.n_columns = s.n_pattern_units * n_groups

    def __call__(self, state):
        """Return -1, 0 or +1 for each feature: (n_columns,)."""
        patterns = [
            book[min(int(x * len(book)), len(book) - 1)]
            for x, book in zip(state, self.books, strict=True)
        ]
        paired, single = [], []
        for nu, gate in enumerate(patterns):
            others = [mu for mu in range(len(patterns)) if mu != nu]
            groups = [patterns[mu][self.orders[mu, nu]] * (gate > 0) for mu in others]
            # (2) Groups with the same zeros become half their sum and half their difference, one
            #     of which is 0: a quarter of all features is left to be summed and corrected.
            for x, y in zip(groups[:-1:2], groups[1::2], strict=False):
                paired += [(x + y) // 2, (x - y) // 2]
            single += groups[len(groups) // 2 * 2 :]
        return np.concatenate(paired + single).astype(np.int64)


class QLambda:
    """The agent. States are in [0, 1]^l, an action has an index for each of its dimensions."""

    def __init__(self, code, n_actions, s):
        self.code, self.settings = code, s
        # (3) Q(s, a) is a sum over the dimensions of the action, so the best action is exact. Each
        #     action of a dimension has a row of weights.
        self.first_rows = np.cumsum([0, *n_actions])
        self.weights = np.zeros((self.first_rows[-1], code.n_columns), np.int64)
        self.average, self.trace = np.zeros_like(self.weights), np.zeros_like(self.weights)
        # (4) All numbers are integers. Weights and values count units of 2^exponent, traces units
        #     of 2^-12. The first reward sets the exponent.
        self.exponent = None
        self.n_learned = self.n_corrections = self.n_snapshots = self.n_terminated = 0
        self.n_random_left = 0  # steps of the search that (6) describes
        self.ties, self.greedy_ties, self.exploration, self.repetitions = (
            Random(s.seed, stream) for stream in (TIES, GREEDY_TIES, EXPLORATION, REPETITIONS)
        )
        self.begin_episode()

    def begin_episode(self):
        self.end_trace()
        self.n_steps = 0
        self.n_kept = 0  # steps for which the present action is still kept
        self.is_excursion = self.skips_learning = False

    def end_trace(self):
        self.trace[:], self.old_value, self.next_state = 0, 0, None

    def rows(self, action):
        """Return the row of weights of each dimension's part of an action."""
        return self.first_rows[:-1] + action

    def sums(self, x, weights):
        """Each dimension's part of Q(s, a) for each of its actions, in units."""
        return np.split(weights @ x, self.first_rows[1:-1])

    def value(self, x, action):
        return int(sum(part[a] for part, a in zip(self.sums(x, self.weights), action, strict=True)))

    def best_value(self, x):
        return int(sum(part.max() for part in self.sums(x, self.weights)))

    def scheduled(self, first, last):
        """(5) Return a rate times 2^16: half of the way from first to last after schedule_steps.

        After n steps it is first + (last - first) n / (n + schedule_steps), rounded.
        """
        first, last = round(first * 2**16), round(last * 2**16)
        end = self.n_learned + self.settings.schedule_steps
        return first + (2 * (last - first) * self.n_learned + end) // (2 * end)

    def epsilon(self):
        return self.scheduled(self.settings.epsilon, 0.0) / 2**16

    def lacks_rewards(self):
        has_only_zeros = self.n_learned > 0 and self.exponent is None
        return has_only_zeros and self.settings.max_action_repeat > 1 and self.epsilon() > 0

    def act(self, state, explore=True):
        """Return an index for each dimension: the best action or, if exploring, another one."""
        action = self.exploratory_action(state) if explore else None
        if action is not None:
            return action
        # (9) Without exploration, actions follow an average of the weights.
        weights = self.average if not explore and self.n_snapshots > 0 else self.weights
        ties = self.ties if explore else self.greedy_ties
        best = [np.flatnonzero(part == part.max()) for part in self.sums(self.code(state), weights)]
        return [int(tied[ties.below(len(tied)) if len(tied) > 1 else 0]) for tied in best]

    def exploratory_action(self, state):
        """Return a random, kept or worst action; None where the best one is to be chosen."""
        s = self.settings
        # (6) While all rewards were 0, values have no order: the agent searches by random actions
        #     that last, and for twice as many steps after the first reward, too.
        must_explore = self.n_random_left > 0 or self.lacks_rewards()
        self.n_random_left = max(self.n_random_left - 1, 0)
        self.n_steps += 1
        if self.is_excursion and (self.n_kept == 0 or self.epsilon() == 0):
            self.n_kept, self.is_excursion = 0, False
        self.skips_learning = self.is_excursion
        if self.n_kept > 0:
            self.n_kept -= 1
            return self.worst(state) if self.is_excursion else self.kept_action
        if not must_explore and self.exploration.uniform() >= self.epsilon():
            return None
        # (7) A random action is kept for at least k steps with probability 1 / k. Each episode that
        #     terminates halves the longest duration, down to 5 steps.
        longest = max(s.max_action_repeat >> self.n_terminated, min(5, s.max_action_repeat))
        # (8) In endless episodes, those of more than 2,000 steps, a fourth of these draws begins an
        #     excursion from good states: its steps take the worst action, and are not learned.
        is_long = self.n_steps > 2000 and s.max_action_repeat > 1 and not must_explore
        self.is_excursion = is_long and self.repetitions.below(4) == 0
        self.skips_learning = self.is_excursion
        if self.is_excursion:
            self.n_kept = self.repetitions.below(longest)
            return self.worst(state)
        n_actions = np.diff(self.first_rows)
        self.kept_action = [self.exploration.below(int(n)) for n in n_actions]
        if must_explore:
            self.n_kept = self.repetitions.below(s.max_action_repeat // 2)
        else:
            self.n_kept = int(min(1 / (1 - self.repetitions.uniform()), longest)) - 1
        return self.kept_action

    def worst(self, state):
        parts = self.sums(self.code(state), self.weights)
        self.kept_action = [int(part.argmin()) for part in parts]
        return self.kept_action

    def learn(self, state, action, reward, next_state, terminated):
        skips = self.skips_learning and list(action) == self.kept_action and not terminated
        self.skips_learning = False
        if skips:
            self.end_trace()
            return
        x, next_x = self.code(state), self.code(next_state)
        if self.next_state is not None:
            # Watkins: a worse action ends the trace, as does a state that does not follow.
            follows = np.array_equal(self.next_state, state)
            if not follows or self.value(x, action) < self.best_value(x):
                self.end_trace()
        if reward != 0.0 and self.lacks_rewards():
            self.n_random_left = 2 * self.n_learned
        self.fit_unit(reward)
        self.n_learned += 1
        while not terminated and abs(self.best_value(next_x)) >= 2**33:
            self.double_unit()
        self.correct(x, action, reward, 0 if terminated else self.best_value(next_x))
        self.next_state = next_state
        if terminated:
            self.end_trace()
            self.n_terminated += self.n_random_left == 0

    def correct(self, x, action, reward, next_value):
        """Algorithm 2, with Q' the best value of the next state."""
        s, rows = self.settings, self.rows(action)
        while abs(self.value(x, action)) >= 2**33:
            self.double_unit()
            next_value = rounded(next_value, 1)
        value = self.value(x, action)  # the textbook's Q; old_value is its Q_old
        target = self.units_of(reward) + rounded(next_value * round(s.discount * 2**15), 15)
        drift, self.old_value = value - self.old_value, next_value
        # (10) Alpha is divided by the number of weights that have a part in Q(s, a): a step of 1
        #     corrects the whole error of a new state, and no step overshoots.
        n_weights = max(1, np.count_nonzero(x) * len(rows))
        rate = (max(1, self.scheduled(s.learning_rate, s.final_learning_rate)) << 12) // n_weights
        self.update_trace(x, rows, rate)
        error, drift = clipped(target - value + drift, 34), clipped(drift, 34)
        while max(abs(rounded(error * rate, 28)), abs(rounded(drift * rate, 28))) >= 2**23:
            self.double_unit()
            error, drift = rounded(error, 1), rounded(drift, 1)
        step, n_bits = rounded(error * rate, 28), 0
        while abs(step) >> n_bits >= 2**13 - 1:  # products with traces have 31 bits
            n_bits += 1
        self.weights += rounded(rounded(step, n_bits) * self.trace, 12 - n_bits)
        self.weights[rows] -= rounded(drift * rate, 28) * x
        # x ^ (x >> 63) is x, or -x - 1 if x < 0. The bitwise OR of all has as many bits as the
        # largest. A doubled unit takes a bit away, unless rounding brings a weight up to 2^23.
        largest = int(np.bitwise_or.reduce(self.weights ^ self.weights >> 63, None))
        while largest >= 2**23:
            self.double_unit()
            largest = largest >> 1 | int(np.any(self.weights == 2**23)) << 23
        self.update_average()

    def update_trace(self, x, rows, rate):
        """Decay the trace towards 0 and add the features, less where it overlaps with them."""
        decay = round(self.settings.discount * self.settings.trace_decay * 2**13)
        overlap = rounded(np.sum(self.trace[rows] @ x) * rate, 28)
        gain = 2**12 - clipped(rounded(overlap * decay, 13), 17)
        self.trace = np.sign(self.trace) * (abs(self.trace) * decay >> 13)
        self.trace[rows] += gain * x
        self.trace = clipped(self.trace, 17)

    def update_average(self):
        """Move the average to the weights by about 3 / (n + 3) of the way, for snapshot n from 0.

        The share of the way is rounded up to a power of two, 2^-n_bits; it is at least 2^-10.
        """
        self.n_corrections += 1
        if self.n_corrections % self.settings.averaging_interval == 0:
            n_bits = (self.n_snapshots // 3 + 1).bit_length() - 1
            self.average += rounded(self.weights - self.average, n_bits)
            self.n_snapshots = min(self.n_snapshots + 1, 3 * 2**10)

    # (11) The unit follows the rewards: the first one has 31 bits. It doubles where a weight would
    #     need more than 23 bits, or a value more than 33.

    def units_of(self, reward):
        """Return a reward as a number of units, rounded."""
        return math.floor(math.ldexp(reward, -(self.exponent or 0)) + 0.5)

    def fit_unit(self, reward):
        """Make the unit large enough for a reward."""
        if reward != 0.0 and self.exponent is None:
            self.exponent = math.frexp(reward)[1] - 31
        while reward != 0.0 and abs(math.ldexp(reward, -self.exponent)) >= 2**32:
            self.double_unit()

    def double_unit(self):
        self.exponent = (self.exponent or 0) + 1
        self.weights, self.average = rounded(self.weights, 1), rounded(self.average, 1)
        self.old_value = rounded(self.old_value, 1)


def new_agent(n_inputs, n_actions, s):
    return QLambda(SDNNCode(n_inputs, s), n_actions, s)


def train(env, s, report=print, new_agent=new_agent):
    """Learn for some steps; return the agent.

    Ranges of observations are those of the space, or -3 to 3 where these are wider.
    """
    low, high = (
        np.clip(bound.astype(float), -3.0, 3.0)
        for bound in (env.observation_space.low, env.observation_space.high)
    )

    def state_of(observation):
        return np.clip((observation - low) / (high - low), 0.0, 1.0)

    actions = env.action_space
    is_box = isinstance(actions, gym.spaces.Box)
    n_actions = [s.n_box_actions] * actions.shape[0] if is_box else [int(actions.n)]
    agent = new_agent(len(low), n_actions, s)
    state, total = state_of(env.reset(seed=s.seed)[0]), 0.0
    for step in range(1, s.steps + 1):
        action = agent.act(state)
        task_action = action[0]
        if is_box:
            part = np.array(action) / (s.n_box_actions - 1)
            task_action = (actions.low + (actions.high - actions.low) * part).astype(actions.dtype)
        observation, reward, terminated, truncated, _ = env.step(task_action)
        agent.learn(state, action, reward, state_of(observation), terminated)
        state, total = state_of(observation), total + reward
        if terminated or truncated:
            report(f"step {step}: return {total:g}")
            agent.begin_episode()
            state, total = state_of(env.reset()[0]), 0.0
    return agent


def settings_of_command(settings_class):
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    for field in dataclasses.fields(settings_class):
        option = "--" + field.name.replace("_", "-")
        parser.add_argument(option, type=type(field.default), default=field.default, help=" ")
    return settings_class(**vars(parser.parse_args()))


if __name__ == "__main__":
    settings = settings_of_command(Settings)
    train(gym.make(settings.env_id), settings)
