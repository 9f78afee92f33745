#include "base/huge_pages.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

#define LARGE_PAGE_BYTES ((size_t)2 << 20)

// Below, rounding up to whole pages would waste too much.
#define WORTHWHILE_BYTES (2 * LARGE_PAGE_BYTES)

void *bd_huge_pages_alloc(size_t bytes)
{
    bool is_large = bytes >= WORTHWHILE_BYTES;
    size_t page = is_large ? LARGE_PAGE_BYTES : BD_CACHE_LINE_BYTES;
    if (bytes > SIZE_MAX - page) return NULL;
    size_t whole = bytes > 0 ? (bytes + page - 1) / page * page : page;
    void *memory = aligned_alloc(page, whole);
    // A wish: refused, the memory works as any other.
    if (memory && is_large) (void)madvise(memory, whole, MADV_HUGEPAGE);
    return memory;
}
