#include "gpu/egl.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

// Beside the executable, as deploy/bundle lays it out.
static bool load_fallback(const char *name)
{
    char path[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", path, sizeof path - 1);
    if (length <= 0) return false;
    path[length] = 0;
    char *slash = strrchr(path, '/');
    size_t room = sizeof path - (size_t)(slash - path);
    if ((size_t)snprintf(slash, room, "/../lib/fallback/%s", name) >= room) return false;
    return dlopen(path, RTLD_LAZY | RTLD_GLOBAL);
}

// The host's own, which knows its driver, before ours. Once one is loaded, whoever asks for it by
// its name is given that one.
static bool load(const char *name)
{
    return dlopen(name, RTLD_LAZY | RTLD_GLOBAL) || load_fallback(name);
}

// libepoxy ends the process if it finds no library, so look first.
static bool load_libraries(struct bd_err_detail *detail)
{
    if (load("libEGL.so.1") && (load("libOpenGL.so.0") || load("libGL.so.1"))) return true;
    bd_err_set(detail, BD_ERR_DEVICE, "device",
               "no libEGL.so.1 with libOpenGL.so.0 or libGL.so.1 on this machine");
    return false;
}

static bool is_software(EGLDeviceEXT device)
{
    const char *extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    return extensions && strstr(extensions, "EGL_MESA_device_software");
}

uint32_t bd_egl_candidates(struct bd_egl_candidate out[BD_EGL_CANDIDATE_MAX],
                           struct bd_err_detail *detail)
{
    if (!load_libraries(detail)) return 0;
    uint32_t count = 0;
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_query") &&
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
        EGLDeviceEXT devices[BD_EGL_CANDIDATE_MAX - 1];
        EGLint device_count = 0;
        if (!eglQueryDevicesEXT(BD_EGL_CANDIDATE_MAX - 1, devices, &device_count)) device_count = 0;
        for (EGLint i = 0; i < device_count; i++)
            out[count++] = (struct bd_egl_candidate){devices[i], is_software(devices[i])};
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
        out[count++] = (struct bd_egl_candidate){0};
    if (count == 0)
        bd_err_set(detail, BD_ERR_DEVICE, "device",
                   "EGL offers neither devices nor the surfaceless platform");
    return count;
}

static EGLDisplay display_of(const struct bd_egl_candidate *candidate)
{
    if (candidate->device)
        return eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, candidate->device, NULL);
    return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
}

// A context for no surface needs no config; EGL without that extension wants one all the same.
static EGLConfig any_config(EGLDisplay display)
{
    if (epoxy_has_egl_extension(display, "EGL_KHR_no_config_context")) return EGL_NO_CONFIG_KHR;
    static const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                    EGL_NONE};
    EGLConfig config = NULL;
    EGLint count = 0;
    if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) return NULL;
    return config;
}

static EGLContext create_context(EGLDisplay display, bool robust, bool debug)
{
    EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_CONTEXT_OPENGL_DEBUG,
        debug ? EGL_TRUE : EGL_FALSE,
        robust ? EGL_CONTEXT_OPENGL_ROBUST_ACCESS : EGL_NONE,
        EGL_TRUE,
        EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
        EGL_LOSE_CONTEXT_ON_RESET,
        EGL_NONE,
    };
    return eglCreateContext(display, any_config(display), EGL_NO_CONTEXT, attributes);
}

static enum bd_err open_on_display(EGLDisplay display, bool debug, EGLContext *out,
                                   struct bd_err_detail *detail)
{
    if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context"))
        return bd_err_set(detail, BD_ERR_DEVICE, "device", "no contexts without a surface");
    if (!eglBindAPI(EGL_OPENGL_API))
        return bd_err_set(detail, BD_ERR_DEVICE, "device", "EGL without desktop OpenGL");
    EGLContext context = create_context(display, true, debug);
    if (!context) context = create_context(display, false, debug);
    if (!context)
        return bd_err_set(detail, BD_ERR_DEVICE, "device",
                          "no OpenGL 4.5 core context (EGL error 0x%04x)", eglGetError());
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        eglDestroyContext(display, context);
        return bd_err_set(detail, BD_ERR_DEVICE, "device",
                          "the context cannot be made current (EGL error 0x%04x)", eglGetError());
    }
    *out = context;
    return BD_ERR_OK;
}

enum bd_err bd_egl_open(const struct bd_egl_candidate *candidate, bool debug, struct bd_egl *out,
                        struct bd_err_detail *detail)
{
    *out = (struct bd_egl){0};
    EGLDisplay display = display_of(candidate);
    if (!display || !eglInitialize(display, NULL, NULL))
        return bd_err_set(detail, BD_ERR_DEVICE, "device", "EGL does not start on it");
    EGLContext context = EGL_NO_CONTEXT;
    enum bd_err err = open_on_display(display, debug, &context, detail);
    if (err) return err;
    *out = (struct bd_egl){display, context};
    return BD_ERR_OK;
}

void bd_egl_close(struct bd_egl *egl)
{
    if (!egl->context) return;
    if (eglGetCurrentContext() == egl->context)
        eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(egl->display, egl->context);
    *egl = (struct bd_egl){0};
}
