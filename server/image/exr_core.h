// Private to exr_read.c and exr_write.c: OpenEXR's core says why by a callback, once; this keeps
// it.

#ifndef BD_IMAGE_EXR_CORE_H
#define BD_IMAGE_EXR_CORE_H

#include <openexr.h>

struct bd_exr_complaint {
    char message[256]; // the core's first; "" if it said nothing
};

// Keeps what the core says on this thread from now on; NULL: nobody listens. The context's user data
// would be the place, but the core complains with its own lock held (of exr_add_channel, 3.1.5), and
// asking it for them then waits forever.
void bd_exr_listen(struct bd_exr_complaint *complaint);
void bd_exr_keep_complaint(exr_const_context_t context, exr_result_t code, const char *message);
// The complaint, or the core's text for `code`.
const char *bd_exr_why(const struct bd_exr_complaint *complaint, exr_result_t code);

#endif
