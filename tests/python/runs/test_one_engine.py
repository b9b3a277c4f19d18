"""There is one training loop, one store, one progress display and one name for each agent."""

import ast
from pathlib import Path

import sdnn
from sdnn.agents.registry import AGENTS

PACKAGE = Path(sdnn.__file__).parent


def modules_with(is_match):
    """Return the names of the modules that have a matching node in their syntax trees."""
    modules = set()
    for path in PACKAGE.rglob("*.py"):
        if any(map(is_match, ast.walk(ast.parse(path.read_text("utf-8"))))):
            modules.add(path.relative_to(PACKAGE).with_suffix("").as_posix())
    return modules


def calls(method):
    """Return a function that tells whether a syntax node calls a method of this name."""

    def is_match(node):
        is_method_call = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        return is_method_call and node.func.attr == method

    return is_match


def imports(name):
    """Return a function that tells whether a syntax node imports the module or from it."""

    def is_match(node):
        if isinstance(node, ast.Import):
            return any(alias.name == name for alias in node.names)
        return isinstance(node, ast.ImportFrom) and node.module == name

    return is_match


def test_only_the_training_loop_steps_environments_and_learns():
    call_step, call_act, call_learn = (modules_with(calls(m)) for m in ("step", "act", "learn"))
    outside = {name for name in call_step if not name.startswith("environments/")}
    assert outside == {"training/loop", "training/episodes"}
    agents = {"agents/agent", "agents/base", "agents/q_learning", "agents/fuzzy_q_learning"}
    logged = {"agents/datasets", "agents/imitation"}  # learn from files, without environments
    of_agents = {name for name in call_learn if not name.startswith("estimators/")}
    assert of_agents - agents - logged == {"training/loop"}
    assert call_act - agents - {"agents/inspection"} == {"training/loop", "training/evaluation"}


def test_only_the_store_imports_sqlite():
    assert modules_with(imports("sqlite3")) == {"runs/journal", "runs/store"}


def test_only_one_module_draws_progress_bars():
    assert modules_with(imports("rich.progress")) == {"support/progress"}


def test_each_agent_class_has_one_registered_id():
    classes = {entry.agent for entry in AGENTS.values()}
    assert len(classes) == len(AGENTS)
    assert set(AGENTS) == {"sdnn-c", "q-lambda", "actor-critic", "rbf", "fuzzy"}
