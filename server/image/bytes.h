// A growing run of bytes: what encoders write to and files are read into.
//
// Any thread; one owner at a time.

#ifndef BD_IMAGE_BYTES_H
#define BD_IMAGE_BYTES_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct bd_bytes {
    uint8_t *data; // malloc'ed, owned; NULL while empty
    size_t size_bytes;
    size_t capacity_bytes;
};

// Puts `size` bytes at `offset`, growing as needed; a gap before them reads as zero. `source` must
// not lie in `bytes`. BD_ERR_NO_MEMORY leaves what was there untouched.
BD_MUST_CHECK
enum bd_err bd_bytes_put(struct bd_bytes *bytes, size_t offset, const void *source, size_t size);

// Makes `bytes` hold `size` more bytes at `offset`, to be moved apart for an insertion: what was
// at `offset` and after it ends up `size` later, and the hole's content is undefined.
BD_MUST_CHECK
enum bd_err bd_bytes_open_gap(struct bd_bytes *bytes, size_t offset, size_t size);

// Frees and empties.
void bd_bytes_finish(struct bd_bytes *bytes);

#endif
