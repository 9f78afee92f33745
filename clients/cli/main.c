// bounce: the command line client of bounced.

#include <stdio.h>
#include <string.h>

#include "clients/cli/commands.h"
#include "clients/cli/help.h"
#include "clients/cli/interrupt.h"

static const struct {
    const char *name;
    int (*run)(const char *const *words, int count);
} commands[] = {
    {"render", bd_cmd_render},
    {"reference", bd_cmd_reference},
    {"compare", bd_cmd_compare},
    {"devices", bd_cmd_devices},
    {"techniques", bd_cmd_techniques},
    {"scenes", bd_cmd_scenes},
    {"scene", bd_cmd_scene},
    {"edit", bd_cmd_edit},
    {"watch", bd_cmd_watch},
    {"replay", bd_cmd_replay},
    {"stability", bd_cmd_stability},
    {"bench", bd_cmd_bench},
};

#define COMMAND_COUNT (sizeof commands / sizeof commands[0])

static int unknown_command(const char *name)
{
    fprintf(stderr, "bounce: no command %.100s; there are:", name);
    for (size_t i = 0; i < COMMAND_COUNT; i++) fprintf(stderr, " %s", commands[i].name);
    fputs(" (bounce --help)\n", stderr);
    return bd_err_exit_code(BD_ERR_USAGE);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fputs("usage: bounce COMMAND ... (bounce --help)\n", stderr);
        return bd_err_exit_code(BD_ERR_USAGE);
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) return bd_help();
    if (strcmp(argv[1], "--version") == 0) {
        puts("bounce " BD_VERSION);
        return 0;
    }
    bd_interrupt_setup();
    for (size_t i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(commands[i].name, argv[1]) == 0)
            return commands[i].run((const char *const *)argv + 2, argc - 2);
    return unknown_command(argv[1]);
}
