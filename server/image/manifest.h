// What an image says about its own making: pairs of text that every encoder writes along.
//
// EXR: one string attribute a pair. PNG: one text chunk a pair. JPEG: one comment, KEY=VALUE lines.

#ifndef BD_IMAGE_MANIFEST_H
#define BD_IMAGE_MANIFEST_H

#include <stddef.h>

#define BD_MANIFEST_KEY_MAX 31 // bytes; the longest name of an EXR attribute in old readers

// Key: 1 to BD_MANIFEST_KEY_MAX of [A-Za-z0-9_.-]. Value: UTF-8 without a zero byte.
struct bd_manifest_entry {
    const char *key;
    const char *value;
};

struct bd_manifest {
    const struct bd_manifest_entry *entries; // borrowed
    size_t count;
};

#endif
