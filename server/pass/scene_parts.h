// The parts that a draw of many instances is recorded in, so that no slice of a pass is longer than
// it may be: some instances whole, or some triangles of one. The limit may be another for each
// part.
//
// Pure arithmetic. Thread: any.

#ifndef BD_PASS_SCENE_PARTS_H
#define BD_PASS_SCENE_PARTS_H

#include <stdbool.h>
#include <stdint.h>

struct bd_scene_part {
    uint32_t first_instance, instance_count; // of the draw's
    uint32_t first_triangle, triangle_count; // of the primitive's, in each of those instances
};

// The part that begins where the last one ended; false after the last. Starts with a zeroed part.
// Of at most `triangles_max` triangles, and of one at least. Every triangle of every instance is in
// exactly one part, in order.
bool bd_scene_part_next(uint32_t triangles_per_instance, uint32_t instance_count,
                        double triangles_max, struct bd_scene_part *part);

#endif
