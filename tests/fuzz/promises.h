// What scene/model/delta.h promises of every change, whatever it is.

#ifndef BD_TESTS_FUZZ_PROMISES_H
#define BD_TESTS_FUZZ_PROMISES_H

#include <stdbool.h>

#include "scene/model/delta.h"

// By their hashes.
bool promises_is_same(const struct bd_scene *a, const struct bd_scene *b);

// That `delta` makes `after` of `base`: so do its bytes, and the difference of the two; its inverse
// gives back the base; the result is the same from its flat form and from its index, and, finished
// from nothing, has the same derived; an aspect that kept its counter looks the same.
void promises_check(const struct bd_scene *base, const struct bd_delta *delta,
                    const struct bd_scene *after);

#endif
