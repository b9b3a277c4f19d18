"""The text of exported C headers: its size, and what compilers and cppcheck find in it."""

import os

import gymnasium as gym
import pytest

import c_learners
from c_estimators import fitted
from c_kernel_estimators import fitted_kernel
from c_policies import STRICT_CPP, agents, box, run
from sdnn.agents import SDNNQLambda, SDNNQLearning
from sdnn.export import c_header, estimator_header, new_agent

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
IN_CPP = ("-x", "c++", *STRICT_CPP, "-Wpedantic", "-Wshadow")
COMPILERS = {
    "gcc": ("-std=c99", *WARNINGS),
    "clang": ("-std=c99", *WARNINGS),
    "g++": IN_CPP,
    "clang++": IN_CPP,
}


def headers():
    """A header of each kind, by name."""
    learners = ("network", "paper_rule", "actor_vector", "dutch", "several", "states")
    learners += ("actor_running",)
    header_by_name = {}
    for name in learners:
        header_by_name[name] = c_header(getattr(c_learners, name)(), name, learning=True)
    for name in c_learners.TIMED:
        header_by_name[name.replace("-", "_")] = c_learners.exported(name, name.replace("-", "_"))
    for name in ("observer", "differences", "actor-averages", "actor-observer"):
        agent = c_learners.LEARNERS[name]()
        prefix = name.replace("-", "_")
        header_by_name[prefix] = c_header(agent, prefix, learning=True)
        header_by_name[f"{prefix}_policy"] = c_header(agent, f"{prefix}_policy")
    for name in ("linear", "actor", "pairs", "several"):
        header_by_name[f"{name}_policy"] = c_header(agents()[name], f"{name}_policy")
    for kind, missing in (("q-lambda", "hold"), ("actor-critic", "code"), ("sdnn-c", "hold")):
        agent = new_agent(
            box(1.0, 2.0), gym.spaces.Discrete(2), kind=kind, missing=missing,
            approximator=c_learners.NETWORK if kind == "sdnn-c" else c_learners.SMALL,
        )  # fmt: skip
        header_by_name[missing + kind[0]] = c_header(agent, missing + kind[0], learning=True)
        header_by_name[f"{missing + kind[0]}_policy"] = c_header(
            agent, f"{missing + kind[0]}_policy"
        )
    model, _ = fitted("categories")
    header_by_name["classes"] = estimator_header(model, "classes")
    header_by_name["learning_classes"] = estimator_header(model, "learning_classes", learning=True)
    header_by_name["kernels"] = estimator_header(fitted_kernel("directions")[0], "kernels")
    return header_by_name


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Each header, and a source file that includes it with everything that it may have."""
    folder = tmp_path_factory.mktemp("headers")
    for name, header in headers().items():
        (folder / f"{name}.h").write_text(header.text)
        defines = "".join(f"#define {name.upper()}_{word}\n" for word in ("USE_FLOAT", "REFUSES"))
        (folder / f"{name}.c").write_text(f'{defines}#include "{name}.h"\n')
    return folder


@pytest.mark.parametrize("compiler", COMPILERS)
def test_compilers_warn_of_nothing_in_any_header(compiler, folder, needs):
    needs(compiler)
    sources = sorted(folder.glob("*.c"))
    assert len(sources) > 20
    run(compiler, *COMPILERS[compiler], "-fsyntax-only", *sources)


def test_cppcheck_finds_nothing_in_any_header(folder, needs):
    needs("cppcheck")
    # Definitions on the command line keep it from trying every combination of them.
    findings = run(
        "cppcheck", "--enable=warning,style,performance,portability", "--quiet", "--std=c99",
        "-DONE", "--inline-suppr", "--error-exitcode=1", "-j", os.cpu_count(),
        *sorted(folder.glob("*.c")),
    )  # fmt: skip
    assert findings == b""


@pytest.mark.parametrize("kind", ["q-lambda", "actor-critic", "sdnn-c"])
def test_new_agents_have_at_most_200_kilobytes_of_text(kind):
    space = gym.spaces.Box(-1.0, 1.0, (4,))
    agent = new_agent(space, gym.spaces.Discrete(2), kind=kind)
    assert len(c_header(agent, "cartpole", learning=True).text) <= 200_000


def test_text_of_large_headers_is_in_proportion_to_flash():
    # Weights of SDNN-C need less text than patterns, which are bytes in decimals.
    spaces = gym.spaces.Box(-1.0, 1.0, (4,)), gym.spaces.Discrete(2)
    linear = SDNNQLambda(*spaces, inputs="all", angle_pairs=[], observation_range=(-1.0, 1.0))
    for agent, most in ((SDNNQLearning(*spaces, preset="small"), 3.0), (linear, 3.6)):
        header = c_header(agent, "cartpole")
        assert len(header.text) <= most * header.flash_bytes
