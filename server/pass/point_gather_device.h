// What point_gather does, by the device: a work group a receiver
// (shaders/pass/point_gather/point_gather.comp). Cuts are the processor's, a batch of sets at a
// time, and its threads'. As the processor's loops, but for rounding: where that draws another
// point, light differs by as much as by another seed's.
//
// Private to pass/. Memory: the points with their radiance, 44 bytes each; 4 MiB of cuts.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_POINT_GATHER_DEVICE_H
#define BD_PASS_POINT_GATHER_DEVICE_H

#include "lights/microbuffer.h"
#include "pass/point_gather.h"
#include "pass/receiver_sets.h"

struct bd_point_gather_device;

// Not as printed. `map` is the inputs' own, read until the end of this.
BD_MUST_CHECK
enum bd_err bd_point_gather_device_begin(const struct bd_pass_context *context,
                                         const struct bd_point_gather_inputs *inputs,
                                         const struct bd_microbuffer *map, bool spread,
                                         struct bd_point_gather_device **out,
                                         struct bd_err_detail *detail);
void bd_point_gather_device_end(struct bd_point_gather_device **device);

// Adds its receivers' light to the part. `chosen`: as of struct bd_map_rays, where rays are asked
// for; else NULL.
BD_MUST_CHECK
enum bd_err bd_point_gather_device_light(struct bd_point_gather_device *device,
                                         const struct bd_receiver_part *part,
                                         const struct bd_receiver_sets *sets,
                                         struct bd_map_ray *chosen);

#endif
