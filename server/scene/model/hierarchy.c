// Parents of nodes: that there is no loop.

#include <stdlib.h>

#include "scene/model/scene.h"

// Walks up from every node and marks the way with the walk's own number: a walk that meets its own
// number found a loop, one that meets an older number may stop.
bool bd_scene_parents_are_a_forest(const struct bd_scene *scene, uint32_t *looping_node)
{
    uint32_t *walk = calloc(scene->node_count ? scene->node_count : 1, sizeof *walk);
    if (!walk) return false;
    bool ok = true;
    for (uint32_t i = 0; ok && i < scene->node_count; i++) {
        int32_t n = (int32_t)i;
        while (n != BD_NONE && walk[n] == 0) {
            walk[n] = i + 1;
            n = scene->nodes[n].parent;
        }
        ok = n == BD_NONE || walk[n] != i + 1;
        if (!ok && looping_node) *looping_node = i;
    }
    free(walk);
    return ok;
}
