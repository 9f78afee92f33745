// Shader sources: the files embedded in the binary, and the text that the compiler is given.
// Knows no GL, so that tests can print what the driver would see. Any thread.

#ifndef BD_GPU_SOURCE_H
#define BD_GPU_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "gpu/gpu.h"

struct bd_shader_file {
    const char *name; // "common/array.glsl"
    const char *text;
};

// Made by shaders/embed.py; sorted by name.
extern const struct bd_shader_file bd_shader_files[];
extern const uint32_t bd_shader_file_count;

#define BD_SOURCE_FILE_MAX 64

struct bd_source {
    char *text;                            // owned
    const char *files[BD_SOURCE_FILE_MAX]; // `#line LINE INDEX` counts these
    uint32_t file_count;
};

// The file with its version, defines and includes. A file is included once, wherever its first
// `#include` stands, a condition around it or not. BD_ERR_INTERNAL, with file and line, if a
// file is missing: sources are ours.
BD_MUST_CHECK
enum bd_err bd_source_assemble(const char *name, const struct bd_defines *defines, bool software,
                               struct bd_source *out, struct bd_err_detail *detail);
void bd_source_finish(struct bd_source *source);

// Copies a compiler's log with the numbers of files, "3:17" or "3(17)" at the start of a line,
// replaced by their names.
void bd_source_name_files(const struct bd_source *source, const char *log, char *out,
                          size_t out_size);

#endif
