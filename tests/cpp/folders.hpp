/// Files of tests.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

#include "errors.hpp"

namespace sdnn::testing {

/// A folder of this test alone, also where another build's tests run beside it; gone in the end.
class Folder {
 public:
  Folder() {
    std::random_device number;
    do {
      path_ = std::filesystem::path(::testing::TempDir()) / (std::to_string(number()) + "-sdnn");
    } while (!std::filesystem::create_directory(path_));
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::size_t n_files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_content(const std::filesystem::path& path, const std::string& content) {
  std::filesystem::remove(path);  // some file systems flush what is cut and written anew
  std::ofstream(path, std::ios::binary) << content;
}

/// The message of the std::runtime_error that `call` throws, or "no error".
template <class Call>
std::string runtime_error_of(const Call& call) {
  return message_of<std::runtime_error>(call);
}

}  // namespace sdnn::testing
