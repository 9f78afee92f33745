// The list of devices, for `bounced --list-devices` and for clients.

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

struct listed {
    bool works;
    struct bd_err_detail detail;
    struct bd_gpu_caps caps;
    struct bd_identity identity;
};

static void look_at(const struct bd_egl_candidate *candidate, struct listed *out)
{
    struct bd_egl egl;
    *out = (struct listed){0};
    out->works = bd_egl_open(candidate, false, &egl, &out->detail) == BD_ERR_OK;
    if (!out->works) return;
    bd_read_caps(&out->caps);
    bd_identify(candidate, &out->identity);
    bd_egl_close(&egl);
}

static void set_if(json_t *object, const char *key, const char *text)
{
    if (text[0]) json_object_set_new(object, key, json_string(text));
}

static json_t *as_json(uint32_t index, const struct listed *device)
{
    json_t *object = json_pack("{so}", "device", json_sprintf("egl:%u", index));
    BD_ASSERT(object);
    if (!device->works) {
        set_if(object, "error", device->detail.message);
        return object;
    }
    set_if(object, "name", device->caps.name);
    set_if(object, "class", device->caps.device_class);
    json_object_set_new(object, "software", json_boolean(device->caps.software));
    set_if(object, "uuid", device->identity.uuid);
    set_if(object, "pci", device->identity.pci);
    if (device->caps.memory_bytes)
        json_object_set_new(object, "memory_mib",
                            json_integer((json_int_t)(device->caps.memory_bytes >> 20)));
    return object;
}

static void print_line(FILE *out, uint32_t index, const struct listed *device)
{
    fprintf(out, "egl:%u  ", index);
    if (!device->works) {
        fprintf(out, "does not work: %s\n", device->detail.message);
        return;
    }
    fprintf(out, "%s  class %s  %s", device->caps.name, device->caps.device_class,
            device->caps.software ? "software" : "hardware");
    if (device->identity.uuid[0]) fprintf(out, "  uuid:%s", device->identity.uuid);
    if (device->identity.pci[0]) fprintf(out, "  pci:%s", device->identity.pci);
    if (device->caps.memory_bytes)
        fprintf(out, "  %u MiB", (unsigned)(device->caps.memory_bytes >> 20));
    fputc('\n', out);
}

static char *list_text(const struct listed *devices, uint32_t count,
                       const struct bd_err_detail *detail)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    BD_ASSERT(out);
    if (count == 0) fprintf(out, "no device: %s\n", detail->message);
    for (uint32_t i = 0; i < count; i++) print_line(out, i, &devices[i]);
    fclose(out);
    return text;
}

static char *list_json(const struct listed *devices, uint32_t count)
{
    json_t *array = json_array();
    BD_ASSERT(array);
    for (uint32_t i = 0; i < count; i++) json_array_append_new(array, as_json(i, &devices[i]));
    char *text = json_dumps(array, JSON_INDENT(2));
    json_decref(array);
    return text;
}

// The caller's thread may have a context of its own, which is put back.
struct current {
    EGLDisplay display;
    EGLContext context;
};

static struct current save_current(void)
{
    return (struct current){eglGetCurrentDisplay(), eglGetCurrentContext()};
}

static void restore_current(const struct current *saved)
{
    if (saved->context)
        eglMakeCurrent(saved->display, EGL_NO_SURFACE, EGL_NO_SURFACE, saved->context);
}

char *bd_gpu_list_devices(bool json)
{
    struct bd_egl_candidate candidates[BD_EGL_CANDIDATE_MAX];
    struct listed devices[BD_EGL_CANDIDATE_MAX];
    struct bd_err_detail detail = {0};
    uint32_t count = bd_egl_candidates(candidates, &detail);
    if (count > 0) {
        struct current saved = save_current();
        for (uint32_t i = 0; i < count; i++) look_at(&candidates[i], &devices[i]);
        restore_current(&saved);
    }
    return json ? list_json(devices, count) : list_text(devices, count, &detail);
}
