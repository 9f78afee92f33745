// The flags of a frame's report: what was rendered with less than was asked for, repaired, or not
// known for sure. A flag's text is its name, or the name, a colon and particulars.
//
// One table, from which command lines refuse misspelt names and manuals are made. Whoever flags
// something new adds a row; tests/layers compares the rows with what the rooms write. Any thread.

#ifndef BD_BASE_FLAGS_H
#define BD_BASE_FLAGS_H

#include <stdbool.h>
#include <stdint.h>

//   X(name, fails, what)   `fails`: a picture with it is no success unless somebody says that it is
#define BD_FLAG_MAP(X)                                                                             \
    X(blank_frame, true, "nothing in the picture has any light")                                   \
    X(nonfinite_pixels, false, "pixels that are NaN or infinite")                                  \
    X(nonfinite_samples, false, "samples of the reference that were, and were left out")           \
    X(rays_refused, false, "rays of the reference that were out of range, and met nothing")        \
    X(caustics_left_out, false,                                                                    \
      "caustics of points: the picture is too large for its light paths")                          \
    X(caustics_unseen, false,                                                                      \
      "caustics of points, in mirrors and through glass: no path finds them without lamp_radius")  \
    X(error_floor, false, "the target error is out of the technique's reach")                      \
    X(error_tail, false, "a few pixels carry the error: its upper end is not known")               \
    X(deadline_rung, false, "the deadline passed: the technique's cheapest settings instead")      \
    X(better_failed, false, "better settings failed: those before them")                           \
    X(chosen_by_clock, false, "settings that a budget of time was good for: not the same twice")   \
    X(error_unknown, false, "no pixel is finite, none was checked")                                \
    X(no_indirect_visibility, false, "indirect light goes through walls")                          \
    X(emissive_not_lighting, false, "emissive surfaces are seen and light nothing")                \
    X(environment_not_lighting, false, "the environment lights nothing")                           \
    X(glossy_as_diffuse, false, "glossy surfaces reflect indirect light as diffuse ones")          \
    X(blend_as_mask, false, "partly transparent surfaces are there or not")                        \
    X(transmission_as_opaque, false, "glass is opaque")                                            \
    X(transmission_shadow, false, "light goes straight through glass that would bend it")          \
    X(rsm_size_reduced, false, "maps of lights are smaller than asked for")                        \
    X(ism_size_reduced, false, "imperfect shadow maps are smaller than asked for")                 \
    X(ism_shared, false, "virtual lights share imperfect shadow maps")                             \
    X(photons_lost, false, "photons that met nothing where environment maps stand for the scene")  \
    X(subsplats_limited, false, "glossy light is coarser than asked for")                          \
    X(camera_ambiguous, false, "several cameras have the name that was asked for")                 \
    X(default_camera, false, "the scene has none: one that frames it")                             \
    X(default_lights, false, "the scene has none: a key light and one at the camera")              \
    X(environment_negative, false, "texels of the environment below 0 became 0")                   \
    X(extension_ignored, false, "an extension of glTF that is not supported")                      \
    X(min_version, false, "the file wants a newer glTF")                                           \
    X(buffers_without_data, false, "buffers that nothing fills")                                   \
    X(nonfinite_vertices, false, "triangles with such vertices were left out")                     \
    X(nonfinite_texcoords, false, "texture coordinates that became 0")                             \
    X(degenerate_triangles, false, "triangles without an area were left out")                      \
    X(incomplete_triangles, false, "indices that make no whole triangle were left out")            \
    X(repaired_normals, false, "normals that were made anew")                                      \
    X(normals_against_winding, false, "triangles whose normals point to their rear")               \
    X(shrunk_pictures, false, "pictures were made smaller to fit")                                 \
    X(repaired_tangents, false, "tangents that were made anew")                                    \
    X(repaired_rotations, false, "rotations that were made unit")                                  \
    X(repaired_cameras, false, "cameras whose numbers were out of range")                          \
    X(repaired_lights, false, "lights whose numbers were out of range")                            \
    X(clamped_factors, false, "material factors that were out of range")                           \
    X(non_affine_matrices, false, "matrices whose last row was not 0 0 0 1")                       \
    X(odd_skin_weights, false, "skin weights that do not add up to 1")                             \
    X(skipped_points_or_lines, false, "primitives that are no triangles")                          \
    X(missing_positions, false, "primitives without positions")                                    \
    X(missing_texcoords, false, "textures without coordinates")                                    \
    X(uv_sets_ignored, false, "texture coordinates beyond the second set")                         \
    X(instances_out_of_range, false, "placements of meshes that were left out")                    \
    X(collapsed_instances, false, "placements of meshes that are flat or points")                  \
    X(placements_out_of_range, false, "placements of lights and cameras that were left out")

enum bd_flag {
#define X(name, fails, what) BD_FLAG_##name,
    BD_FLAG_MAP(X)
#undef X
        BD_FLAG_COUNT
};
_Static_assert(BD_FLAG_COUNT <= 64, "sets of flags are bits of a uint64_t");

// NULL for an index out of range.
const char *bd_flag_name(enum bd_flag flag);
const char *bd_flag_what(enum bd_flag flag);
// Those that make a picture no success by themselves, as bits.
uint64_t bd_flags_that_fail(void);
// The flag of that name, `length` bytes, with or without a colon and particulars behind it;
// BD_FLAG_COUNT if there is none.
enum bd_flag bd_flag_of(const char *text, uint32_t length);

#endif
