#include "sdnn/core/detail/whole_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <span>
#include <string>

#include "folders.hpp"

namespace sdnn::core {
namespace {

void write(WholeFile& file, const std::string& text) { file.write(std::as_bytes(std::span(text))); }

TEST(WholeFile, IsThereWhenItIsFinished) {
  const testing::Folder folder;
  testing::write_content(folder / "file", "before");
  {
    WholeFile file(folder / "file");
    write(file, "one, ");
    write(file, "");
    write(file, "two");
    EXPECT_EQ(testing::content_of(folder / "file"), "before");
    EXPECT_EQ(folder.n_files(), 2U);
    file.finish();
    EXPECT_EQ(testing::content_of(folder / "file"), "one, two");
  }
  EXPECT_EQ(testing::content_of(folder / "file"), "one, two");
  EXPECT_EQ(folder.n_files(), 1U);
}

TEST(WholeFile, ALinkStaysOne) {
  const testing::Folder folder;
  testing::write_content(folder / "target", "before");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  WholeFile file(folder / "link");
  write(file, "after");
  file.finish();
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(testing::content_of(folder / "target"), "after");
}

TEST(WholeFile, ADeviceIsWrittenTo) {
  const std::filesystem::path device = "/dev/null";
  if (!std::filesystem::exists(device)) GTEST_SKIP() << "needs " << device;
  WholeFile file(device);
  write(file, "anything");
  file.finish();
  EXPECT_TRUE(std::filesystem::is_character_file(device));
}

TEST(WholeFile, LeavesNothingWhereItIsNotFinished) {
  const testing::Folder folder;
  testing::write_content(folder / "file", "before");
  {
    WholeFile file(folder / "file"), other(folder / "file");
    write(file, "half");
    EXPECT_EQ(folder.n_files(), 3U);  // two writers do not share their beginnings
  }
  EXPECT_EQ(testing::content_of(folder / "file"), "before");
  EXPECT_EQ(folder.n_files(), 1U);
}

TEST(WholeFile, SaysWhatCannotBeWritten) {
  const testing::Folder folder;
  const auto missing = folder / "missing";
  const auto path = missing / "file";
  EXPECT_EQ(testing::runtime_error_of([&] { WholeFile file(path); }),
            path.string() + ": cannot be written: No such file or directory");
  std::filesystem::create_directories(missing / "inside");
  EXPECT_EQ(testing::runtime_error_of([&] {
              WholeFile file(missing);
              write(file, "text");
              file.finish();
            }).rfind(missing.string() + ": cannot be written: ", 0),
            0U);
  EXPECT_EQ(folder.n_files(), 1U);
}

}  // namespace
}  // namespace sdnn::core
