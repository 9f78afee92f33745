// Direct light by the processor's loops (pass/native). Private to pass/. Reads the G-buffer, and of
// shadow maps the rows that are looked at, straight from their textures: no receivers are written
// out.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_DIRECT_NATIVE_H
#define BD_PASS_DIRECT_NATIVE_H

#include "pass/direct.h"

// Writes all of what `out` has, as large as the picture. There is a light, and a processor.
BD_MUST_CHECK
enum bd_err bd_direct_native_run(const struct bd_pass_context *context,
                                 const struct bd_direct_inputs *inputs, const struct bd_direct *out,
                                 struct bd_err_detail *detail);

#endif
