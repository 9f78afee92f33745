#include "pass/scene_parts.h"

static uint32_t at_most(uint32_t count, double limit)
{
    if (limit < 1) limit = 1;
    return count < limit ? count : (uint32_t)limit;
}

bool bd_scene_part_next(uint32_t triangles_per_instance, uint32_t instance_count,
                        double triangles_max, struct bd_scene_part *part)
{
    part->first_triangle += part->triangle_count;
    if (part->first_triangle == triangles_per_instance) {
        part->first_triangle = 0;
        part->first_instance += part->instance_count;
    }
    const uint32_t instances_left = instance_count - part->first_instance;
    const uint32_t triangles_left = triangles_per_instance - part->first_triangle;
    part->triangle_count = at_most(triangles_left, triangles_max);
    // What is left of one instance goes alone, however many more the limit would allow now: the
    // others begin at their first triangle.
    const bool is_whole = part->triangle_count == triangles_per_instance;
    part->instance_count =
        is_whole ? at_most(instances_left, triangles_max / triangles_per_instance) : 1;
    return instances_left > 0;
}
