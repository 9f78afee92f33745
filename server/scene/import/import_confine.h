// What the import child may use and do. Private to it and to its test.

#ifndef BD_SCENE_IMPORT_IMPORT_CONFINE_H
#define BD_SCENE_IMPORT_IMPORT_CONFINE_H

#include <stdbool.h>

#include "scene/import/import.h"

// Memory and processor time, no core files, no new descriptors; dies with its parent.
void bd_import_set_limits(const struct bd_import_limits *limits);

// From here on the process, all of its threads, can use memory, read and write what is open, and
// end. False if the kernel would not have it: then nothing may be parsed.
bool bd_import_confine(void);

#endif
