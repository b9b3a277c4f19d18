"""SDNNActorCritic on one page: a softmax policy and state values in plain NumPy.

    python docs/examples/sdnn_actor_critic.py --env-id CartPole-v1 --steps 10000

The critic is the agent of sdnn_q_lambda.py with a single action, so that it learns V(s) by true
online TD(lambda). The actor has a row of preferences for each action, linear in the same code.
Numbered comments mark the differences from the textbook's actor-critic with traces (Sutton, Barto,
2018, section 13.5). The library learns the same weights, bit for bit, and faster; a test compares
them. Ranges that follow what is observed, the library's default, are not on this page.
"""

import dataclasses
import math

import gymnasium as gym
import numpy as np
import sdnn_q_lambda
from sdnn_q_lambda import SDNNCode, clipped, rounded
from sdnn_q_learning import EXPLORATION, Random


@dataclasses.dataclass
class Settings(sdnn_q_lambda.Settings):
    """The library's defaults. Each field is an option of the command."""

    steps: int = 10_000
    n_box_actions: int = 5
    learning_rate: float = 0.5  # of the critic
    trace_decay: float = 0.9  # lambda
    actor_learning_rate: float = 0.1
    final_actor_learning_rate: float = 0.02
    entropy: float = 0.01
    averaging_interval: int = 10**9  # never


class CodeWithThermometers(SDNNCode):
    """(1) The code of pairs, and for each input a thermometer: unit k is +1 above threshold k.

    So the policy finds trends over the whole range of an input at once.
    """

    def __init__(self, n_inputs, s):
        super().__init__(n_inputs, s)
        # The pairs of an input have n_active features that are not 0. A thermometer has at most
        # half as many units, in words of 64, but at least 64.
        n_active = s.n_pattern_units * (n_inputs - 1) // 4
        self.n_units = 64 * max(1, n_active // 128)
        self.n_columns += n_inputs * self.n_units

    def __call__(self, state):
        last = len(self.books[0]) - 1  # bin of the largest inputs
        bins = np.minimum((np.array(state) * (last + 1)).astype(int), last)
        n_above = (2 * bins * self.n_units + last) // (2 * last)
        thermometers = np.where(np.arange(self.n_units) < n_above[:, None], 1, -1)
        return np.concatenate([super().__call__(state), thermometers.ravel()])


def power_of_half(x):
    """Return 2^-x in units of 2^-30, to 5e-6; x in units of 2^-20.

    The coefficients are those of a polynomial for 2^-f, f in [0, 1), that is exact at both ends.
    """
    power = 0
    for coefficient in (7356191, -57204762, 257158220, -744180561, 1 << 30):
        power = coefficient + rounded(power * (x % 2**20), 20)
    return power >> (x >> 20)


def log2_of(x):
    """Return log2(x / 2^30) in units of 2^-20, to 1.2e-4; x is at least 1.

    The coefficients are those of a polynomial for log2(1 + f), f in [0, 1), exact at both ends.
    """
    exponent = int(x).bit_length() - 1
    fraction = ((x << 30 >> exponent) - 2**30) >> 10
    logarithm = 0
    for coefficient in (-86117, 336784, -710703, 1508612, 0):
        logarithm = coefficient + rounded(logarithm * fraction, 20)
    return ((exponent - 30) << 20) + logarithm


class ErrorScale:
    """(2) TD errors in units of their root mean square, clipped at 3, with 12 fractional bits.

    The mean counts the last 1,024 errors most. Errors and their scale have the critic's unit.
    """

    def __init__(self):
        self.mean_square, self.n_errors, self.exponent = 0, 0, 0

    def normalized(self, error, exponent):
        """Add an error in units of 2^exponent to the mean; return it divided by the root."""
        n_doubled = exponent - self.exponent
        self.mean_square = min(rounded_down(self.mean_square, 2 * n_doubled), 2**60)
        self.exponent = exponent
        size = min(abs(error) >> 8, 2**25 - 1)
        self.n_errors = min(self.n_errors + 1, 1024)
        self.mean_square += quotient((size * size << 10) - self.mean_square, self.n_errors)
        root = max(math.isqrt(self.mean_square >> 10), 1)
        return (-1 if error < 0 else 1) * min((size << 12) // root, 3 << 12)


def rounded_down(x, n_bits):
    """Return x / 2^n_bits, rounded down; n_bits may be negative."""
    return x >> n_bits if n_bits >= 0 else x << -n_bits


def quotient(x, n):
    """Return x / n, rounded towards 0."""
    return abs(x) // n * (1 if x >= 0 else -1)


class ActorCritic:
    """The agent. States are in [0, 1]^l, an action has an index for each of its dimensions."""

    def __init__(self, code, n_actions, s):
        self.code, self.settings = code, s
        self.critic = sdnn_q_lambda.QLambda(code, [1], s)
        self.first_rows = np.cumsum([0, *n_actions])
        # (3) Preferences count units of 2^-unit_bits, so that weights of 23 bits are enough.
        self.unit_bits = 16 + (code.n_columns // 4).bit_length()
        self.weights = np.zeros((self.first_rows[-1], code.n_columns), np.int64)
        self.trace = np.zeros_like(self.weights)
        self.scale, self.exploration = ErrorScale(), Random(s.seed, EXPLORATION)
        self.next_state = None

    def begin_episode(self):
        self.critic.end_trace()
        self.trace[:], self.next_state = 0, None

    def terms(self, x):
        """Yield for each dimension: weights exp(h - max h), probabilities and their logarithms.

        Units are 2^-30, 2^-16 and, to the base 2, 2^-20.
        """
        for preferences in np.split(self.weights @ x, self.first_rows[1:-1]):
            # exp(h - max h) is 2^-bits. Numbers are in units of 2^-20, and log2(e) is 1549082005 in
            # units of 2^-30. Actions of 40 bits have no weight.
            below = (preferences.max() - preferences) >> (self.unit_bits - 20)
            bits = np.minimum(rounded(np.minimum(below, 40 << 20) * 1549082005, 30), 40 << 20)
            weights = [int(power_of_half(int(b))) for b in bits]
            total = sum(weights)
            logarithms = [-int(b) - log2_of(total) for b in bits]
            yield weights, [((w << 16) + total // 2) // total for w in weights], logarithms

    def act(self, state):
        """Draw an action of each dimension by its probability."""
        action = []
        for weights, _, _ in self.terms(self.code(state)):
            drawn = self.exploration.below(sum(weights))
            action.append(int(np.searchsorted(np.cumsum(weights), drawn, "right")))
        return action

    def learn(self, state, action, reward, next_state, terminated):
        critic, s = self.critic, self.settings
        if self.next_state is None or not np.array_equal(self.next_state, state):
            self.begin_episode()
        x, next_x = self.code(state), self.code(next_state)
        critic.n_learned += 1
        critic.fit_unit(reward)
        while not terminated and abs(critic.best_value(next_x)) >= 2**33:
            critic.double_unit()
        next_value = 0 if terminated else critic.best_value(next_x)
        while abs(critic.value(x, [0])) >= 2**33:
            critic.double_unit()
            next_value = rounded(next_value, 1)
        target = critic.units_of(reward) + rounded(next_value * round(s.discount * 2**15), 15)
        error = self.scale.normalized(target - critic.value(x, [0]), critic.exponent or 0)
        self.update_actor(x, action, error)
        critic.correct(x, [0], reward, next_value)
        self.next_state = next_state
        if terminated:
            self.begin_episode()

    def update_actor(self, x, action, error):
        """Add the gradient of log pi(a | s) to the trace, and move the weights along the trace."""
        s, critic = self.settings, self.critic
        rate = critic.scheduled(s.actor_learning_rate, s.final_actor_learning_rate)
        # (4) As in the critic, the rate is divided by the number of features that are not 0.
        rate = (max(1, rate) << 12) // max(1, np.count_nonzero(x))
        step, n_bits = rounded(error * rate, 40 - self.unit_bits), 0
        while abs(step) >> n_bits >= 2**13 - 1:
            n_bits += 1
        decay = round(s.discount * s.trace_decay * 2**13)
        self.trace = np.sign(self.trace) * (abs(self.trace) * decay >> 13)
        slopes = []
        for d, (_, probabilities, logarithms) in enumerate(self.terms(x)):
            entropy = rounded(-np.dot(probabilities, logarithms), 16)
            for a, p in enumerate(probabilities):
                gain = 2**12 * (a == action[d]) - rounded(p, 4)
                self.trace[self.first_rows[d] + a] += gain * x
                # (5) A step along the gradient of the policy's entropy keeps it random.
                nats = rounded((entropy + logarithms[a]) * 45426, 16)  # ln(2), times 2^16
                slopes.append(rounded(p * nats, 20))
        self.trace = clipped(self.trace, 17)
        self.weights += rounded(rounded(step, n_bits) * self.trace, 12 - n_bits)
        pull = rounded(np.array(slopes) * round(s.entropy * 2**16) * rate, 60 - self.unit_bits)
        self.weights = clipped(self.weights - np.outer(pull, x), 23)


def new_agent(n_inputs, n_actions, s):
    return ActorCritic(CodeWithThermometers(n_inputs, s), n_actions, s)


def train(env, s, report=print):
    """Learn for some steps as sdnn_q_lambda.py does; return the agent."""
    return sdnn_q_lambda.train(env, s, report, new_agent)


if __name__ == "__main__":
    settings = sdnn_q_lambda.settings_of_command(Settings)
    train(gym.make(settings.env_id), settings)
