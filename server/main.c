// bounced: options, then the rooms opened in order and closed in reverse.

#include <stdio.h>
#include <string.h>

#include "scene/import.h"

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--version") == 0) {
        puts("bounced " BD_VERSION);
        return 0;
    }
    if (argc == 2 && strcmp(argv[1], "--import") == 0) return bd_import_child_main(argc, argv);
    fputs("usage: bounced [--version]\n", stderr);
    return 2;
}
