"""There is one training loop, one store, one progress display and one name for each agent."""

import ast
from pathlib import Path

import sdnn
from sdnn.agents.registry import AGENTS

PACKAGE = Path(sdnn.__file__).parent


def modules_with(is_wanted):
    """Names of the modules of the package that have a wanted node in their syntax trees."""
    modules = set()
    for path in PACKAGE.rglob("*.py"):
        if any(map(is_wanted, ast.walk(ast.parse(path.read_text("utf-8"))))):
            modules.add(path.relative_to(PACKAGE).with_suffix("").as_posix())
    return modules


def calls(method):
    """Whether a node calls a method of this name, but of ``self`` or a part that is compiled."""

    def is_wanted(node):
        return (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == method
        )

    return is_wanted


def imports(name):
    def is_wanted(node):
        if isinstance(node, ast.Import):
            return any(alias.name == name for alias in node.names)
        return isinstance(node, ast.ImportFrom) and node.module == name

    return is_wanted


def test_only_the_training_loop_steps_environments_and_learns():
    steps, acts, learns = map(modules_with, map(calls, ("step", "act", "learn")))
    outside = {name for name in steps if not name.startswith("environments/")}
    assert outside == {"training/loop", "training/episodes"}
    agents = {"agents/agent", "agents/base", "agents/q_learning", "agents/fuzzy_q_learning"}
    logged = {"agents/datasets", "agents/imitation"}  # learn from files, without environments
    of_agents = {name for name in learns if not name.startswith("estimators/")}
    assert of_agents - agents - logged == {"training/loop"}
    assert acts - agents - {"agents/inspection"} == {"training/loop", "training/evaluation"}


def test_only_the_store_imports_sqlite():
    assert modules_with(imports("sqlite3")) == {"runs/journal", "runs/store"}


def test_only_one_module_draws_progress_bars():
    drawn = modules_with(imports("rich.progress"))
    # The estimators' bars are the epochs of `verbose`, in notebooks and logs, too.
    assert drawn - {"estimators/training"} == {"support/progress"}


def test_each_agent_class_has_one_registered_id():
    classes = {entry.agent for entry in AGENTS.values()}
    assert len(classes) == len(AGENTS)
    assert set(AGENTS) == {"sdnn-c", "q-lambda", "actor-critic", "rbf", "fuzzy"}
