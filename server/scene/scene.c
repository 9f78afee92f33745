#include "scene/scene.h"

#include <string.h>

int32_t bd_scene_find_camera(const struct bd_scene *scene, const char *name)
{
    if (!name[0]) return scene->placed_camera_count ? 0 : BD_NONE;
    for (uint32_t i = 0; i < scene->placed_camera_count; i++) {
        const struct bd_placement *placed = &scene->placed_cameras[i];
        if (placed->node != BD_NONE && strcmp(scene->nodes[placed->node].name, name) == 0)
            return (int32_t)i;
    }
    return BD_NONE;
}
