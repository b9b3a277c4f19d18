"""Stream AC(lambda): actor-critic that learns one step at a time without replay, as ours does.

Source: Elsayed, M., Vasan, G., Mahmood, A. R. (2024). Streaming deep reinforcement learning finally
works (arXiv:2410.14606), with the settings of its experiments. Written in NumPy, because on
networks of this size a step takes a fraction of a millisecond, where automatic differentiation
takes several; 200 steps of it gave PyTorch's weights after the authors' updates to the last digits
of a float. Like the other learners here it observes no time, so a time limit does not end an
episode for the critic; actions are in parts of half their range, as the paper's are.
"""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np

TASKS = (
    "CartPole", "Pendulum", "MountainCar", "MountainCarContinuous", "Acrobot",
    "LunarLanderContinuous", "Reaching", "Wheels",
)  # fmt: skip

DISCOUNT, TRACE_DECAY = 0.99, 0.8
ENTROPY = 0.01
KAPPA_ACTOR, KAPPA_CRITIC = 3.0, 2.0
N_UNITS, SPARSITY, SLOPE = 128, 0.9, 0.01
LAYER_EPSILON, MOMENTS_EPSILON = 1e-5, 1e-8


class Moments:
    """Mean and variance of all that was seen (Welford)."""

    def __init__(self, shape: tuple[int, ...] = ()) -> None:
        self._n, self.mean, self._sum = 0, np.zeros(shape), np.zeros(shape)

    def update(self, value) -> None:
        """See one more."""
        self._n += 1
        before = value - self.mean
        self.mean = self.mean + before / self._n
        self._sum = self._sum + before * (value - self.mean)

    @property
    def deviation(self):
        """Standard deviation; 1 of a single value."""
        variance = self._sum / (self._n - 1) if self._n > 1 else 1.0
        return np.sqrt(variance + MOMENTS_EPSILON)


class Network:
    """Two layers of normalized leaky units, linear outputs, and a trace of their gradients."""

    def __init__(self, n_inputs: int, n_outputs: int, kappa: float, generator) -> None:
        self._kappa = kappa
        shapes = []
        for rows, columns in ((N_UNITS, n_inputs), (N_UNITS, N_UNITS), (n_outputs, N_UNITS)):
            shapes += [(rows, columns), (rows,)]
        sizes = [math.prod(shape) for shape in shapes]
        self.parameters, self._gradient, self._trace, self._scratch = np.zeros(
            (4, sum(sizes)), np.float32
        )

        def parts(whole):
            pieces = np.split(whole, np.cumsum(sizes)[:-1])
            return [piece.reshape(shape) for piece, shape in zip(pieces, shapes, strict=True)]

        self._weights, self._slopes = parts(self.parameters), parts(self._gradient)
        for weights in self._weights[::2]:  # sparse, biases 0
            n_inputs = weights.shape[1]
            weights[:] = generator.uniform(-1, 1, weights.shape) / math.sqrt(n_inputs)
            n_zeros = min(math.ceil(SPARSITY * n_inputs), n_inputs - 1)  # of few inputs one is left
            for row in weights:
                row[generator.permutation(n_inputs)[:n_zeros]] = 0.0

    def outputs(self, inputs, keep: bool = False):
        """Compute the outputs; those of which a gradient is to be had are kept."""
        kept = [inputs]
        for layer in range(2):
            sums = self._weights[2 * layer] @ inputs + self._weights[2 * layer + 1]
            sums -= sums.mean()
            deviation = math.sqrt(float(sums @ sums) / N_UNITS + LAYER_EPSILON)
            sums /= deviation
            inputs = np.maximum(sums, SLOPE * sums)
            kept += [sums, deviation, inputs]
        if keep:
            self._kept = kept
        return self._weights[4] @ inputs + self._weights[5]

    def add_gradient(self, slopes) -> None:
        """Add the gradient of what has these slopes at the kept outputs to the trace."""
        inputs, first, first_deviation, first_out, second, second_deviation, second_out = self._kept
        self._slope(2, slopes, second_out)
        slopes = _before_unit(self._weights[4].T @ slopes, second, second_deviation)
        self._slope(1, slopes, first_out)
        slopes = _before_unit(self._weights[2].T @ slopes, first, first_deviation)
        self._slope(0, slopes, inputs)
        self._trace *= DISCOUNT * TRACE_DECAY
        self._trace += self._gradient

    def _slope(self, layer, slopes, inputs):
        np.multiply.outer(slopes, inputs, out=self._slopes[2 * layer])
        self._slopes[2 * layer + 1][:] = slopes

    def follow_trace(self, error: float) -> None:
        """Move along the trace, never so far as to overshoot (step size 1)."""
        np.abs(self._trace, out=self._scratch)
        bound = self._kappa * max(abs(error), 1.0) * float(self._scratch.sum())
        np.multiply(self._trace, error / max(bound, 1.0), out=self._scratch)
        self.parameters += self._scratch

    def end_episode(self) -> None:
        """Forget the trace."""
        self._trace[:] = 0.0


def _before_unit(slopes, normalized, deviation):
    """Slopes of a layer's sums, given those of its leaky units."""
    slopes = np.where(normalized > 0, slopes, SLOPE * slopes)
    along = float(slopes @ normalized) / N_UNITS
    return (slopes - slopes.mean() - normalized * along) / deviation


class Softmax:
    """Chances of listed actions."""

    def __init__(self, space: gym.spaces.Discrete) -> None:
        self.n_outputs = int(space.n)

    def sample(self, outputs, generator):
        """Draw an action."""
        self._chances = np.exp(outputs - outputs.max())
        self._chances /= self._chances.sum()
        action = int(np.searchsorted(np.cumsum(self._chances), generator.random()))
        self._action = min(action, self.n_outputs - 1)
        return self._action

    def slopes(self, entropy: float):
        """Slopes of the drawn action's logarithmic chance and of so many entropies."""
        chances = self._chances
        logarithms = np.log(np.maximum(chances, 1e-30))
        slopes = -chances * (1.0 + entropy * (logarithms - float(chances @ logarithms)))
        slopes[self._action] += 1.0
        return slopes

    def greedy(self, outputs):
        """Give the likeliest action."""
        return int(np.argmax(outputs))


class Normal:
    """Normal distributions, in parts of half the range of each action dimension."""

    def __init__(self, space: gym.spaces.Box) -> None:
        self._low, self._high = space.low, space.high
        self._n = space.shape[0]
        self.n_outputs = 2 * self._n

    def sample(self, outputs, generator):
        """Draw an action."""
        self._deviation = np.logaddexp(0.0, outputs[self._n :])
        self._off = self._deviation * generator.standard_normal(self._n)
        return self._of_space(outputs[: self._n] + self._off)

    def slopes(self, entropy: float):
        """Slopes of the drawn action's logarithmic density and of so many entropies."""
        ratio = self._off / self._deviation
        of_deviation = (ratio * ratio - 1.0 + entropy) / self._deviation
        sigmoid = -np.expm1(-self._deviation)  # the slope of log(1 + e^x)
        return np.concatenate([ratio / self._deviation, of_deviation * sigmoid])

    def greedy(self, outputs):
        """Give the mean."""
        return self._of_space(outputs[: self._n])

    def _of_space(self, parts):
        middle, half = (self._high + self._low) / 2, (self._high - self._low) / 2
        return np.clip(middle + half * parts, self._low, self._high).astype(np.float32)


def learn(env, steps, seed, after_step) -> None:
    """Learn a task; see `agents`."""
    generator = np.random.default_rng(seed)
    space = env.action_space
    choice = Softmax(space) if isinstance(space, gym.spaces.Discrete) else Normal(space)
    n_inputs = env.observation_space.shape[0]
    actor = Network(n_inputs, choice.n_outputs, KAPPA_ACTOR, generator)
    critic = Network(n_inputs, 1, KAPPA_CRITIC, generator)
    seen, returns, discounted = Moments((n_inputs,)), Moments(), 0.0

    def normalized(observation):
        return ((observation - seen.mean) / seen.deviation).astype(np.float32)

    def policy(observation):
        return choice.greedy(actor.outputs(normalized(observation)))

    def memory():
        return 2 * (actor.parameters.nbytes + critic.parameters.nbytes)  # and as many traces

    is_over = True
    for step in range(steps):
        if is_over:
            observation, _ = env.reset(seed=seed if step == 0 else None)
            seen.update(observation)
            state = normalized(observation)
        action = choice.sample(actor.outputs(state, keep=True), generator)
        observation, reward, terminated, truncated, _ = env.step(action)
        is_over = terminated or truncated
        discounted = DISCOUNT * discounted * (not is_over) + float(reward)
        returns.update(discounted)
        seen.update(observation)
        next_state = normalized(observation)
        value = float(critic.outputs(state, keep=True)[0])
        target = float(reward) / float(returns.deviation)
        if not terminated:
            target += DISCOUNT * float(critic.outputs(next_state)[0])
        error = target - value
        critic.add_gradient(np.ones(1, np.float32))
        actor.add_gradient(choice.slopes(ENTROPY * np.sign(error)).astype(np.float32))
        critic.follow_trace(error)
        actor.follow_trace(error)
        if is_over:
            actor.end_episode()
            critic.end_episode()
        state = next_state
        after_step(step + 1, policy, memory)
