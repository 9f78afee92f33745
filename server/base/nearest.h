// Which of the names that there are is meant by one that there is not: for a message that refuses
// it. Thread: any.

#ifndef BD_BASE_NEAREST_H
#define BD_BASE_NEAREST_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BD_NEAREST_HINT_BYTES 96

struct bd_nearest {
    const char *word;
    const char *name; // the nearest so far; NULL: none is near
    size_t distance;
};

// `word` is borrowed, and so are the names that are considered.
void bd_nearest_begin(struct bd_nearest *nearest, const char *word);
void bd_nearest_consider(struct bd_nearest *nearest, const char *name);

// "; did you mean \"NAME\"?", or nothing. Returns `out`.
const char *bd_nearest_hint(const struct bd_nearest *nearest, char out[BD_NEAREST_HINT_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
