"""Recipes of package managers for C++, without a network."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "cpp"

LOCAL_PACKAGE = """
from conan import ConanFile
class LocalPackage(ConanFile):
    name, version, package_type = "{name}", "{version}", "header-library"
    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "{file}")
        self.cpp_info.set_property("cmake_target_name", "{target}")
        self.cpp_info.includedirs = [r"{include}"]
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
"""
"""Recipe of a package of headers that this machine has, instead of that of Conan's server."""


@pytest.fixture
def conan(needs, tmp_path):
    """Runs conan, with an empty cache; returns what it prints."""
    needs("conan", "g++")

    def run(*arguments):
        env = os.environ | {"CONAN_HOME": str(tmp_path / "conan")}
        command = ["conan", *map(str, arguments)]
        process = subprocess.run(
            command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        assert process.returncode == 0, process.stdout + process.stderr
        return process.stdout

    run("profile", "detect")
    return run


def include_folder(target, configure, folder):
    """Return the folder of the headers of a CMake target, as CMake finds it on this machine."""
    folder.mkdir()
    find_eigen = (ROOT / "cmake" / "FindEigenAnyway.cmake").as_posix()
    (folder / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.21)\nproject(finder LANGUAGES CXX)\n"
        f"include({find_eigen})\nfind_package(nlohmann_json REQUIRED)\n"
        f"get_target_property(folders {target} INTERFACE_INCLUDE_DIRECTORIES)\n"
        'message(STATUS "folders: ${folders}")\n'
    )
    process = configure(folder, folder / "build")
    assert process.returncode == 0, process.stdout + process.stderr
    return re.search(r"folders: ([^;\n]+)", process.stdout)[1]


def test_the_cpp_example_builds_with_conan(conan, cmake, configure, tmp_path):
    for name, version, target in (
        ("eigen", "3.4.0", "Eigen3::Eigen"),
        ("nlohmann_json", "3.11.3", "nlohmann_json::nlohmann_json"),
    ):
        values = {"name": name, "version": version, "target": target, "file": target.split(":")[0]}
        include = include_folder(target, configure, tmp_path / name)
        recipe = tmp_path / f"{name}.py"
        recipe.write_text(LOCAL_PACKAGE.format(**values, include=include))
        conan("create", recipe)
    standard = ("-s:a", "compiler.cppstd=20")
    conan("create", ROOT, *standard)
    version = re.search(r"project\(sdnn VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    build = tmp_path / "build"
    generators = ("-g", "CMakeDeps", "-g", "CMakeToolchain", "--output-folder", build)
    conan("install", f"--requires=sdnn/{version}", *generators, *standard)
    quick = ("-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS=-O0")
    toolchain = f"-DCMAKE_TOOLCHAIN_FILE={build}/conan_toolchain.cmake"
    process = configure(EXAMPLE, build / "cmake", toolchain, *quick)
    assert process.returncode == 0, process.stdout + process.stderr
    process = cmake("--build", build / "cmake", "--target", "regression")
    assert process.returncode == 0, process.stdout + process.stderr


def test_the_conan_recipe_refuses_cpp_17(conan):
    with pytest.raises(AssertionError, match="cppstd"):
        conan("create", ROOT, "-s:a", "compiler.cppstd=17")


def test_the_vcpkg_port_has_the_version_and_dependencies():
    port = ROOT / "cmake" / "vcpkg" / "sdnn"
    manifest = json.loads((port / "vcpkg.json").read_text())
    assert f"VERSION {manifest['version']} " in (ROOT / "CMakeLists.txt").read_text()
    names = {dependency for dependency in manifest["dependencies"] if isinstance(dependency, str)}
    assert names == {"eigen3", "nlohmann-json"}
    assert (port / "../../..").resolve() == ROOT.resolve()  # where the port looks for it
