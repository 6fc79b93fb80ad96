// Loaded before the C library: the n-th operation on files below one folder fails, or the n-th
// allocation of one library; and every operation on files below the folder is written to a log.

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <new>

extern "C" void *__libc_malloc(size_t);
extern "C" void *__libc_calloc(size_t, size_t);
extern "C" void *__libc_realloc(void *, size_t);

namespace {

enum Kind { none, writing, syncing, renaming, creating, allocation, array };

char folder[4096];
size_t folder_size;
std::atomic<int> kind{none};
std::atomic<long> countdown{0}, counted{0}, fired{0};
int log_file = -1;
uintptr_t library_begin, library_end, spared_begin, spared_end;
size_t least_bytes;

template <class Function>
Function next(const char *name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

bool below(const char *path) {
  if (!folder_size || !path) return false;
  char whole[8192];
  if (path[0] != '/') {
    if (!getcwd(whole, 4096)) return false;
    strncat(whole, "/", sizeof whole - strlen(whole) - 1);
    strncat(whole, path, sizeof whole - strlen(whole) - 1);
    path = whole;
  }
  return !strncmp(path, folder, folder_size);
}

// The path of an open file below the folder, or false.
bool place(int file, char *path) {
  if (!folder_size) return false;
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  ssize_t size = readlink(link, path, 4095);
  if (size < 0) return false;
  path[size] = 0;
  return below(path);
}

bool fails(Kind what, bool again = false) {
  if (kind != what) return false;
  if (again && fired) return true;  // memory stays short
  counted++;
  if (--countdown != 0) return false;
  fired = 1;
  return true;
}

void put(const void *data, size_t size) { syscall(SYS_write, log_file, data, size); }

void note(char what, const char *path, const char *other = "", int64_t offset = 0,
          const void *data = nullptr, size_t size = 0) {
  if (log_file < 0) return;
  uint32_t lengths[3] = {(uint32_t)strlen(path), (uint32_t)strlen(other), (uint32_t)size};
  put(&what, 1);
  put(lengths, sizeof lengths);
  put(&offset, sizeof offset);
  put(path, lengths[0]);
  put(other, lengths[1]);
  if (size) put(data, size);
}

const char *whole(const char *path, char *buffer) {
  if (path[0] == '/') return path;
  if (!getcwd(buffer, 4096)) return path;
  strcat(buffer, "/");
  return strncat(buffer, path, 4000);
}

int opened(const char *name, const char *path, int flags, mode_t mode) {
  static auto real = next<int (*)(const char *, int, ...)>("open64");
  (void)name;
  bool own = (flags & (O_CREAT | O_TRUNC)) && below(path), there = own && !access(path, F_OK);
  if (own && !there && fails(creating)) {
    errno = ENOSPC;
    return -1;
  }
  int file = real(path, flags, mode);
  if (own && file >= 0) {
    char buffer[8192];
    if (!there) note('c', whole(path, buffer));
    if (there && (flags & O_TRUNC)) note('t', whole(path, buffer));
  }
  return file;
}

ssize_t written(int file, const void *data, size_t size, int64_t at) {
  static auto real = next<ssize_t (*)(int, const void *, size_t)>("write");
  static auto real_at = next<ssize_t (*)(int, const void *, size_t, off64_t)>("pwrite64");
  char path[4096];
  bool own = place(file, path);
  if (own && fails(writing)) {
    errno = ENOSPC;
    return -1;
  }
  int64_t offset = at;
  if (own && at < 0) {
    struct stat state;
    offset = (fcntl(file, F_GETFL) & O_APPEND) && !fstat(file, &state) ? state.st_size
                                                                       : lseek(file, 0, SEEK_CUR);
  }
  ssize_t done = at < 0 ? real(file, data, size) : real_at(file, data, size, at);
  if (own && done > 0) note('w', path, "", offset, data, done);
  if (file == 1 && done > 0 && folder_size) note('o', "", "", 0, data, done);
  return done;
}

int synchronised(int file, const char *name) {
  char path[4096];
  bool own = place(file, path);
  if (own && fails(syncing)) {
    errno = EIO;
    return -1;
  }
  int done = next<int (*)(int)>(name)(file);
  if (own && !done) note('f', path);
  return done;
}

bool of_library(void *caller) {
  auto at = reinterpret_cast<uintptr_t>(caller);
  return at >= library_begin && at < library_end && !(at >= spared_begin && at < spared_end);
}

bool refused(void *caller, size_t size, Kind what) {
  return kind == what && size >= least_bytes && of_library(caller) && fails(what);
}

}  // namespace

extern "C" {

// Fail the n-th operation of a kind on files below a folder.
void disturb_files(const char *below_this, int what, long n, const char *log) {
  strncpy(folder, below_this, sizeof folder - 1);
  folder_size = strlen(folder);
  counted = fired = 0;
  countdown = n;
  kind = what;
  log_file =
      log[0] ? (int)syscall(SYS_openat, AT_FDCWD, log, O_CREAT | O_WRONLY | O_APPEND, 0644) : -1;
}

// Fail the n-th allocation of at least so many bytes by a library that is loaded; 0: not found.
// Those of one function, `spared` bytes from `at` in the library, are left alone.
int disturb_memory(const char *name, int what, long n, size_t bytes, size_t at, size_t spared) {
  FILE *maps = fopen("/proc/self/maps", "r");
  char line[8192];
  library_begin = library_end = 0;
  while (maps && fgets(line, sizeof line, maps)) {
    uintptr_t from, to;
    if (strstr(line, name) && sscanf(line, "%lx-%lx", &from, &to) == 2) {
      if (!library_begin) library_begin = from;
      library_end = to;
    }
  }
  if (maps) fclose(maps);
  least_bytes = bytes;
  spared_begin = library_begin + at, spared_end = spared_begin + spared;
  counted = fired = 0;
  countdown = n;
  kind = what;
  return library_begin != 0;
}

long disturbed() { return fired; }
long operations() { return counted; }

int open(const char *path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;
  va_end(more);
  return opened("open", path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;
  va_end(more);
  return opened("open64", path, flags, mode);
}

ssize_t write(int file, const void *data, size_t size) { return written(file, data, size, -1); }

ssize_t pwrite(int file, const void *data, size_t size, off_t at) {
  return written(file, data, size, at);
}

ssize_t pwrite64(int file, const void *data, size_t size, off64_t at) {
  return written(file, data, size, at);
}

ssize_t writev(int file, const struct iovec *parts, int count) {
  char path[4096];
  if (!place(file, path)) {
    static auto real = next<ssize_t (*)(int, const struct iovec *, int)>("writev");
    return real(file, parts, count);
  }
  ssize_t all = 0;
  for (int k = 0; k < count; k++) {
    ssize_t done = written(file, parts[k].iov_base, parts[k].iov_len, -1);
    if (done < 0) return all ? all : -1;
    all += done;
    if ((size_t)done < parts[k].iov_len) break;
  }
  return all;
}

int fsync(int file) { return synchronised(file, "fsync"); }
int fdatasync(int file) { return synchronised(file, "fdatasync"); }

int rename(const char *from, const char *to) {
  static auto real = next<int (*)(const char *, const char *)>("rename");
  bool own = below(from) || below(to);
  if (own && fails(renaming)) {
    errno = EIO;
    return -1;
  }
  int done = real(from, to);
  char a[8192], b[8192];
  if (own && !done) note('r', whole(from, a), whole(to, b));
  return done;
}

int mkdir(const char *path, mode_t mode) {
  static auto real = next<int (*)(const char *, mode_t)>("mkdir");
  bool own = below(path);
  if (own && fails(creating)) {
    errno = ENOSPC;
    return -1;
  }
  int done = real(path, mode);
  char a[8192];
  if (own && !done) note('m', whole(path, a));
  return done;
}

int unlink(const char *path) {
  static auto real = next<int (*)(const char *)>("unlink");
  int done = real(path);
  char a[8192];
  if (!done && below(path)) note('u', whole(path, a));
  return done;
}

int rmdir(const char *path) {
  static auto real = next<int (*)(const char *)>("rmdir");
  int done = real(path);
  char a[8192];
  if (!done && below(path)) note('u', whole(path, a));
  return done;
}

int unlinkat(int parent, const char *name, int flags) {
  static auto real = next<int (*)(int, const char *, int)>("unlinkat");
  char path[8192];
  bool own = parent != AT_FDCWD && place(parent, path);
  int done = real(parent, name, flags);
  if (own && !done) {
    strcat(strcat(path, "/"), name);
    note('u', path);
  }
  return done;
}

void *malloc(size_t size) {
  if (refused(__builtin_return_address(0), size, array)) return errno = ENOMEM, nullptr;
  return __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
  if (refused(__builtin_return_address(0), count * size, array)) return errno = ENOMEM, nullptr;
  return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
  if (refused(__builtin_return_address(0), size, array)) return errno = ENOMEM, nullptr;
  return __libc_realloc(old, size);
}

}  // extern "C"

void *operator new(size_t size) {
  if (refused(__builtin_return_address(0), size, allocation)) throw std::bad_alloc();
  if (void *got = __libc_malloc(size ? size : 1)) return got;
  throw std::bad_alloc();
}

void *operator new[](size_t size) {
  if (refused(__builtin_return_address(0), size, allocation)) throw std::bad_alloc();
  if (void *got = __libc_malloc(size ? size : 1)) return got;
  throw std::bad_alloc();
}

void *operator new(size_t size, const std::nothrow_t &) noexcept {
  if (refused(__builtin_return_address(0), size, allocation)) return nullptr;
  return __libc_malloc(size ? size : 1);
}

void *operator new[](size_t size, const std::nothrow_t &) noexcept {
  if (refused(__builtin_return_address(0), size, allocation)) return nullptr;
  return __libc_malloc(size ? size : 1);
}

void *operator new(size_t size, std::align_val_t to) {
  void *got = nullptr;
  if (refused(__builtin_return_address(0), size, allocation) ||
      posix_memalign(&got, (size_t)to, size ? size : 1))
    throw std::bad_alloc();
  return got;
}
