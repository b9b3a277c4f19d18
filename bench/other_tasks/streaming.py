"""Stream AC(lambda) and stream Q(lambda): networks that learn one step at a time without replay.

Source: Elsayed, M., Vasan, G., Mahmood, A. R. (2024). Streaming deep reinforcement learning finally
works (arXiv:2410.14606), with the settings of its experiments. Written in NumPy, because on
networks of this size a step takes a fraction of a millisecond, where automatic differentiation
takes several; 200 steps of stream AC gave PyTorch's weights after the authors' updates to the last
digits of a float. Like the other learners here they observe no time, so a time limit does not end
an episode for the critic; actions are in parts of half their range, as the paper's are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
from tile_coding import listed_actions

from sdnn.agents.registry import AgentEntry, register

DISCOUNT, TRACE_DECAY = 0.99, 0.8
ENTROPY = 0.01
KAPPA_ACTOR, KAPPA_CRITIC = 3.0, 2.0
N_UNITS, SPARSITY, SLOPE = 128, 0.9, 0.01
N_UNITS_Q, KAPPA_Q = 32, 2.0
EPSILON, FINAL_EPSILON, EXPLORATION = 1.0, 0.01, 0.05
"""Stream Q's first and final epsilon, and the share of the training in which it falls."""
LAYER_EPSILON, MOMENTS_EPSILON = 1e-5, 1e-8


class Moments:
    """Mean and variance of all values so far (Welford's algorithm)."""

    def __init__(self, shape: tuple[int, ...] = ()) -> None:
        self._n, self.mean, self._sum = 0, np.zeros(shape), np.zeros(shape)

    def update(self, value) -> None:
        """Add a value."""
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

    def __init__(
        self, n_inputs: int, n_outputs: int, kappa: float, generator, n_units: int = N_UNITS
    ) -> None:
        self._kappa = kappa
        shapes = []
        for rows, columns in ((n_units, n_inputs), (n_units, n_units), (n_outputs, n_units)):
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
        """Compute the outputs, (n_outputs,); with `keep` all layers stay for `add_gradient`."""
        kept = [inputs]
        for layer in range(2):
            sums = self._weights[2 * layer] @ inputs + self._weights[2 * layer + 1]
            sums -= sums.mean()
            deviation = math.sqrt(float(sums @ sums) / sums.size + LAYER_EPSILON)
            sums /= deviation
            inputs = np.maximum(sums, SLOPE * sums)
            kept += [sums, deviation, inputs]
        if keep:
            self._kept = kept
        return self._weights[4] @ inputs + self._weights[5]

    def add_gradient(self, slopes) -> None:
        """Add a gradient to the trace, after the trace has decayed.

        It is that of a function of the kept outputs with these slopes by them, (n_outputs,).
        """
        inputs, first, first_deviation, first_out, second, second_deviation, second_out = self._kept
        self._slope(2, slopes, second_out)
        slopes = _before_unit(self._weights[4].T @ slopes, second, second_deviation)
        self._slope(1, slopes, first_out)
        slopes = _before_unit(self._weights[2].T @ slopes, first, first_deviation)
        self._slope(0, slopes, inputs)
        self._trace *= DISCOUNT * TRACE_DECAY
        self._trace += self._gradient

    def _slope(self, layer, slopes, inputs):
        """Set the gradient of a layer's weights and biases from the slopes by its sums."""
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
    """Return slopes by a layer's sums from those by its units: backwards through leak and norm."""
    slopes = np.where(normalized > 0, slopes, SLOPE * slopes)
    along = float(slopes @ normalized) / slopes.size
    return (slopes - slopes.mean() - normalized * along) / deviation


class Softmax:
    """Probabilities of discrete actions."""

    def __init__(self, space: gym.spaces.Discrete) -> None:
        self.n_outputs = int(space.n)

    def sample(self, outputs, generator):
        """Draw an action."""
        self._probabilities = np.exp(outputs - outputs.max())
        self._probabilities /= self._probabilities.sum()
        action = int(np.searchsorted(np.cumsum(self._probabilities), generator.random()))
        self._action = min(action, self.n_outputs - 1)  # rounding may leave the sum below 1
        return self._action

    def slopes(self, entropy: float):
        """Return slopes by the outputs, (n_outputs,), of what a policy gradient follows.

        It is the drawn action's log-probability plus `entropy` times the distribution's entropy.
        """
        probabilities = self._probabilities
        logarithms = np.log(np.maximum(probabilities, 1e-30))
        mean_logarithm = float(probabilities @ logarithms)
        slopes = -probabilities * (1.0 + entropy * (logarithms - mean_logarithm))
        slopes[self._action] += 1.0
        return slopes

    def greedy(self, outputs):
        """Return the likeliest action."""
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
        """Return slopes as `Softmax.slopes` does, of the logarithm of the density."""
        ratio = self._off / self._deviation
        of_deviation = (ratio * ratio - 1.0 + entropy) / self._deviation
        sigmoid = -np.expm1(-self._deviation)  # the slope of log(1 + e^x)
        return np.concatenate([ratio / self._deviation, of_deviation * sigmoid])

    def greedy(self, outputs):
        """Return the mean."""
        return self._of_space(outputs[: self._n])

    def _of_space(self, parts):
        """Return the action with these parts of half the range from its middle, clipped."""
        middle, half = (self._high + self._low) / 2, (self._high - self._low) / 2
        return np.clip(middle + half * parts, self._low, self._high).astype(np.float32)


@dataclass(frozen=True, kw_only=True)
class NetworksConfig:
    """Settings of the networks: the paper's, which is why there is nothing to set."""

    n_inputs: int = 1


@dataclass(frozen=True, kw_only=True)
class StreamingConfig:
    """Settings of the learning: the paper's."""


class Streaming:
    """A base that learns a step when it is known whether the episode ended with it."""

    def __init__(self, observation_space, seed, networks) -> None:
        self._space = observation_space
        n_inputs = gym.spaces.flatdim(observation_space)
        self._rng = np.random.default_rng(seed)
        self.networks = [Network(n_inputs, *sizes) for sizes in networks(self._rng)]
        self._observation_moments, self._return_moments = Moments((n_inputs,)), Moments()
        self._discounted = 0.0  # discounted sum of the rewards so far, whose deviation scales them
        self._state = None  # the present observation, normalized
        self._step = None  # the pending transition

    @property
    def n_bytes(self) -> int:
        """Bytes of the weights and their traces, one for each."""
        return 2 * sum(network.parameters.nbytes for network in self.networks)

    def _normalized(self, observation):
        return (
            (observation - self._observation_moments.mean) / self._observation_moments.deviation
        ).astype(np.float32)

    def _normalize_new(self, observation):
        """Add an observation to the moments, and return it normalized by them."""
        observation = gym.spaces.flatten(self._space, observation)
        self._observation_moments.update(observation)
        return self._normalized(observation)

    def begin_episode(self) -> None:
        """Learn the last step of the one before, and forget the traces."""
        self._learn_pending(is_over=True)
        for network in self.networks:
            network.end_episode()
        self._state = None

    def act(self, observation, explore=True):
        """Draw an action; without `explore` the best one."""
        if not explore:
            observation = gym.spaces.flatten(self._space, observation)
            return self._greedy(self.networks[0].outputs(self._normalized(observation)))
        self._learn_pending(is_over=False)
        if self._state is None:
            self._state = self._normalize_new(observation)
        return self._sample(self.networks[0].outputs(self._state, keep=True))

    def learn(self, transition) -> None:
        """Keep a step."""
        self._step = transition

    def _learn_pending(self, is_over: bool) -> None:
        """Learn the pending transition, if there is one; ``is_over``: its episode has ended."""
        if self._step is None:
            return
        step, self._step = self._step, None
        reward, observation, terminated = step.reward, step.next_observation, step.terminated
        self._discounted = DISCOUNT * self._discounted * (not is_over) + reward
        self._return_moments.update(self._discounted)
        next_state = self._normalize_new(observation)
        scaled = reward / float(self._return_moments.deviation)
        self._update(scaled, next_state, DISCOUNT * (not terminated))
        self._state = next_state


class StreamAC(Streaming):
    """Actor and critic."""

    def __init__(self, observation_space, action_space, *, approximator, learning, seed) -> None:
        is_listed = isinstance(action_space, gym.spaces.Discrete)
        self._choice = Softmax(action_space) if is_listed else Normal(action_space)
        n_outputs = self._choice.n_outputs
        super().__init__(
            observation_space,
            seed,
            lambda rng: ((n_outputs, KAPPA_ACTOR, rng), (1, KAPPA_CRITIC, rng)),
        )

    def _greedy(self, outputs):
        return self._choice.greedy(outputs)

    def _sample(self, outputs):
        return self._choice.sample(outputs, self._rng)

    def _update(self, reward, next_state, discount) -> None:
        actor, critic = self.networks
        error = reward - float(critic.outputs(self._state, keep=True)[0])
        if discount:
            error += discount * float(critic.outputs(next_state)[0])
        critic.add_gradient(np.ones(1, np.float32))
        slopes = self._choice.slopes(ENTROPY * np.sign(error))
        actor.add_gradient(slopes.astype(np.float32))
        critic.follow_trace(error)
        actor.follow_trace(error)


class StreamQ(Streaming):
    """Values of listed actions, of a Box's 5 in each dimension; Watkins's traces."""

    progress = 0.0

    def __init__(self, observation_space, action_space, *, approximator, learning, seed) -> None:
        self._actions = listed_actions(action_space)
        sizes = len(self._actions), KAPPA_Q
        super().__init__(observation_space, seed, lambda rng: ((*sizes, rng, N_UNITS_Q),))

    def _greedy(self, outputs):
        return self._actions[int(np.argmax(outputs))]

    def _sample(self, outputs):
        fall = (FINAL_EPSILON - EPSILON) / EXPLORATION
        greedy = self._chosen = int(np.argmax(outputs))
        if self._rng.random() < max(EPSILON + fall * self.progress, FINAL_EPSILON):
            self._chosen = int(self._rng.integers(len(self._actions)))
        self._is_greedy = self._chosen == greedy
        return self._actions[self._chosen]

    def _update(self, reward, next_state, discount) -> None:
        (network,) = self.networks
        slopes = np.zeros(len(self._actions), np.float32)
        slopes[self._chosen] = 1.0
        error = reward - float(network.outputs(self._state, keep=True)[self._chosen])
        if discount:
            error += discount * float(network.outputs(next_state).max())
        network.add_gradient(slopes)
        network.follow_trace(error)
        if not self._is_greedy:
            network.end_episode()


for name, title, agent in (("stream-ac", "stream AC", StreamAC), ("stream-q", "stream Q", StreamQ)):
    register(
        AgentEntry(
            id=name,
            title=title,
            approximator=NetworksConfig,
            learning=StreamingConfig,
            agent=agent,
        )
    )
