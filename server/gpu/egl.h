// EGL: which devices there are, and a context on one of them. No window, no surface.
//
// Displays are never terminated: EGL hands out one EGLDisplay a device and process, and
// eglTerminate would end it under the contexts of other threads too. Initialising one twice does
// nothing.

#ifndef BD_GPU_EGL_H
#define BD_GPU_EGL_H

#include <epoxy/egl.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

#define BD_EGL_CANDIDATE_MAX 32

// A way to a context. In the order in which EGL lists its devices, then the surfaceless platform,
// which lets Mesa choose.
struct bd_egl_candidate {
    EGLDeviceEXT device; // NULL: the surfaceless platform
    bool software;       // as far as EGL says, before a context is made
};

struct bd_egl {
    EGLDisplay display;
    EGLContext context;
};

// Finds libEGL and what it offers. Returns the count; 0, with an error, where there is none.
uint32_t bd_egl_candidates(struct bd_egl_candidate out[BD_EGL_CANDIDATE_MAX],
                           struct bd_err_detail *detail);

// Makes an OpenGL 4.5 core context and makes it current on this thread; with reset notification
// and robust access where the driver has them.
BD_MUST_CHECK
enum bd_err bd_egl_open(const struct bd_egl_candidate *candidate, bool debug, struct bd_egl *out,
                        struct bd_err_detail *detail);
// Ends the context; takes one that was never opened.
void bd_egl_close(struct bd_egl *egl);

#endif
