// A scene from a .glb for the programs of tests/: one file, no separate buffers or pictures.

#ifndef BD_TESTS_TOOLS_LOAD_SCENE_H
#define BD_TESTS_TOOLS_LOAD_SCENE_H

#include "scene/model/scene.h"

// Read here and now, without a process to confine the parser.
BD_MUST_CHECK
enum bd_err load_scene(const char *path, struct bd_scene **out, struct bd_err_detail *detail);
// As the daemon does it, in the import child of the executable that $BOUNCED names.
BD_MUST_CHECK
enum bd_err import_scene(const char *path, struct bd_scene **out, struct bd_err_detail *detail);

#endif
