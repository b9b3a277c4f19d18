/* Makes one call fail: a system call about a file in a folder or, with the error ENOMEM, an
   allocation by SQLite or by libstdc++. Preloaded by test_faults.py, so that its functions replace
   those of the C library and call them. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#define MOST_FILES 65536
static char folder[PATH_MAX];
static char is_ours[MOST_FILES]; /* whether a file descriptor is of a file in the folder */
static long n_calls, failing_call;
static int error_number, is_armed;

/* Lets the call with this number, counted from 1, fail with an error of errno.h. */
void fault_arm(const char* path, long number, int error) {
  strncpy(folder, path, sizeof folder - 1);
  memset(is_ours, 0, sizeof is_ours);
  n_calls = 0;
  failing_call = number;
  error_number = error;
  is_armed = 1;
}

/* Returns how many calls were counted since fault_arm. */
long fault_disarm(void) {
  is_armed = 0;
  return n_calls;
}

/* For programs that do not call fault_arm: runs before their main. */
__attribute__((constructor)) static void arm_by_environment(void) {
  const char* number = getenv("FAULT_NUMBER");
  if (number) fault_arm(getenv("FAULT_FOLDER"), atol(number), atoi(getenv("FAULT_ERROR")));
}

/* Counts a system call; returns whether it is the one to fail. */
static int fails(void) {
  if (!is_armed || error_number == ENOMEM || ++n_calls != failing_call) return 0;
  errno = error_number;
  return 1;
}

/* Counts an allocation if its caller is in SQLite or libstdc++; returns whether it is to fail. */
static int fails_to_allocate(void* caller) {
  Dl_info about;
  if (!is_armed || error_number != ENOMEM || !dladdr(caller, &about) || !about.dli_fname) return 0;
  if (!strstr(about.dli_fname, "sqlite3") && !strstr(about.dli_fname, "libstdc++")) return 0;
  if (++n_calls != failing_call) return 0;
  errno = ENOMEM;
  return 1;
}

void* __libc_malloc(size_t n);
void* __libc_realloc(void* old, size_t n);

void* malloc(size_t n) {
  return fails_to_allocate(__builtin_return_address(0)) ? NULL : __libc_malloc(n);
}

void* realloc(void* old, size_t n) {
  return fails_to_allocate(__builtin_return_address(0)) ? NULL : __libc_realloc(old, n);
}

static int is_inside(const char* path) {
  return is_armed && path && strncmp(path, folder, strlen(folder)) == 0;
}

static int is_open(int file) { return is_armed && file >= 0 && file < MOST_FILES && is_ours[file]; }

/* Notes whether a file that was opened is in the folder; returns its descriptor. */
static int noted(int file, const char* path) {
  if (file >= 0 && file < MOST_FILES) is_ours[file] = (char)is_inside(path);
  return file;
}

#define REAL(type, name) ((type)dlsym(RTLD_NEXT, name))

#define OPEN(name)                                                                      \
  int name(const char* path, int flags, ...) {                                          \
    va_list rest;                                                                       \
    va_start(rest, flags);                                                              \
    const mode_t mode = (flags & O_CREAT) ? va_arg(rest, mode_t) : 0;                   \
    va_end(rest);                                                                       \
    if (is_inside(path) && fails()) return -1;                                          \
    return noted(REAL(int (*)(const char*, int, ...), #name)(path, flags, mode), path); \
  }
OPEN(open)
OPEN(open64)

#define ON_FILE(type, name, parameters, arguments)    \
  type name parameters {                              \
    if (is_open(file) && fails()) return -1;          \
    return REAL(type(*) parameters, #name) arguments; \
  }
ON_FILE(ssize_t, write, (int file, const void* from, size_t n), (file, from, n))
ON_FILE(ssize_t, read, (int file, void* into, size_t n), (file, into, n))
ON_FILE(ssize_t, pwrite64, (int file, const void* from, size_t n, off64_t at), (file, from, n, at))
ON_FILE(ssize_t, pread64, (int file, void* into, size_t n, off64_t at), (file, into, n, at))
ON_FILE(int, ftruncate64, (int file, off64_t size), (file, size))
ON_FILE(int, fsync, (int file), (file))
ON_FILE(int, fdatasync, (int file), (file))

int close(int file) { /* closes the file also where it fails, as Linux does */
  const int was_open = is_open(file);
  if (file >= 0 && file < MOST_FILES) is_ours[file] = 0;
  const int result = REAL(int (*)(int), "close")(file);
  return was_open && fails() ? -1 : result;
}

#define ON_PATH(name, parameters, arguments)         \
  int name parameters {                              \
    if (is_inside(path) && fails()) return -1;       \
    return REAL(int(*) parameters, #name) arguments; \
  }
ON_PATH(rename, (const char* path, const char* other), (path, other))
ON_PATH(unlink, (const char* path), (path))
