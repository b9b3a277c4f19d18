/// Files that are written whole or not at all, even by killed processes, and read if regular.
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>

#include "sdnn/core/errors.hpp"

#if defined(__unix__) || defined(__APPLE__)
#define SDNN_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#define SDNN_HAS_POSIX_FILES 0
#include <fstream>
#include <utility>
#endif

namespace sdnn::core {

/// A file that is written under a temporary name in the same folder and renamed at the end. A link
/// or a pipe of its name is replaced, and its target stays as it was. Devices such as /dev/stdout
/// are written to.
///
/// `write` may be called many times; `finish` renames the file. Without it, or after an error, an
/// earlier file stays, and no temporary file remains. Throws std::runtime_error naming the file and
/// the system's error. On POSIX systems content and name are on the disk when `finish` returns.
class WholeFile {
 public:
  /// Opens a new temporary file beside `path`, or `path` itself in /dev or of an open descriptor.
  explicit WholeFile(const std::filesystem::path& path)
      : path_(path), partial_(path), is_special_(is_special(path)) {
    if (!is_special_) partial_ += partial_suffix();
#if SDNN_HAS_POSIX_FILES
    const int how = is_special_ ? O_TRUNC : O_CREAT | O_EXCL | O_NOFOLLOW;
    file_ = ::open(partial_.c_str(), O_WRONLY | O_CLOEXEC | how, 0666);
    if (file_ < 0) fail();
    // Python removes temporary files without a lock: those of killed processes.
    if (!is_special_) (void)::flock(file_, LOCK_EX | LOCK_NB);
#else
    file_.open(partial_, std::ios::binary | std::ios::trunc);
    if (!file_) fail();
#endif
    is_under_way_ = !is_special_;
  }
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;
  ~WholeFile() {
    close();
    if (!is_under_way_) return;
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }

  void write(std::span<const std::byte> bytes) {
#if SDNN_HAS_POSIX_FILES
    while (!bytes.empty()) {
      const auto n = ::write(file_, bytes.data(), bytes.size());
      if (n < 0) {
        if (errno == EINTR) continue;
        fail();
      }
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
#else
    file_.write(reinterpret_cast<const char*>(bytes.data()),
                static_cast<std::streamsize>(bytes.size()));
    if (!file_) fail();
#endif
  }

  /// Completes the file: its data reach the disk before it takes the place of an older one.
  void finish() {
#if SDNN_HAS_POSIX_FILES
    if (!is_special_ && ::fsync(file_) != 0) fail();
    if (!is_special_) rename();  // while it is locked, so that nobody removes it before
    if (!close()) fail();
    if (is_special_) return;
    const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return;  // the folder cannot be synchronized without rights to read it
    (void)::fsync(descriptor);
    (void)::close(descriptor);
#else
    file_.flush();
    if (!file_ || !close()) fail();
    if (!is_special_) rename();
#endif
  }

 private:
  /// Whether the path names a device, which a file cannot replace.
  static bool is_special(const std::filesystem::path& path) {
    std::error_code ignored;
    const auto folder = std::filesystem::absolute(path, ignored).lexically_normal().parent_path();
    return folder == "/dev" || folder == "/dev/fd" || folder == "/proc/self/fd";
  }

  /// Returns a random suffix: writers have different temporary files, of unpredictable names.
  static std::string partial_suffix() {
    std::random_device random;
    std::string suffix = ".";
    for (int digit = 0; digit < 16; ++digit) suffix += "0123456789abcdef"[random() % 16];
    return suffix += ".partial";
  }

  /// Gives the temporary file its final name, which replaces an older file at once.
  void rename() {
    std::error_code error;
    std::filesystem::rename(partial_, path_, error);
    if (error) {
      errno = error.value();
      fail();
    }
    is_under_way_ = false;
  }

  /// Throws an error that names the file and the system's error number, errno.
  [[noreturn]] void fail() const {
    core::fail(std::runtime_error(
        path_.string() + ": cannot be written: " + std::generic_category().message(errno)));
  }

  /// Closes the file; returns whether all data could be written.
  bool close() noexcept {
#if SDNN_HAS_POSIX_FILES
    const int descriptor = file_;
    file_ = -1;
    return descriptor < 0 || ::close(descriptor) == 0;
#else
    if (file_.is_open()) file_.close();
    return static_cast<bool>(file_);
#endif
  }

  std::filesystem::path path_;
  std::filesystem::path partial_;  ///< the name while the file is written
  bool is_special_;                ///< whether it is a device, which is written to directly
  bool is_under_way_ = false;      ///< whether the destructor has a temporary file to remove
#if SDNN_HAS_POSIX_FILES
  int file_ = -1;
#else
  std::ofstream file_;
#endif
};

/// A regular file, open for reading. Folders, devices and pipes are refused at once. Every function
/// throws std::runtime_error naming the problem, but not the file.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path) {
#if SDNN_HAS_POSIX_FILES
    // O_NONBLOCK: the file may be a pipe, whose opening would wait for a writer.
    file_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) refuse(std::generic_category().message(errno));
    struct stat status{};
    if (::fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
      (void)::close(file_);
      refuse("is not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
#else
    if (!std::filesystem::exists(path)) refuse("is not there");
    if (!std::filesystem::is_regular_file(path)) refuse("is not a regular file");
    size_ = std::filesystem::file_size(path);
    file_.open(path, std::ios::binary);
    if (!file_) refuse("cannot be read");
#endif
  }
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;
#if SDNN_HAS_POSIX_FILES
  ~RegularFile() { (void)::close(file_); }
#endif

  std::uint64_t size() const noexcept { return size_; }

  /// Fills `into` with the bytes from number `begin` on.
  void read(std::uint64_t begin, std::span<std::byte> into) {
#if SDNN_HAS_POSIX_FILES
    while (!into.empty()) {
      // NOLINTNEXTLINE(misc-include-cleaner): off_t is in <unistd.h>
      const auto n = ::pread(file_, into.data(), into.size(), static_cast<off_t>(begin));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) refuse("cannot be read to its end");
      into = into.subspan(static_cast<std::size_t>(n));
      begin += static_cast<std::uint64_t>(n);
    }
#else
    file_.seekg(static_cast<std::streamoff>(begin));
    file_.read(reinterpret_cast<char*>(into.data()), static_cast<std::streamsize>(into.size()));
    if (!file_) refuse("cannot be read to its end");
#endif
  }

 private:
  [[noreturn]] static void refuse(const std::string& what) { core::fail(std::runtime_error(what)); }

  std::uint64_t size_ = 0;
#if SDNN_HAS_POSIX_FILES
  int file_ = -1;
#else
  std::ifstream file_;
#endif
};

}  // namespace sdnn::core
