"""Advice for the names of other libraries: arguments, options, attributes, and what is imported."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable, Mapping
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType

_NO_BATCHES = "each transition or sample is learned by itself: omit it"
_NO_GRADIENT = "there is no gradient descent: omit it"
_NO_POLICY = "there is no policy network: approximator and learning hold the settings"
_ENVIRONMENT_ELSEWHERE = (
    "an agent keeps no environment: SDNNQLambda(env), train(env, steps=...) and"
    " evaluate(agent, env) take it"
)
_AGENTS = "the agents are SDNNQLambda(env), which is the default, SDNNActorCritic and SDNNQLearning"

_MEANINGS: Mapping[tuple[str, ...], tuple[str, ...]] = {
    ("gamma", "discount_factor", "discount_rate"): ("discount",),
    ("alpha", "lr", "eta", "eta0", "step_size", "learning_rate_init"): (
        "learning_rate", "learning_coefficient", "correction_share"),
    ("learning_rate",): ("learning_coefficient", "correction_share"),
    ("gae_lambda", "lam", "lambda_", "lamda", "trace_lambda"): ("trace_decay",),
    ("eps", "start_e", "epsilon_start", "initial_epsilon", "exploration_initial_eps",
     "exploration_rate"): ("epsilon", "entropy"),
    ("epsilon", "ent_coef", "entropy_coef"): (
        "entropy", "the policy itself is random, and there is no gradient descent: omit it"),
    ("end_e", "epsilon_end", "epsilon_min", "min_epsilon", "exploration_final_eps"): (
        "final_epsilon",),
    ("epsilon_decay", "exploration_decay", "exploration_steps"): ("exploration_fraction",),
    ("learning_starts", "random_steps", "burn_in"): ("warm_up_steps", "start_steps"),
    ("n_step", "multi_step"): ("n_steps",),
    ("total_timesteps", "timesteps", "n_timesteps", "total_steps", "max_steps", "n_steps"): (
        "steps",),
    ("num_timesteps",): ("steps", "train(env, steps=...).n_steps is their number"),
    ("n_episodes", "num_episodes", "max_episodes", "total_episodes"): ("episodes",),
    ("n_eval_episodes", "eval_episodes", "num_eval_episodes"): ("evaluation_episodes", "episodes"),
    ("eval_freq", "eval_every", "evaluation_frequency"): ("evaluate_every",),
    ("eval_env",): ("evaluation_env",),
    ("callback", "eval_callback", "log_interval"): ("callbacks",),
    ("verbose", "progress_bar", "show_progress", "use_tqdm"): (
        "progress", "a bar shows by itself in a terminal: omit it"),
    ("tensorboard_log", "tb_log_name", "track", "logger", "set_logger", "configure"): (
        "tensorboard", "train(env, callbacks=[TensorBoard(folder)]) writes rows for TensorBoard"),
    ("save_freq", "checkpoint_freq", "save_every"): (
        "checkpoint_every", "every", "train(env, callbacks=[CheckpointCallback(path, every=...)])"),
    ("random_seed", "rng", "seed", "random_state"): ("seed", "random_state"),
    ("set_random_seed",): ("SDNNQLambda(env, seed=1) is the root of all that is random in it",),
    ("n_envs", "num_envs", "make_vec_env", "DummyVecEnv", "SubprocVecEnv", "VecEnv"): (
        "n_envs", "n_environments",
        "train takes a vector environment: gymnasium.make_vec(id, num_envs=...)"),
    ("env", "env_id", "gym_id", "environment", "get_env", "set_env"): (
        "environment", _ENVIRONMENT_ELSEWHERE),
    ("algo", "algorithm", "model"): ("agent", "name"),
    ("obs",): ("observation",),
    ("deterministic",): ("act(observation, explore=False) acts greedily",),
    ("reset_num_timesteps",): ("Training.load resumes a training that Training.save wrote",),
    ("normalize", "norm_obs", "normalize_observations", "VecNormalize", "get_vec_normalize_env"): (
        "observation_range",
        "observations need no normalization, or SDNNQLambda(env, observation_range='running')"),
    ("Monitor", "get_episode_rewards", "ep_info_buffer", "return_episode_rewards"): (
        "results have all returns: train(env, steps=...).returns, evaluate(agent, env).returns",),
    ("render", "render_mode"): ("gymnasium.make(id, render_mode='human') shows what happens",),
    ("check_env",): ("from gymnasium.utils.env_checker import check_env",),
    ("ActionMasker", "get_action_masks"): (
        "from sdnn.environments import ActionMasks, which agents follow",),
    ("EvalCallback",): (
        "train(env, evaluate_every=..., evaluation_env=..., callbacks=[SaveBestAgent(path)])",),
    ("StopTrainingOnMaxEpisodes",): ("train(env, episodes=...) stops after these",),
    ("StopTrainingOnNoModelImprovement",): ("StopTrainingOnNoImprovement",),
    ("BaseCallback",): ("Callback", "from sdnn.agents import Callback"),
    ("CallbackList",): ("train(env, callbacks=[...]) takes a list",),
    ("reward_threshold", "reward_goal"): ("target_return", "mean_return"),
    ("lr_schedule", "linear_schedule", "exploration_schedule"): (
        "train(env, callbacks=[Schedule(learning_rate=...)]) sets rates by functions",),
    ("evaluate_policy", "evaluate", "eval"): (
        "evaluate", "from sdnn.agents import evaluate; evaluate(agent, env, episodes=...)"),
    ("fit", "train"): ("train", "SDNNQLambda(env).train(env, steps=...) makes and trains an agent"),
    ("action", "select_action", "choose_action", "get_action", "step"): ("act",),
    ("update", "remember", "observe", "store_transition"): (
        "learn", "learn(Transition(observation, action, reward, next_observation, terminated))"),
    ("get_parameters", "set_parameters", "parameters", "state_dict", "load_state_dict"): (
        "state() has all arrays; save(path) and load_agent(path) keep everything",),
    ("load", "load_model"): ("load_agent", "from sdnn.agents import load_agent"),
    ("PPO", "A2C", "DQN", "SAC", "TD3", "DDPG", "HER", "QRDQN", "TRPO", "TQC", "RecurrentPPO",
     "MaskablePPO", "CrossQ"): ("q-lambda", _AGENTS),
    ("save_path", "log_dir", "logdir", "save_dir", "output_dir"): ("out", "path"),
    ("epochs", "n_epochs", "num_epochs", "nb_epoch", "n_iter"): ("max_iter", "epochs"),
    ("patience", "max_no_improvement_evals"): ("n_iter_no_change", "max_evaluations"),
    ("validation_split",): ("validation_fraction",),
    ("bins", "num_bins", "n_tilings"): ("n_bins", "approximator"),
    ("hidden_layer_sizes", "hidden_size", "hidden_units", "units"): (
        "n_hidden_units", "n_pattern_units"),
    ("policy", "policy_kwargs", "net_arch", "q_network", "q_net", "features_extractor_class",
     "MlpPolicy", "ActorCriticPolicy"): (_NO_POLICY,),
    ("batch_size", "buffer_size", "train_freq", "train_frequency", "gradient_steps", "tau",
     "target_update_interval", "target_network_frequency", "replay_buffer_class",
     "replay_buffer_kwargs", "optimize_memory_usage", "replay_buffer", "save_replay_buffer",
     "load_replay_buffer", "rollout_buffer", "collect_rollouts"): (_NO_BATCHES,),
    ("optimizer", "optimizer_class", "loss", "activation", "dropout", "vf_coef",
     "clip_range", "max_grad_norm", "normalize_advantage", "metrics", "solver"): (_NO_GRADIENT,),
    ("device", "cuda", "gpu"): ("everything runs on the CPU: omit it",),
}  # fmt: skip
"""Names in other libraries, and the corresponding names or advice here, the best first.

Stable-Baselines3, CleanRL, scikit-learn and Keras have them. Advice is a sentence; only its spaces
distinguish it from a name.
"""
HABITS = {habit.lower(): hints for habits, hints in _MEANINGS.items() for habit in habits}
"""The hints of `_MEANINGS` by each of its names, in lower case."""


def advice(
    name: str, possible: Iterable[str], elsewhere: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Return a hint for an unknown name: a suggestion, and all possible names by similarity.

    ``elsewhere`` has names that are possible in other places, and how they are written there. The
    suggestion is, in this order: the same word or what another library means by it, the sentence
    about it, or a name that looks alike. It may be missing.

    >>> advice("gamma", ("epsilon", "discount"))
    'did you mean discount? possible: discount, epsilon'
    >>> advice("steps", ("seed",), {"steps": "budget.steps"})
    'did you mean budget.steps? possible: seed'
    """
    known = tuple(possible)
    word = name.strip("-").replace("-", "_").lower()
    meanings = (word, *HABITS.get(word, ()))
    known_meanings = [meaning for meaning in meanings if meaning in known]
    suggestions = known_meanings + [elsewhere[other] for other in meanings if other in elsewhere]
    sentence = next((meaning for meaning in meanings if " " in meaning), "")
    if not sentence:
        # Chosen limits: names of other places must be more alike.
        suggestions += difflib.get_close_matches(name, known, n=1, cutoff=0.7)
        alike_elsewhere = difflib.get_close_matches(name, elsewhere, n=1, cutoff=0.8)
        suggestions += [elsewhere[alike] for alike in alike_elsewhere]
    hint = f"{sentence}; " if sentence else ""
    if suggestions:
        hint = f"did you mean {suggestions[0]}? "
    alike = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    listed = ", ".join(dict.fromkeys([*known_meanings, *alike, *known]))
    return f"{hint}possible: {listed}" if known else hint.strip("; ")


def error_of_name(package: str, name: str, names: Iterable[str], others: str = "") -> Exception:
    """Return the error about a name that a package lacks.

    Only the package's ``__getattr__`` may call it: the caller of that decides on the error's class.
    ``names`` are those of the package, ``others`` packages in which imported names are looked up.
    Python replaces an AttributeError where a name is imported, so that advice needs an ImportError.
    """
    plain = AttributeError(f"module {package!r} has no attribute {name!r}")
    if name.startswith("_") or find_spec(f"{package}.{name}") is not None:
        return plain
    # `from package import name` calls `__getattr__` from this function of importlib.
    is_imported = sys._getframe(2).f_code.co_name == "_handle_fromlist"
    elsewhere = {known: known for known in names}
    for other in others.split() if is_imported else ():
        for known in import_module(other).__all__:
            elsewhere.setdefault(known, f"from {other} import {known}")
    hint = advice(name, (), elsewhere)
    error_class = ImportError if is_imported else AttributeError
    return error_class(f"{package} has no {name}: {hint}") if hint else plain
