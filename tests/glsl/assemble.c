// assemble software|hardware FILE [NAME=VALUE]...
//
// Prints the text that the driver is given for a shader file on stdout, and the names of the files
// that it was made of, one a line, on stderr.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gpu/source.h"

static bool parse_define(char *argument, struct bd_defines *defines)
{
    char *equals = strchr(argument, '=');
    if (!equals) return false;
    *equals = 0;
    bd_define(defines, argument, (int32_t)strtol(equals + 1, NULL, 10));
    return true;
}

int main(int argc, char **argv)
{
    struct bd_defines defines = {0};
    bool usable = argc >= 3;
    for (int i = 3; i < argc && usable; i++) usable = parse_define(argv[i], &defines);
    if (!usable) {
        fputs("usage: assemble software|hardware FILE [NAME=VALUE]...\n", stderr);
        return 2;
    }
    struct bd_source source;
    struct bd_err_detail detail = {0};
    if (bd_source_assemble(argv[2], &defines, strcmp(argv[1], "software") == 0, &source, &detail)) {
        fprintf(stderr, "%s\n", detail.message);
        return 1;
    }
    fputs(source.text, stdout);
    for (uint32_t i = 0; i < source.file_count; i++) fprintf(stderr, "%s\n", source.files[i]);
    bd_source_finish(&source);
    return 0;
}
