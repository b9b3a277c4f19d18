#include "sdnn/core/detail/whole_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <span>
#include <string>

#include "folders.hpp"

namespace sdnn::core {
namespace {

void write(WholeFile& file, const std::string& text) { file.write(std::as_bytes(std::span(text))); }

TEST(WholeFile, AppearsWhenItIsFinished) {
  const testing::Folder folder;
  testing::write_content(folder / "file", "before");
  {
    WholeFile file(folder / "file");
    write(file, "one, ");
    write(file, "");
    write(file, "two");
    EXPECT_EQ(testing::content_of(folder / "file"), "before");
    EXPECT_EQ(folder.n_files(), 2U);  // the old file and a temporary one
    file.finish();
    EXPECT_EQ(testing::content_of(folder / "file"), "one, two");
  }
  EXPECT_EQ(testing::content_of(folder / "file"), "one, two");
  EXPECT_EQ(folder.n_files(), 1U);
}

TEST(WholeFile, ReplacesALink) {
  const testing::Folder folder;
  testing::write_content(folder / "target", "before");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  std::filesystem::create_symlink(folder / "nothing", folder / "dangling");
  for (const char* name : {"link", "dangling"}) {
    WholeFile file(folder / name);
    write(file, "after");
    file.finish();
    EXPECT_FALSE(std::filesystem::is_symlink(folder / name));
    EXPECT_EQ(testing::content_of(folder / name), "after");
  }
  EXPECT_EQ(testing::content_of(folder / "target"), "before");
  EXPECT_EQ(folder.n_files(), 3U);  // target, link and dangling
}

TEST(WholeFile, WritesToADevice) {
  const std::filesystem::path device = "/dev/null";
  if (!std::filesystem::exists(device)) GTEST_SKIP() << "needs " << device;
  WholeFile file(device);
  write(file, "anything");
  file.finish();
  EXPECT_TRUE(std::filesystem::is_character_file(device));
}

TEST(WholeFile, LeavesNoFileIfItIsNotFinished) {
  const testing::Folder folder;
  testing::write_content(folder / "file", "before");
  {
    WholeFile file(folder / "file"), other(folder / "file");
    write(file, "half");
    EXPECT_EQ(folder.n_files(), 3U);  // the old file, and a temporary one of each writer
  }
  EXPECT_EQ(testing::content_of(folder / "file"), "before");
  EXPECT_EQ(folder.n_files(), 1U);
}

// A temporary name has 16 random digits.
TEST(WholeFile, HasADifferentTemporaryNameEachTime) {
  const testing::Folder folder;
  std::set<std::string> names;
  for (int i = 0; i < 20; ++i) {
    const WholeFile file(folder / "file");
    for (const auto& entry : std::filesystem::directory_iterator(folder / "")) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(std::regex_match(name, std::regex("file\\.[0-9a-f]{16}\\.partial"))) << name;
      names.insert(name);
    }
  }
  EXPECT_EQ(names.size(), 20U);
}

TEST(RegularFile, IsReadInParts) {
  const testing::Folder folder;
  testing::write_content(folder / "file", "one, two");
  RegularFile file(folder / "file");
  EXPECT_EQ(file.size(), 8U);
  std::string part(3, ' ');
  file.read(5, std::as_writable_bytes(std::span(part)));
  EXPECT_EQ(part, "two");
  file.read(0, std::as_writable_bytes(std::span(part)));
  EXPECT_EQ(part, "one");
  EXPECT_EQ(
      testing::runtime_error_of([&] { file.read(6, std::as_writable_bytes(std::span(part))); }),
      "cannot be read to its end");
}

TEST(RegularFile, RefusesDevicesAndFolders) {
  const testing::Folder folder;
  const auto error_of = [](const std::filesystem::path& path) {
    return testing::runtime_error_of([&] { const RegularFile file(path); });
  };
  EXPECT_EQ(error_of(folder / ""), "is not a regular file");
  EXPECT_EQ(error_of(folder / "nothing"), "No such file or directory");
  if (std::filesystem::exists("/dev/zero")) {
    EXPECT_EQ(error_of("/dev/zero"), "is not a regular file");
  }
#if SDNN_HAS_POSIX_FILES
  const auto pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of(pipe), "is not a regular file");  // does not wait for a writer of the pipe
  {
    WholeFile file(pipe);  // does not wait for a reader of the pipe
    write(file, "text");
    file.finish();
  }
  EXPECT_EQ(testing::content_of(pipe), "text");
#endif
}

}  // namespace
}  // namespace sdnn::core
