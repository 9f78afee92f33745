// The device that `--device` means, opened.

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "gpu/gpu_internal.h"

enum wanted { WANT_ANY, WANT_HARDWARE, WANT_SOFTWARE };

// What was tried and why it would not do, for the warning or the error.
struct tried {
    char text[400];
    size_t used;
};

static void note_tried(struct tried *tried, uint32_t index, const char *why)
{
    if (tried->used + 1 >= sizeof tried->text) return;
    int written = snprintf(tried->text + tried->used, sizeof tried->text - tried->used,
                           "%segl:%u: %s", tried->used ? "; " : "", index, why);
    tried->used += (size_t)written;
}

static bool try_one(const struct bd_egl_candidate *candidate, uint32_t index, enum wanted wanted,
                    bool debug, struct bd_egl *out, struct tried *tried)
{
    struct bd_err_detail detail = {0};
    if (wanted == WANT_HARDWARE && candidate->software) {
        note_tried(tried, index, "a software device");
        return false;
    }
    if (bd_egl_open(candidate, debug, out, &detail)) {
        note_tried(tried, index, detail.message);
        return false;
    }
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    bool software = bd_is_software_renderer(renderer);
    if (wanted == WANT_ANY || software == (wanted == WANT_SOFTWARE)) return true;
    note_tried(tried, index, renderer);
    bd_egl_close(out);
    return false;
}

static bool try_all(const struct bd_egl_candidate *candidates, uint32_t count, enum wanted wanted,
                    bool debug, struct bd_egl *out, struct tried *tried)
{
    for (uint32_t i = 0; i < count; i++)
        if (try_one(&candidates[i], i, wanted, debug, out, tried)) return true;
    return false;
}

// Mesa takes its software driver for hardware that it has no driver for, or may not open; so what
// a candidate is shows only once it is open.
static enum bd_err choose_auto(const struct bd_egl_candidate *candidates, uint32_t count,
                               bool debug, struct bd_egl *out, struct bd_err_detail *detail)
{
    struct tried hardware = {0}, software = {0};
    if (try_all(candidates, count, WANT_HARDWARE, debug, out, &hardware)) return BD_ERR_OK;
    if (!try_all(candidates, count, WANT_SOFTWARE, debug, out, &software))
        return bd_err_set(detail, BD_ERR_DEVICE, "device", "no device works: %s", hardware.text);
    // Once a process: a device that was lost is chosen anew.
    static atomic_flag told = ATOMIC_FLAG_INIT;
    if (!atomic_flag_test_and_set(&told))
        bd_log(BD_LOG_WARN, "gpu", "no hardware device works, rendering in software; tried %s",
               hardware.text);
    return BD_ERR_OK;
}

static enum bd_err choose_index(const struct bd_egl_candidate *candidates, uint32_t count,
                                const char *number, bool debug, struct bd_egl *out,
                                struct bd_err_detail *detail)
{
    char *end;
    unsigned long index = strtoul(number, &end, 10);
    if (end == number || *end || index >= count)
        return bd_err_set(detail, BD_ERR_DEVICE, "device",
                          "no device egl:%s; there are %u, from egl:0", number, count);
    return bd_egl_open(&candidates[index], debug, out, detail);
}

// The names are known only once a context is there, so candidates are opened in turn.
static enum bd_err choose_identity(const struct bd_egl_candidate *candidates, uint32_t count,
                                   bool (*matches)(const struct bd_identity *, const char *),
                                   const char *device, bool debug, struct bd_egl *out,
                                   struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < count; i++) {
        struct bd_identity identity;
        if (bd_egl_open(&candidates[i], debug, out, NULL)) continue;
        bd_identify(&candidates[i], &identity);
        if (matches(&identity, strchr(device, ':') + 1)) return BD_ERR_OK;
        bd_egl_close(out);
    }
    return bd_err_set(detail, BD_ERR_DEVICE, "device",
                      "no device %s among %u; --list-devices names them", device, count);
}

enum bd_err bd_choose(const char *device, bool debug, struct bd_egl *out,
                      struct bd_err_detail *detail)
{
    struct bd_egl_candidate candidates[BD_EGL_CANDIDATE_MAX];
    uint32_t count = bd_egl_candidates(candidates, detail);
    if (count == 0) return BD_ERR_DEVICE;
    if (!device || strcmp(device, "auto") == 0)
        return choose_auto(candidates, count, debug, out, detail);
    if (strcmp(device, "software") == 0) {
        struct tried tried = {0};
        if (try_all(candidates, count, WANT_SOFTWARE, debug, out, &tried)) return BD_ERR_OK;
        return bd_err_set(detail, BD_ERR_DEVICE, "device", "no software device: %s", tried.text);
    }
    if (strncmp(device, "egl:", 4) == 0)
        return choose_index(candidates, count, device + 4, debug, out, detail);
    if (strncmp(device, "uuid:", 5) == 0)
        return choose_identity(candidates, count, bd_is_uuid, device, debug, out, detail);
    if (strncmp(device, "pci:", 4) == 0)
        return choose_identity(candidates, count, bd_is_pci, device, debug, out, detail);
    return bd_err_set(detail, BD_ERR_USAGE, "device",
                      "device \"%s\" is none of auto, software, egl:N, uuid:HEX, pci:ID", device);
}
