"""The Conan recipe of the C++ library, for a clone: ``conan create . --build=missing``."""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.files import copy


class Sdnn(ConanFile):
    """Headers alone, as the CMake targets ``sdnn::sdnn`` and ``sdnn::agent_files``."""

    name = "sdnn"
    description = "Selective desensitization neural networks"
    license = "MIT"
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    exports_sources = "cpp/include/*", "LICENSE"
    no_copy_source = True

    def set_version(self):
        """Take the version of the CMake project."""
        text = Path(self.recipe_folder, "CMakeLists.txt").read_text(encoding="utf-8")
        self.version = re.search(r"project\(sdnn VERSION ([\d.]+)", text)[1]

    def requirements(self):
        """Require what the headers include."""
        self.requires("eigen/[>=3.4 <6]", transitive_headers=True)
        self.requires("nlohmann_json/[>=3.9 <4]", transitive_headers=True)

    def validate(self):
        """Refuse older standards than C++20."""
        check_min_cppstd(self, 20)

    def package_id(self):
        """One package serves all compilers."""
        self.info.clear()

    def package(self):
        """Copy the headers."""
        copy(self, "LICENSE", self.source_folder, str(Path(self.package_folder, "licenses")))
        headers = Path(self.source_folder, "cpp", "include")
        copy(self, "*", str(headers), str(Path(self.package_folder, "include")))

    def package_info(self):
        """Name the targets; contracted multiply-adds would give other bits."""
        core, files = self.cpp_info.components["sdnn"], self.cpp_info.components["agent_files"]
        core.set_property("cmake_target_name", "sdnn::sdnn")
        core.requires = ["eigen::eigen"]
        core.defines = ["SDNN_NO_CONTRACTION"]
        is_msvc = self.settings.get_safe("compiler") == "msvc"
        core.cxxflags = ["/fp:precise" if is_msvc else "-ffp-contract=off"]
        files.set_property("cmake_target_name", "sdnn::agent_files")
        files.requires = ["sdnn", "nlohmann_json::nlohmann_json"]
        for component in (core, files):
            component.bindirs = component.libdirs = []
