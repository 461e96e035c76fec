// What a program does with memory that is freed.
#pragma once

#include <cstdlib>  // tells of __GLIBC__

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace lamina {

/// Freed memory stays with the process, to be used again: solvers take and free the same buffers in
/// every iteration, and glibc hands large ones back each time, so that the kernel clears them anew
/// page by page. For main(), before anything large is allocated. Nothing where the C library is
/// another. Man page mallopt(3).
inline void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kLargest = 32 << 20;  // bytes, the most that glibc of 64 bits takes
  constexpr int kAll = 2147483647;
  if (mallopt(M_MMAP_THRESHOLD, kLargest) == 1) mallopt(M_TRIM_THRESHOLD, kAll);
#endif
}

}  // namespace lamina
