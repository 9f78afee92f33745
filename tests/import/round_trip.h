// A scene through a .glb and back, twice, in this process: what came of it, as JSON.

#ifndef BD_TESTS_IMPORT_ROUND_TRIP_H
#define BD_TESTS_IMPORT_ROUND_TRIP_H

#include <jansson.h>

#include "scene/model/scene.h"

// {"notes": [...], "same": the content hash but for flags, "stable": the second export is the first
// one's bytes and says nothing, "flags": of the import that come of the file, "alike": triangles,
// lights and bounds, "bytes": n, "export_ms": x}; or {"fault": "..."}.
json_t *round_trip_json(const struct bd_scene *scene);

#endif
