// What the stages of both sides are made of: keys, and how a pass is run or taken over.
//
// Private to stages*.c. Keys take fields one by one: structs have padding, and padding has no
// value.

#ifndef BD_FRAME_STAGE_PARTS_H
#define BD_FRAME_STAGE_PARTS_H

#include "frame/stages.h"

uint64_t bd_stage_key_dvec3(uint64_t key, bd_dvec3 v);
// Where triangles are and which are there: what every raster pass reads.
uint64_t bd_stage_key_geometry(uint64_t key, const struct bd_scene *scene);
uint64_t bd_stage_key_light_power(uint64_t key, const struct bd_light_setup *setup,
                                  const struct bd_render_space *space);
uint64_t bd_stage_key_settings(uint64_t key, const struct bd_discontinuity_settings *settings);

// Brackets a pass, in the report and for the clock.
void bd_stage_begin(struct bd_frame *frame, const char *name);
enum bd_err bd_stage_end(struct bd_frame *frame, enum bd_err err);
// Whether the memo has the key's output, and may be asked.
bool bd_stage_take_over(struct bd_frame *frame, uint64_t key, void **output);
// The same, said in the report.
bool bd_stage_reuse(struct bd_frame *frame, const char *name, uint64_t key, void **output);

#endif
