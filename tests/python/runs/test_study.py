"""From a study file to configurations and trials, and what is said about wrong files."""

import sys

import pytest

from refusals import refuses
from sdnn.reproduction import EXPERIMENTS, case_spec, paper_spec, plan_trials
from sdnn.runs import AGENTS, ConfigError

PAPER = """
[study]
cases = ["s4", "s4-noise", "s6"]
trials = 2
seed = 3
"""


def configs(study):
    return {pair: combination.spec for pair, combination in study.combinations.items()}


def test_a_study_of_nothing_is_the_paper_and_shares_its_trials(study):
    found = study(PAPER)
    cases = {case.id: case for experiment in EXPERIMENTS for case in experiment.cases}
    assert configs(found) == {
        (case_id, "base"): case_spec(cases[case_id], "sdnn-c")
        for case_id in ("s4", "s4-noise", "s6")
    }
    paper = {p.key for p in plan_trials(cases.values(), 2, 3)}
    assert {p.key for p in found.plan()} < paper
    assert found.title == "mine"
    assert found.reference == "base"


def test_the_first_trials_of_all_come_first(study):
    found = study(PAPER + '[axes]\n"learning.discount" = [0.5, 0.7]\n')
    plan = found.plan()
    assert [p.key.trial for p in plan] == 9 * [0] + 9 * [1]
    assert [p.key.case_id for p in plan[:9]] == 3 * ["s4"] + 3 * ["s4-noise"] + 3 * ["s6"]
    seeds = {(p.key.case_id, p.key.trial): p.key.seed for p in plan}
    assert all(p.key.seed == seeds[p.key.case_id, p.key.trial] for p in plan)
    assert len(set(seeds.values())) == 6


def test_later_layers_override_earlier_ones(study):
    found = study(
        """
        [study]
        reference = "b"
        cases = ["s4", "own"]
        [base]
        learning.discount = 0.1
        learning.epsilon = 0.11
        "environment.kwargs.acrobot.max_torque" = 5
        [agents.sdnn-c]
        learning.discount = 0.2
        learning.learning_rate = 0.22
        [agents.rbf]
        learning.discount = 0.25
        [cases.own]
        title = "my own"
        environment = { id = "sdnn/PaperAcrobot-v0", kwargs.sensors.n_sensors = 5 }
        agent = "sdnn-c-paper"
        learning = { discount = 0.3, n_greedy_steps = 3 }
        [variants.a]
        [variants.b]
        title = "the b"
        learning.discount = 0.4
        [variants.b.cases.own]
        learning.discount = 0.5
        [variants.c]
        agent = "rbf"
        """
    )
    values = {
        pair: (c.learning.discount, c.learning.learning_rate, c.learning.n_greedy_steps)
        for pair, c in configs(found).items()
    }
    assert values == {
        ("s4", "b"): (0.4, 0.22, 10),
        ("s4", "a"): (0.2, 0.22, 10),
        ("s4", "c"): (0.25, 0.5, 10),
        ("own", "b"): (0.5, 0.22, 3),
        ("own", "a"): (0.3, 0.22, 3),
        ("own", "c"): (0.3, 0.5, 3),
    }
    assert {c.learning.epsilon for c in configs(found).values()} == {0.11}
    tasks = {p[0]: c.environment.paper_settings() for p, c in configs(found).items()}
    assert {name: task.sensors.n_sensors for name, task in tasks.items()} == {"s4": 4, "own": 5}
    assert {task.acrobot.max_torque for task in tasks.values()} == {5.0}
    assert [case.title for case in found.cases] == ["Case I: 4 inputs, no noise", "my own"]
    assert [variant.title for variant in found.variants] == ["the b", "a", "c"]  # reference first


def test_arrays_words_and_numbers_reach_the_configuration(study):
    found = study(
        PAPER
        + """
        [variants.x]
        approximator.initial_threshold = 10
        approximator.u_low = 7
        environment.kwargs.goal.kind = "inverse_sqrt"
        [variants.x.cases.s4]
        approximator.circular = [true, true, false, false]
        """
    )
    config = configs(found)["s4", "x"]
    expected = paper_spec(
        approximator={
            "circular": (True, True, False, False), "initial_threshold": 10.0, "u_low": 7
        },
        environment={"kwargs": {"goal": {"kind": "inverse_sqrt"}}},
    )  # fmt: skip
    assert config == expected
    assert config.config_hash == expected.config_hash
    assert configs(found)["s6", "x"].approximator.circular == ()


def test_axes_vary_one_key_at_a_time(study):
    found = study(
        PAPER
        + """
        [axes]
        learning.tie_rule = ["uniform", "middle"]
        approximator.circular = [[true, true, false, false, false, false]]
        environment.kwargs.sensors.noise = [0.01]
        environment.kwargs.goal.scale = [50]
        """
    )
    assert [variant.id for variant in found.variants] == [
        "base", "tie_rule=uniform", "tie_rule=middle",
        "circular=[true, true, false, false, false, false]", "noise=0.01", "scale=50",
    ]  # fmt: skip
    of_s6 = {variant: c for (case, variant), c in configs(found).items() if case == "s6"}
    assert of_s6["tie_rule=middle"].learning.tie_rule == "middle"
    assert of_s6["noise=0.01"].environment.paper_settings().sensors.noise == 0.01
    assert of_s6["scale=50"].environment.paper_settings().goal.scale == 50.0
    assert found.copies() == {"tie_rule=uniform": "base"}
    assert len(found.plan()) == 2 * 3 * 5  # what is the same is run once


def test_axes_combine_to_a_product(study):
    found = study(
        PAPER
        + """
        [axes]
        combine = "product"
        agent = ["sdnn-c", "fuzzy"]
        environment.kwargs.goal.scale = [50, 100]
        environment.kwargs.acrobot.integration_step = [0.02]
        [variants.paper]
        """
    )
    assert [variant.id for variant in found.variants] == [
        "paper",
        "agent=sdnn-c, scale=50, integration_step=0.02",
        "agent=sdnn-c, scale=100, integration_step=0.02",
        "agent=fuzzy, scale=50, integration_step=0.02",
        "agent=fuzzy, scale=100, integration_step=0.02",
    ]
    assert found.reference == "paper"
    last = configs(found)["s4", "agent=fuzzy, scale=100, integration_step=0.02"]
    assert last == configs(found)["s4", "paper"].replace(
        agent=last.agent, approximator=last.approximator, learning=last.learning
    )
    assert last.agent.name == "fuzzy"


def test_axes_of_the_same_last_word_have_whole_names(study):
    text = PAPER + "[axes]\nlearning.epsilon = [0.2]\nenvironment.kwargs.goal.floor = [0.02]\n"
    found = study(text + "[variants.other]\nagent = 'fuzzy'\n")
    assert [v.id for v in found.variants] == ["base", "other", "epsilon=0.2", "floor=0.02"]
    text = "[base]\nenvironment.id = 'Pendulum-v1'\n[axes]\n"
    text += "environment.noise = [0.1]\nenvironment.kwargs.g = [5.0]\n"
    found = study(text)
    assert [v.id for v in found.variants] == ["base", "noise=0.1", "g=5.0"]
    assert configs(found)["Pendulum-v1", "g=5.0"].environment.kwargs == {"g": 5.0}


def test_each_environment_is_a_case(study):
    found = study(
        """
        [base]
        environment = "Pendulum-v1"
        budget.episodes = 20
protocol.evaluate_every_episodes = 10
        """
    )
    config = configs(found)["Pendulum-v1", "base"]
    assert config.environment.id == "Pendulum-v1"
    assert (config.budget.episodes, config.protocol.evaluate_every_episodes) == (20, 10)
    assert config.label == "q-lambda-general"


RANGES = "environment.ranges.1 = [-4, 4]\nenvironment.ranges.3 = [-4, 4]\n"


def test_both_kinds_of_tasks_fit_into_one_study(study):
    found = study(
        """
        [cases.s4]
        [cases.cart]
        environment.id = "CartPole-v1"
        environment.ranges.1 = [-4, 4]
        environment.ranges.3 = [-4, 4]
        """
    )
    assert configs(found)["s4", "base"].environment.is_paper_acrobot
    cart = configs(found)["cart", "base"]
    assert cart.environment.ranges == {"1": (-4.0, 4.0), "3": (-4.0, 4.0)}
    found.check()


def test_options_override_the_file(study):
    found = study(PAPER, n_trials=1, seed=9)
    assert (found.n_trials, found.seed) == (1, 9)
    assert len(found.plan()) == 3


def test_some_variants_only(study):
    text = PAPER + "[axes]\nlearning.discount = [0.5, 0.7]\n"
    found = study(text, only=["discount=0.5"])
    assert {p.spec.learning.discount for p in found.plan()} == {0.5}
    assert len(found.combinations) == 9
    with pytest.raises(ValueError, match=r"discount=0\.6.*discount=0\.[57]"):
        study(text, only=["discount=0.6"])


def test_a_variant_runs_only_in_its_cases(study):
    text = PAPER + "[variants.a]\n[variants.b]\nonly = ['s6']\nlearning.discount = 0.5\n"
    found = study(text)
    assert set(configs(found)) == {("s4", "a"), ("s4-noise", "a"), ("s6", "a"), ("s6", "b")}
    assert len(found.plan()) == 8
    assert {p.key.case_id for p in study(text, only=["b"]).plan()} == {"s6"}
    assert found.copies() == {}


PLUGIN = """
from dataclasses import dataclass
from sdnn.agents import QLearningConfig, RBFQLearning
from sdnn.approximators import RBFNetworkConfig
from sdnn.runs import AGENTS, AgentEntry, register

register(AgentEntry(id="plugged", title="Plugged", approximator=RBFNetworkConfig,
                    learning=QLearningConfig, agent=RBFQLearning))
"""


def test_modules_beside_the_file_may_register_agents(study, tmp_path):
    (tmp_path / "my_plugged_agents.py").write_text(PLUGIN)
    try:
        found = study(
            """
            [study]
            imports = ["my_plugged_agents"]
            cases = ["s4"]
            [base]
            agent = "plugged"
            approximator.n_bases = 3
            budget.episodes = 2
protocol.evaluate_every_episodes = 2
            """
        )
        config = configs(found)["s4", "base"]
        assert (config.agent.name, config.approximator.n_bases) == ("plugged", 3)
        found.check()
    finally:
        AGENTS.pop("plugged", None)
        sys.modules.pop("my_plugged_agents", None)


STRICT = """
from dataclasses import dataclass

from sdnn.agents import QLearningConfig, RBFQLearning
from sdnn.runs import AgentEntry, register

@dataclass(frozen=True, kw_only=True)
class Strict:
    n_inputs: int = 4
    size: int = 3
    def __post_init__(self):
        if self.size < 1:
            raise ERROR
register(AgentEntry(id="strict", title="Strict", approximator=Strict,
                    learning=QLearningConfig, agent=RBFQLearning))
"""


@pytest.mark.parametrize("error", ["ValueError('size is small')", "AssertionError", "TypeError"])
def test_errors_of_registered_settings_name_file_and_line(study, tmp_path, error):
    (tmp_path / "strict_agents.py").write_text(STRICT.replace("ERROR", error))
    text = "[study]\nimports = ['strict_agents']\ncases = ['s4']\n[base]\nagent = 'strict'\n"
    try:
        with pytest.raises(ConfigError, match=r"mine\.toml:6: base\.approximator\.size"):
            study(text + "approximator.size = 0\n")
    finally:
        AGENTS.pop("strict", None)
        sys.modules.pop("strict_agents", None)


WRONG = {
    "toml": ("[base]\nlearning.discount 2\n", 2, "must be TOML"),
    "table": ("base = 2\n", 1, "base: must be a table, got 2"),
    "top": ("[base]\n\n[axis]\n", 3, "axis: unknown key; did you mean axes?"),
    "study key": ("[study]\nseeds = 3\n", 2, "study.seeds: unknown key; did you mean seed?"),
    "study value": ("[study]\ntrials = 'x'\n", 2, "study.trials: must be a whole number, got 'x'"),
    "trials": ("[study]\ntrials = 0\n", 2, "study.trials: must be a whole number of at least"),
    "too many trials": (
        "[study]\ntrials = 1_000_000_000\n[cases.s4]\n", 2,
        "study.trials: must be at most 100000 in all",
    ),
    "too many combinations": (
        "[cases.s4]\n[axes]\ncombine = 'product'\n"
        + "".join(f"learning.{name} = {[n / 100 for n in range(100)]}\n"
                  for name in ("epsilon", "discount", "learning_rate")),
        3, "axes.combine: must give at most 5000 combinations",
    ),
    "deep": ("[base]\nenvironment.kwargs.a = " + 99 * "[" + 99 * "]", None, "base.environment"),
    "a long key": ("[base]\n" + 99 * "a." + "a = 1", None, "must be TOML: a key must have"),
    "seed": ("[study]\nseed = -1\n", 2, "study.seed: must be a whole number of at least 0, got -1"),
    "no cases": ("[base]\nagent = 'fuzzy'\n", None, "no cases: give some of the paper's"),
    "case": (
        "[study]\ncases = [\n 's4',\n 's5-nois',\n]\n", 2,
        "study.cases[1]: no case 's5-nois': neither a table [cases.s5-nois] nor a case of the"
        " paper; did you mean s5-noise?",
    ),
    "unlisted case": (
        "[study]\ncases = ['s4']\n[cases.x]\n", 3,
        "cases.x: is not among the cases of [study]",
    ),
    "paper's case": (
        "[cases.s4-noise]\n[cases.s4]\nenvironment.kwargs.sensors.noise = 0.1\n", 3,
        "cases.s4.environment.kwargs.sensors.noise: s4 is a case with environment.id = sdnn/Paper",
    ),
    "no table of sensors": (
        "[cases.x.environment]\nid = 'sdnn/PaperAcrobot-v0'\nkwargs.sensors = 3\n", 3,
        "cases.x.environment.kwargs.sensors: must be a table",
    ),
    "paper's case elsewhere": (
        "[cases.s4]\nenvironment = 'Pendulum-v1'\n", 2,
        "cases.s4.environment: s4 is a case with",
    ),
    "reference": (
        "[study]\nreference = 'slo'\n[cases.s4]\n[variants.slow]\n[variants.b]\n", 2,
        "study.reference: no variant 'slo'; did you mean slow? possible: slow, b",
    ),
    "import": (
        "[study]\nimports = ['json',\n'not_there_at_all']\n", 2,
        "study.imports[1]: importing not_there_at_all failed: ModuleNotFoundError",
    ),
    "only in no case": (
        "[cases.s4]\n[variants.a]\nonly = ['s4', 's5']\n", 3,
        "variants.a.only[1]: no case 's5'; possible: s4",
    ),
    "settings in another case": (
        "[cases.s4]\n[cases.x]\n[variants.a]\nonly = ['s4']\ncases.x.learning.epsilon = 0\n", 5,
        "variants.a.cases.x: unknown key; possible: s4",
    ),
    "agent": (
        "[cases.s4]\n[variants.a]\nagent = 'fuzzyy'\n", 3,
        "variants.a.agent: must be one of sdnn-c, fuzzy, rbf,",
    ),
    "agents": ("[agents.dqn]\n[cases.s4]\n", 1, "agents.dqn: no such agent; possible: sdnn-c"),
    "agent of agents": (
        "[agents.fuzzy]\nagent = 'rbf'\n[cases.s4]\n", 2,
        "agents.fuzzy.agent: settings of an agent cannot choose another one",
    ),
    "section": (
        "[cases.s4]\n[base]\n\nlerning.discount = 0.5\n", 4,
        "base.lerning.discount: unknown key; did you mean learning?",
    ),
    "setting": (
        "[cases.s4]\n[base]\nlearning = { epsilon = 0.1, discont = 2 }\n", 3,
        "base.learning.discont: unknown key; did you mean discount?",
    ),
    "setting of another agent": (
        "[cases.s4]\n[base]\nlearning.learning_rate = 0.1\n[variants.f]\nagent = 'fuzzy'\n", 3,
        "base.learning.learning_rate: unknown key; did you mean learning_coefficient?",
    ),
    "no table": ("[cases.s4]\n[base]\nlearning = 3\n", 3, "base.learning: must be a table"),
    "float": (
        "[cases.s4]\n[base.learning]\ndiscount = '0.5'\n", 3,
        "base.learning.discount: must be a number, got '0.5'",
    ),
    "infinite": (
        "[cases.s4]\n[base.environment.kwargs.acrobot]\ngravity = inf\n", 3,
        "base.environment.kwargs.acrobot.gravity: must be finite, got inf",
    ),
    "int": (
        "[cases.s4]\n[base.protocol]\nevaluate_every_episodes = 10.0\n", 3,
        "base.protocol.evaluate_every_episodes: must be a whole number, got 10.0",
    ),
    "bool": (
        "[cases.s4]\n[base.approximator]\nbalanced_anchors = 1\n", 3,
        "base.approximator.balanced_anchors: must be True or False, got 1",
    ),
    "word": (
        "[cases.s4]\n[axes]\n'learning.tie_rule' = ['uniform',\n'upper']\n", 3,
        "axes.\"learning.tie_rule\"[1]: must be one of 'uniform', 'lowest', 'middle', got 'upper'",
    ),
    "array": (
        "[cases.s4]\n[base]\napproximator.circular = [true, 1]\n", 3,
        "base.approximator.circular: must be a sequence, each True or False, got [True, 1]",
    ),
    "optional": (
        "[cases.s4]\n[base]\napproximator.u_low = 'x'\n", 3,
        "base.approximator.u_low: must be a whole number, or None, got 'x'",
    ),
    "derived": (
        "[cases.s4]\n[base]\napproximator.n_inputs = 4\n", 3,
        "base.approximator.n_inputs: follows from the observations: omit it",
    ),
    "too deep": (
        "[cases.s4]\n[base]\nlearning.discount = 0.5\n'learning.discount.x' = 0.6\n", 4,
        'base."learning.discount.x": must be SECTION.NAME, or environment.kwargs.NAME, got learn',
    ),
    "infinite argument": (
        "[base]\nenvironment.id = 'Pendulum-v1'\nenvironment.kwargs.g = inf\n", 3,
        "base.environment.kwargs.g: must be finite, got inf",
    ),
    "twice": (
        "[cases.s4]\n[base]\nlearning.discount = 0.5\n'learning.discount' = 0.6\n", 4,
        'base."learning.discount": learning.discount is set twice',
    ),
    "short trials": (
        "[cases.s4]\n[base]\nbudget.episodes = 9\n", 3,
        "base.budget.episodes: must be at least evaluate_every_episodes (10), got 9",
    ),
    "axis": ("[cases.s4]\n[axes]\nlearning.epsilon = 5\n", 3, "axes.learning.epsilon: must be an"),
    "axis twice": (
        "[cases.s4]\n[axes]\nlearning.epsilon = [5, 5]\n", 3,
        "axes.learning.epsilon: must be different values",
    ),
    "combine": (
        "[cases.s4]\n[axes]\ncombine = 'all'\n", 3,
        "axes.combine: must be one of 'one_at_a_time', 'product', got 'all'",
    ),
    "name taken": (
        "[cases.s4]\n[axes]\nlearning.epsilon = [0]\n[variants.'epsilon=0']\n", 3,
        "axes.learning.epsilon[0]: there is a variant 'epsilon=0' already",
    ),
    "case of a variant": (
        "[cases.s4]\n[variants.a.cases.s6]\n", 2,
        "variants.a.cases.s6: unknown key; possible: s4",
    ),
    "environment without id": (
        "[cases.x]\nenvironment.noise = 0.1\n", 2,
        "environment.id: must be given",
    ),
    "sensors": (
        "[cases.x.environment]\nid = 'sdnn/PaperAcrobot-v0'\nkwargs.sensors.n_sensors = 9\n", 3,
        "cases.x.environment.kwargs.sensors.n_sensors: must be in [4, 6], got 9",
    ),
    "discount": (
        "[cases.s4]\n[variants.ok]\n[variants.bad]\nlearning.discount = 2\n", 4,
        "variants.bad.learning.discount: must be in [0, 1], got 2"
        " (case s4, variant bad)",
    ),
    "range": (
        "[base]\nenvironment.id = 'Pendulum-v1'\nenvironment.ranges.0 = [1, 0]\n", 3,
        "base.environment.ranges.0: must be finite, low < high, got 1.0 and 0.0",
    ),
    "seed of a trial": ("[base]\nseed = 3\n", 2, "base.seed: is no setting of a study"),
    "presets": (
        "[cases.s4]\n[variants.a]\nagent.preset = 'best'\n", 3,
        "variants.a.agent.preset: must be one of 'paper', 'general', 'robust', 'small'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_errors_name_file_line_and_key(study, name, tmp_path):
    text, line, message = WRONG[name]
    with pytest.raises(ConfigError) as caught:
        study(text)
    place = str(tmp_path / "mine.toml") + ("" if line is None else f":{line}")
    assert str(caught.value).startswith(f"{place}: {message}")


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (
            "[cases.s4]\n[axes.environment.kwargs]\nacrobot.integration_step = [\n0.02,\n0.3]\n", 3,
            "axes.environment.kwargs.acrobot.integration_step[1]: must be a whole fraction",
        ),
        (
            "[base]\nenvironment = 'MountainCar-v0'\n[variants.f]\nagent = 'fuzzy'\n", 2,
            "base.environment: action_space must be a Box, got Discrete"
            " (case MountainCar-v0, variant f)",
        ),
        ("[base]\nenvironment = 'Pendulm-v1'\n", 2, "base.environment: no environment"),
        (
            "[base]\nenvironment.id = 'Pendulum-v1'\nenvironment.kwargs = { gg = 3 }\n", 3,
            "base.environment.kwargs.gg: Pendulum-v1 cannot be made",
        ),
        (
            "[base]\nenvironment.id = 'CartPole-v1'\nenvironment.noise = 0.1\n", 2,
            "environment.ranges.1: must be given",
        ),
        (
            "[base]\nenvironment.id = 'Pendulum-v1'\nenvironment.ranges.7 = [0, 1]\n", 3,
            "base.environment.ranges.7: Pendulum-v1 has the variables 0 to 2, got 7",
        ),
    ],
)  # fmt: skip
def test_errors_of_the_core_are_raised_before_any_trial(study, tmp_path, text, line, message):
    with pytest.raises(ConfigError) as caught:
        study(text).check()
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}:{line}: {message}")


def test_only_trials_that_are_not_stored_are_checked(study, monkeypatch):
    text = "[cases.s4]\n[variants.a]\nenvironment.kwargs.acrobot.integration_step = 0.3\n"
    found = study(text, n_trials=2)
    found.check(stored=found.keys("s4", "a"))
    with pytest.raises(ConfigError):
        found.check(stored=found.keys("s4", "a")[:1])


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ("budget.steps = 300", "protocol.evaluate_every"),
        ("budget.episodes = 40\nprotocol.evaluate_every = 0", "protocol.evaluate_every_episodes"),
        ("budget.target_return = 40.0", "budget.target_return"),
    ],
)
def test_trials_that_could_not_be_compared_are_refused(study, settings, key):
    refuses(
        key,
        study(f"[base]\nenvironment.id = 'CartPole-v1'\n{RANGES}{settings}\n").check,
        error=ConfigError,
    )
