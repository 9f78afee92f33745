// Memory for large arrays that are read in no order: on large pages where the system has them, so
// that fewer translations of addresses are waited for.
//
// Any thread. The memory is the caller's, for free().

#ifndef BD_BASE_HUGE_PAGES_H
#define BD_BASE_HUGE_PAGES_H

#include <stddef.h>

#define BD_CACHE_LINE_BYTES 64

// Starts on a line of the cache; not set to anything. NULL if there is no memory.
void *bd_huge_pages_alloc(size_t bytes);

#endif
