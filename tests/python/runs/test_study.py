"""Study files: the configurations and trials that they plan, and errors in files."""

import sys
from pathlib import Path

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
    """Return the specifications of a study, by their pairs (case, variant)."""
    return {pair: combination.spec for pair, combination in study.combinations.items()}


def test_a_study_without_variants_plans_the_trials_of_the_paper(study):
    loaded = study(PAPER)
    cases = {case.id: case for experiment in EXPERIMENTS for case in experiment.cases}
    assert configs(loaded) == {
        (case_id, "base"): case_spec(cases[case_id], "sdnn-c")
        for case_id in ("s4", "s4-noise", "s6")
    }
    paper = {p.key for p in plan_trials(cases.values(), n_trials=2, root_seed=3)}
    assert {p.key for p in loaded.plan()} < paper, "without the paper's other cases and agents"
    assert loaded.title == "mine"
    assert loaded.reference == "base"


def test_trial_0_of_every_case_and_variant_is_planned_before_trial_1(study):
    loaded = study(PAPER + '[axes]\n"learning.discount" = [0.5, 0.7]\n')
    plan = loaded.plan()
    # Three cases with the base and two variants each.
    assert [p.key.trial for p in plan] == 9 * [0] + 9 * [1]
    assert [p.key.case_id for p in plan[:9]] == 3 * ["s4"] + 3 * ["s4-noise"] + 3 * ["s6"]
    seeds = {(p.key.case_id, p.key.trial): p.key.seed for p in plan}
    assert all(p.key.seed == seeds[p.key.case_id, p.key.trial] for p in plan)
    assert len(set(seeds.values())) == 3 * 2, "a seed for each trial of a case"


def test_settings_of_variants_override_cases_agents_and_base(study):
    loaded = study(
        """
        [study]
        reference = "b"
        cases = ["s4", "custom"]
        [base]
        learning.discount = 0.1
        learning.epsilon = 0.11
        "environment.kwargs.acrobot.max_torque" = 5
        [agents.sdnn-c]
        learning.discount = 0.2
        learning.learning_rate = 0.22
        [agents.rbf]
        learning.discount = 0.25
        [cases.custom]
        title = "custom"
        environment = { id = "sdnn/PaperAcrobot-v0", kwargs.sensors.n_sensors = 5 }
        agent = "sdnn-c-paper"
        learning = { discount = 0.3, n_greedy_steps = 3 }
        [variants.a]
        [variants.b]
        title = "the b"
        learning.discount = 0.4
        [variants.b.cases.custom]
        learning.discount = 0.5
        [variants.c]
        agent = "rbf"
        """
    )
    # Each overrides those before: base, agents, cases, variants, cases of a variant. By default
    # the learning rate of rbf is 0.5, and n_greedy_steps is 10.
    values = {
        pair: (c.learning.discount, c.learning.learning_rate, c.learning.n_greedy_steps)
        for pair, c in configs(loaded).items()
    }
    assert values == {
        ("s4", "b"): (0.4, 0.22, 10),
        ("s4", "a"): (0.2, 0.22, 10),
        ("s4", "c"): (0.25, 0.5, 10),
        ("custom", "b"): (0.5, 0.22, 3),
        ("custom", "a"): (0.3, 0.22, 3),
        ("custom", "c"): (0.3, 0.5, 3),
    }
    assert {c.learning.epsilon for c in configs(loaded).values()} == {0.11}
    tasks = {p[0]: c.environment.paper_settings() for p, c in configs(loaded).items()}
    assert {name: task.sensors.n_sensors for name, task in tasks.items()} == {"s4": 4, "custom": 5}
    assert {task.acrobot.max_torque for task in tasks.values()} == {5.0}
    assert [case.title for case in loaded.cases] == ["Case I: 4 inputs, no noise", "custom"]
    assert [variant.title for variant in loaded.variants] == ["the b", "a", "c"]  # reference first


def test_arrays_texts_and_numbers_of_a_study_file_reach_the_configuration(study):
    loaded = study(
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
    config = configs(loaded)["s4", "x"]
    expected = paper_spec(
        approximator={
            "circular": (True, True, False, False), "initial_threshold": 10.0, "u_low": 7
        },
        environment={"kwargs": {"goal": {"kind": "inverse_sqrt"}}},
    )  # fmt: skip
    assert config == expected
    assert config.config_hash == expected.config_hash
    assert configs(loaded)["s6", "x"].approximator.circular == ()


def test_axes_vary_one_key_at_a_time(study):
    loaded = study(
        PAPER
        + """
        [axes]
        learning.tie_rule = ["uniform", "middle"]
        approximator.circular = [[true, true, false, false, false, false]]
        environment.kwargs.sensors.noise = [0.01]
        environment.kwargs.goal.scale = [50]
        """
    )
    assert [variant.id for variant in loaded.variants] == [
        "base", "tie_rule=uniform", "tie_rule=middle",
        "circular=[true, true, false, false, false, false]", "noise=0.01", "scale=50",
    ]  # fmt: skip
    of_s6 = {variant: c for (case, variant), c in configs(loaded).items() if case == "s6"}
    assert of_s6["tie_rule=middle"].learning.tie_rule == "middle"
    assert of_s6["noise=0.01"].environment.paper_settings().sensors.noise == 0.01
    assert of_s6["scale=50"].environment.paper_settings().goal.scale == 50.0
    assert loaded.copies() == {"tie_rule=uniform": "base"}
    # Two trials of three cases; tie_rule=uniform repeats the base, five of six variants run.
    assert len(loaded.plan()) == 2 * 3 * 5


def test_axes_combine_to_a_product(study):
    loaded = study(
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
    assert [variant.id for variant in loaded.variants] == [
        "paper",
        "agent=sdnn-c, scale=50, integration_step=0.02",
        "agent=sdnn-c, scale=100, integration_step=0.02",
        "agent=fuzzy, scale=50, integration_step=0.02",
        "agent=fuzzy, scale=100, integration_step=0.02",
    ]
    assert loaded.reference == "paper"
    last = configs(loaded)["s4", "agent=fuzzy, scale=100, integration_step=0.02"]
    assert last == configs(loaded)["s4", "paper"].replace(
        agent=last.agent, approximator=last.approximator, learning=last.learning
    )
    assert last.agent.name == "fuzzy"


def test_variants_of_axes_are_named_by_the_last_part_of_their_key(study):
    text = PAPER + "[axes]\nlearning.epsilon = [0.2]\nenvironment.kwargs.goal.floor = [0.02]\n"
    loaded = study(text + "[variants.other]\nagent = 'fuzzy'\n")
    assert [v.id for v in loaded.variants] == ["base", "other", "epsilon=0.2", "floor=0.02"]
    text = "[base]\nenvironment.id = 'Pendulum-v1'\n[axes]\n"
    text += "environment.noise = [0.1]\nenvironment.kwargs.g = [5.0]\n"
    loaded = study(text)
    assert [v.id for v in loaded.variants] == ["base", "noise=0.1", "g=5.0"]
    assert configs(loaded)["Pendulum-v1", "g=5.0"].environment.kwargs == {"g": 5.0}


def test_without_cases_the_base_environment_is_the_only_case(study):
    loaded = study(
        """
        [base]
        environment = "Pendulum-v1"
        budget.episodes = 20
        protocol.evaluate_every_episodes = 10
        """
    )
    config = configs(loaded)["Pendulum-v1", "base"]
    assert config.environment.id == "Pendulum-v1"
    assert (config.budget.episodes, config.protocol.evaluate_every_episodes) == (20, 10)
    assert config.label == "q-lambda-general"


def test_a_study_may_mix_the_papers_acrobot_with_other_environments(study):
    loaded = study(
        """
        [cases.s4]
        [cases.cart]
        environment.id = "CartPole-v1"
        environment.ranges.1 = [-4, 4]
        environment.ranges.3 = [-4, 4]
        """
    )
    assert configs(loaded)["s4", "base"].environment.is_paper_acrobot
    cart = configs(loaded)["cart", "base"]
    assert cart.environment.ranges == {"1": (-4.0, 4.0), "3": (-4.0, 4.0)}
    loaded.check()  # raises an error if an agent or environment cannot be made


def test_options_override_the_number_of_trials_and_the_seed_of_the_file(study):
    loaded = study(PAPER, n_trials=1, seed=9)
    assert (loaded.n_trials, loaded.seed) == (1, 9)
    assert len(loaded.plan()) == 3, "a trial of each case"


def test_only_selects_variants_and_refuses_unknown_ones(study):
    text = PAPER + "[axes]\nlearning.discount = [0.5, 0.7]\n"
    loaded = study(text, only=["discount=0.5"])
    assert {p.spec.learning.discount for p in loaded.plan()} == {0.5}
    assert len(loaded.combinations) == 3 * 3, "those of all cases and variants"
    with pytest.raises(ValueError, match=r"discount=0\.6.*discount=0\.[57]"):
        study(text, only=["discount=0.6"])


def test_a_variant_with_only_runs_in_the_listed_cases(study):
    text = PAPER + "[variants.a]\n[variants.b]\nonly = ['s6']\nlearning.discount = 0.5\n"
    loaded = study(text)
    assert set(configs(loaded)) == {("s4", "a"), ("s4-noise", "a"), ("s6", "a"), ("s6", "b")}
    assert len(loaded.plan()) == 8  # two trials of four pairs
    assert {p.key.case_id for p in study(text, only=["b"]).plan()} == {"s6"}
    assert loaded.copies() == {}, "no variant equals another one"


PLUGIN = """
from dataclasses import dataclass
from sdnn.agents import QLearningConfig, RBFQLearning
from sdnn.approximators import RBFNetworkConfig
from sdnn.runs import AGENTS, AgentEntry, register

register(AgentEntry(id="plugged", title="Plugged", approximator=RBFNetworkConfig,
                    learning=QLearningConfig, agent=RBFQLearning))
"""


def test_imported_modules_beside_a_study_file_may_register_agents(study, tmp_path):
    (tmp_path / "my_plugged_agents.py").write_text(PLUGIN)
    try:
        loaded = study(
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
        config = configs(loaded)["s4", "base"]
        assert (config.agent.name, config.approximator.n_bases) == ("plugged", 3)
        loaded.check()
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
def test_errors_of_registered_configurations_name_file_and_line(study, tmp_path, error):
    (tmp_path / "strict_agents.py").write_text(STRICT.replace("ERROR", error))
    text = "[study]\nimports = ['strict_agents']\ncases = ['s4']\n[base]\nagent = 'strict'\n"
    try:
        with pytest.raises(ConfigError, match=r"mine\.toml:6: base\.approximator\.size"):
            study(text + "approximator.size = 0\n")
    finally:
        AGENTS.pop("strict", None)
        sys.modules.pop("strict_agents", None)


def wrong_studies(name):
    """Yield texts of studies, the line that is wrong (0 if no line is), and the message about it.

    In the file, a title such as "=== title" precedes each study; "#! message" follows the title or
    the line that is wrong.
    """
    text = Path(__file__, "../../reference/wrong_studies", name).resolve().read_text()
    for part in text.split("=== ")[1:]:
        title, _, study = part.partition("\n")
        lines = part.splitlines()  # the title has the number 0
        (number,) = (n for n, line in enumerate(lines) if "#! " in line)
        message = lines[number].partition("#! ")[2]
        yield pytest.param(study, number, message, id=title.partition("  #!")[0])


PRODUCT = "[cases.s4]\n[axes]\ncombine = 'product'\n" + "".join(
    f"learning.{name} = {[n / 100 for n in range(100)]}\n"
    for name in ("epsilon", "discount", "learning_rate")
)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        *wrong_studies("wrong.txt"),
        (PRODUCT, 3, "axes.combine: must give at most 5000 combinations"),
        # Values and keys that are nested too deeply have no line.
        ("[base]\nenvironment.kwargs.a = " + 99 * "[" + 99 * "]", 0, "base.environment"),
        ("[base]\n" + 99 * "a." + "a = 1", 0, "must be TOML: a key must have"),
    ],
)
def test_errors_in_a_study_file_name_file_line_and_key(study, tmp_path, text, line, message):
    with pytest.raises(ConfigError) as caught:
        study(text)
    location = f"{tmp_path / 'mine.toml'}:{line or ''}".rstrip(":")  # line 0: the file only
    assert str(caught.value).startswith(f"{location}: {message}")


@pytest.mark.parametrize(("text", "line", "message"), [*wrong_studies("unusable.txt")])
def test_check_raises_errors_of_the_core_with_file_and_line(study, tmp_path, text, line, message):
    with pytest.raises(ConfigError) as caught:
        study(text).check()
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}:{line}: {message}")


def test_check_skips_trials_that_are_stored(study, monkeypatch):
    # The step is no whole fraction of the second between decisions. Two trials are planned, and an
    # error is raised unless both are stored.
    impossible = "environment.kwargs.acrobot.integration_step = 0.3\n"
    loaded = study("[cases.s4]\n[variants.a]\n" + impossible, n_trials=2)
    loaded.check(stored=loaded.keys("s4", "a"))
    with pytest.raises(ConfigError):
        loaded.check(stored=loaded.keys("s4", "a")[:1])


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ("budget.steps = 300", "protocol.evaluate_every"),
        ("budget.episodes = 40\nprotocol.evaluate_every = 0", "protocol.evaluate_every_episodes"),
        ("budget.target_return = 40.0", "budget.target_return"),
    ],
)
def test_settings_that_make_trials_incomparable_are_refused(study, settings, key):
    # Trials are compared at their evaluations: steps need `evaluate_every`, episodes
    # `evaluate_every_episodes`, and none may end early, at a target return.
    cartpole = study(f"[base]\nenvironment.id = 'CartPole-v1'\n{settings}\n")
    refuses(key, cartpole.check, error=ConfigError)
