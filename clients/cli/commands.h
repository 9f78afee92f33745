// The subcommands. Each takes the words behind its name and returns the process's exit code.

#ifndef BD_CLI_COMMANDS_H
#define BD_CLI_COMMANDS_H

#include <jansson.h>
#include <stdbool.h>

#include "base/err.h"

int bd_cmd_render(const char *const *words, int count);
int bd_cmd_reference(const char *const *words, int count);
int bd_cmd_devices(const char *const *words, int count);
int bd_cmd_techniques(const char *const *words, int count);
int bd_cmd_compare(const char *const *words, int count);
int bd_cmd_scenes(const char *const *words, int count);
int bd_cmd_scene(const char *const *words, int count); // add FILE, rm ID, log ID, ...
int bd_cmd_edit(const char *const *words, int count);
int bd_cmd_watch(const char *const *words, int count);
int bd_cmd_replay(const char *const *words, int count);

int bd_cmd_stability(const char *const *words, int count); // these two do not come back but to fail
int bd_cmd_bench(const char *const *words, int count);

// Says what went wrong: a line on standard error, and with `json` the same as an object on
// standard output. Returns the exit code.
int bd_cmd_fail(enum bd_err err, const struct bd_err_detail *detail, bool json);

// The error in the shape that the daemon's HTTP transport gives errors; NULL without memory.
json_t *bd_cmd_error_json(enum bd_err err, const struct bd_err_detail *detail);

// Puts the scene's file and the place in it before what the importer says, which knows neither
// names nor that nobody else sees `detail->field`: "box.gltf: nodes[3].mesh: is missing". Faults of
// other kinds, and those that name the file already, stay as they are. `scene` may be NULL.
void bd_cmd_name_scene(const char *scene, struct bd_err_detail *detail);

#endif
