// What a device is called by others: its UUID and its place on the PCI bus.

#include <ctype.h>
#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "gpu/gpu_internal.h"

// The hexadecimal digits of "GPU-1b2c..-..", lower case, without prefix and dashes.
static void plain_uuid(const char *text, char out[33])
{
    size_t count = 0;
    if (strncmp(text, "GPU-", 4) == 0) text += 4;
    for (; *text && count < 32; text++)
        if (isxdigit((unsigned char)*text)) out[count++] = (char)tolower((unsigned char)*text);
    out[count] = 0;
}

static void read_uuid(char out[33])
{
    GLubyte bytes[16] = {0};
    if (!epoxy_has_gl_extension("GL_EXT_memory_object")) return;
    glGetUnsignedBytei_vEXT(GL_DEVICE_UUID_EXT, 0, bytes);
    if (bd_gpu_take_error() != GL_NO_ERROR) return;
    for (int i = 0; i < 16; i++) snprintf(out + 2 * i, 3, "%02x", bytes[i]);
}

static bool is_pci_address(const char *text)
{
    unsigned domain, bus, slot, function;
    int length = 0;
    return sscanf(text, "%4x:%2x:%2x.%1x%n", &domain, &bus, &slot, &function, &length) == 4 &&
           text[length] == 0;
}

// /sys/dev/char/226:0/device is a link to the device's folder, named by its address.
static void pci_from_node(const char *node, char out[16])
{
    struct stat info;
    char link[64], path[PATH_MAX];
    if (stat(node, &info) != 0) return;
    snprintf(link, sizeof link, "/sys/dev/char/%u:%u/device", major(info.st_rdev),
             minor(info.st_rdev));
    if (!realpath(link, path)) return;
    const char *name = strrchr(path, '/') + 1;
    if (is_pci_address(name)) snprintf(out, 16, "%.15s", name);
}

static bool file_names_uuid(const char *path, const char *uuid)
{
    FILE *file = fopen(path, "r");
    if (!file) return false;
    char line[256];
    bool found = false;
    while (!found && fgets(line, sizeof line, file)) {
        char plain[33] = "";
        const char *value = strstr(line, "GPU-");
        if (value) plain_uuid(value, plain);
        found = value && strcmp(plain, uuid) == 0;
    }
    fclose(file);
    return found;
}

// Containers often have NVIDIA's own nodes and no DRM node; its driver lists the addresses too.
static void pci_from_nvidia(const char *uuid, char out[16])
{
    static const char folder[] = "/proc/driver/nvidia/gpus";
    DIR *directory = uuid[0] ? opendir(folder) : NULL;
    if (!directory) return;
    for (const struct dirent *entry; (entry = readdir(directory));) {
        char path[PATH_MAX];
        snprintf(path, sizeof path, "%s/%s/information", folder, entry->d_name);
        if (is_pci_address(entry->d_name) && file_names_uuid(path, uuid))
            snprintf(out, 16, "%.15s", entry->d_name);
    }
    closedir(directory);
}

void bd_identify(const struct bd_egl_candidate *candidate, struct bd_identity *out)
{
    *out = (struct bd_identity){0};
    read_uuid(out->uuid);
    const char *extensions =
        candidate->device ? eglQueryDeviceStringEXT(candidate->device, EGL_EXTENSIONS) : NULL;
    if (extensions && strstr(extensions, "EGL_EXT_device_drm")) {
        const char *node = eglQueryDeviceStringEXT(candidate->device, EGL_DRM_DEVICE_FILE_EXT);
        if (node) pci_from_node(node, out->pci);
    }
    if (!out->pci[0]) pci_from_nvidia(out->uuid, out->pci);
}

bool bd_is_uuid(const struct bd_identity *identity, const char *text)
{
    char plain[33] = "";
    plain_uuid(text, plain);
    return identity->uuid[0] && strcmp(plain, identity->uuid) == 0;
}

bool bd_is_pci(const struct bd_identity *identity, const char *text)
{
    if (!identity->pci[0]) return false;
    return strcasecmp(text, identity->pci) == 0 ||
           (strncmp(identity->pci, "0000:", 5) == 0 && strcasecmp(text, identity->pci + 5) == 0);
}
