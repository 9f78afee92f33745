// What a device is called and can do, from the context that is current.

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "gpu/gpu_internal.h"

bool bd_is_software_renderer(const char *renderer)
{
    return strstr(renderer, "llvmpipe") || strstr(renderer, "softpipe") || strstr(renderer, "SWR");
}

// Lower-case words joined by '-', up to the first of `stop`.
static void append_slug(char *out, size_t out_size, const char *text, const char *stop)
{
    size_t used = strlen(out);
    for (; *text && !strchr(stop, *text) && used + 2 < out_size; text++) {
        if (isalnum((unsigned char)*text) || *text == '.')
            out[used++] = (char)tolower((unsigned char)*text);
        else if (used > 0 && out[used - 1] != '-')
            out[used++] = '-';
    }
    while (used > 0 && out[used - 1] == '-') used--;
    out[used] = 0;
}

// Renderer and driver version: what decides the bits of a picture.
static void name_class(char *out, size_t out_size, const char *renderer, const char *version)
{
    int llvm[3] = {0}, bits = 0;
    const char *driver = strchr(version, ' ');
    out[0] = 0;
    if (sscanf(renderer, "llvmpipe (LLVM %d.%d.%d, %d bits)", &llvm[0], &llvm[1], &llvm[2],
               &bits) == 4)
        snprintf(out, out_size, "llvmpipe-%d.%d.%d-%d", llvm[0], llvm[1], llvm[2], bits);
    else
        append_slug(out, out_size, renderer, "(/");
    // "4.5 (Core Profile) Mesa 22.3.6" and "4.5.0 NVIDIA 570.12"
    const char *mesa = strstr(version, "Mesa "), *nvidia = strstr(version, "NVIDIA ");
    const char *words = mesa ? mesa : nvidia ? nvidia + 7 : driver ? driver + 1 : version;
    size_t used = strlen(out);
    if (used + 2 < out_size) memcpy(out + used, "-", 2);
    append_slug(out, out_size, words, "(");
}

// Of the whole device where the driver says it, else what is free now; 0 where it says nothing.
static uint64_t read_memory_bytes(void)
{
    GLint kib[4] = {0};
    if (epoxy_has_gl_extension("GL_NVX_gpu_memory_info"))
        glGetIntegerv(GL_GPU_MEMORY_INFO_DEDICATED_VIDMEM_NVX, kib);
    else if (epoxy_has_gl_extension("GL_ATI_meminfo"))
        glGetIntegerv(GL_TEXTURE_FREE_MEMORY_ATI, kib);
    return (uint64_t)kib[0] * 1024;
}

void bd_read_caps(struct bd_gpu_caps *caps)
{
    *caps = (struct bd_gpu_caps){0};
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    const char *version = (const char *)glGetString(GL_VERSION);
    snprintf(caps->name, sizeof caps->name, "%s", renderer);
    name_class(caps->device_class, sizeof caps->device_class, renderer, version);
    caps->software = bd_is_software_renderer(renderer);
    GLint side = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    GLint64 block = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    caps->texture_side_max_px = (uint32_t)side;
    caps->storage_block_max_bytes = (uint64_t)block;
    GLint texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    caps->array_max_bytes = caps->software ? (uint64_t)texels * 16 : caps->storage_block_max_bytes;
    caps->memory_bytes = caps->software ? 0 : read_memory_bytes();
}
