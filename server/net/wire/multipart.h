// multipart/form-data (RFC 7578) over a whole body in memory: the table of files of a one-shot
// render. Parts are found, not copied.
//
// Thread: any.

#ifndef BD_NET_WIRE_MULTIPART_H
#define BD_NET_WIRE_MULTIPART_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct bd_multipart_part {
    char name[256];
    const void *bytes; // in the body
    size_t size_bytes;
};

// The boundary of a Content-Type header's value. False if it is no multipart/form-data with a
// boundary of 1 to 70 characters.
int bd_multipart_boundary(const char *content_type, char *out, size_t size);

// The caller frees `*parts`. BD_ERR_BAD_INPUT for a body that does not keep to its boundary, a part
// without a name, a name twice; BD_ERR_LIMIT, naming scene_files, for too many parts.
BD_MUST_CHECK
enum bd_err bd_multipart_parse(const void *bytes, size_t size, const char *boundary,
                               uint32_t part_count_max, struct bd_multipart_part **parts,
                               uint32_t *part_count, struct bd_err_detail *detail);

#endif
