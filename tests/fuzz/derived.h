// What of a snapshot can be seen, aspect by aspect, as numbers to be compared: by definition, with
// none of the code that decides which aspects an edit changes (scene/model/aspects.c).

#ifndef BD_TESTS_FUZZ_DERIVED_H
#define BD_TESTS_FUZZ_DERIVED_H

#include "scene/model/scene.h"

struct derived {
    uint64_t aspects[BD_ASPECT_COUNT];
    uint64_t features;
};

// Of a finished scene.
struct derived derived_of(const struct bd_scene *scene);

// An aspect whose counter `after` has kept from `before` looks the same in both.
void derived_check_aspects(const struct bd_scene *before, const struct bd_scene *after);

// The same scene, finished from nothing, has everything derived as this one has it.
void derived_check_from_scratch(const struct bd_scene *scene);

#endif
