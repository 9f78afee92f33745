// Private to exr_read.c and exr_write.c: OpenEXR's core says why by a callback, once; this keeps
// it.

#ifndef BD_IMAGE_EXR_CORE_H
#define BD_IMAGE_EXR_CORE_H

#include <openexr.h>

// The first member of what a context has as user data.
struct bd_exr_complaint {
    char message[256]; // the core's first; "" if it said nothing
};

void bd_exr_keep_complaint(exr_const_context_t context, exr_result_t code, const char *message);
// The complaint, or the core's text for `code`.
const char *bd_exr_why(const struct bd_exr_complaint *complaint, exr_result_t code);

#endif
