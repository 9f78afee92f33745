// The reference as a technique: the whole rendering equation, path-traced on the processor by
// reference/. No part of it runs on the device: sched/ hands such jobs to the reference's own
// threads.
//
// Exact when: `spp` grows. Its error is noise alone, and its files say how much.

#include "technique/technique.h"

static const struct bd_param_default defaults[] = {{BD_PARAM_NOISE_FILTER, 0}};
static const char *const ladder[] = {"spp=4",   "spp=8",   "spp=16",  "spp=32",   "spp=64",
                                     "spp=128", "spp=256", "spp=512", "spp=1024", NULL};

const struct bd_technique bd_technique_reference = {
    .name = "reference",
    .summary = "the whole rendering equation, path-traced on the processor",
    .model = {.indirect_bounces = BD_MODEL_BOUNCES_UNLIMITED,
              .indirect_visibility = true,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .glossy_senders = true,
              .transmission = true,
              .coverage = true},
    .params_read = BD_READS(BD_PARAM_BRDF) | BD_READS(BD_PARAM_MODEL_OF) | BD_READS(BD_PARAM_SPP) |
                   BD_READS(BD_PARAM_FIRST_SAMPLE) | BD_READS(BD_PARAM_BOUNCES) |
                   BD_READS(BD_PARAM_INDIRECT_VISIBILITY) | BD_READS(BD_PARAM_LIGHTS) |
                   BD_READS(BD_PARAM_INDIRECT_LIGHTS) | BD_READS(BD_PARAM_FILTER) |
                   BD_READS(BD_PARAM_ALPHA) | BD_READS(BD_PARAM_CLAMP) |
                   BD_READS(BD_PARAM_SENDERS) | BD_READS(BD_PARAM_TRANSMISSION) |
                   BD_READS(BD_PARAM_LIGHT_VERTICES) | BD_READS(BD_PARAM_LAMP_RADIUS) |
                   BD_READS(BD_PARAM_NOISE_FILTER),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 1e-2},
    .hazard_codes = "",
    .ladder = ladder,
    .is_sampled = true,
    .is_reference = true,
};
