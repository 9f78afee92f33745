// Texts of --help, on standard output. Each returns the exit code 0.

#ifndef BD_CLI_HELP_H
#define BD_CLI_HELP_H

#include <stdbool.h>

int bd_help(void);
int bd_help_render(bool as_json); // as JSON the options of a frame
int bd_help_reference(void);
int bd_help_compare(void);
int bd_help_scenes(void);
int bd_help_edit(void);
int bd_help_ops(bool as_json); // of an edit
int bd_help_watch(void);
int bd_help_replay(void);
int bd_help_devices(void);
int bd_help_techniques(void);

#endif
