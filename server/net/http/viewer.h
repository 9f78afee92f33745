// The viewer's files, embedded in the binary: the page at / and what it loads.
//
// They are clients/web/dist, as its build wrote them; clients/web/embed.py makes the table.
//
// Thread: any; everything here is constant.

#ifndef BD_NET_HTTP_VIEWER_H
#define BD_NET_HTTP_VIEWER_H

#include <stddef.h>
#include <stdint.h>

struct bd_viewer_file {
    const char *path; // as asked for: "/" or "/viewer.js"
    const char *type; // media type
    const char *etag; // with its quotes; of the content
    const uint8_t *bytes;
    size_t size_bytes;
};

extern const struct bd_viewer_file bd_viewer_files[];
extern const uint32_t bd_viewer_file_count;

// NULL if the viewer has no such file.
const struct bd_viewer_file *bd_viewer_find(const char *path);

#endif
