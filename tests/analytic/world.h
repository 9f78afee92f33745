// Scenes known on paper, built in code, and a renderer to look at them with.
//
// A world owns a device, a renderer and one scene in the making. Exits with 77, meson's "skipped",
// where there is no EGL.

#ifndef BD_TESTS_ANALYTIC_WORLD_H
#define BD_TESTS_ANALYTIC_WORLD_H

#include "frame/frame.h"
#include "scene/model/scene.h"

struct world {
    struct bd_gpu *gpu;
    struct bd_renderer renderer;
    struct bd_scene *scene;
    bool finished;
    enum bd_fresh fresh;     // of the next render
    struct bd_report report; // of the last one
};

struct world *world_create(void);
void world_destroy(struct world **world);
// The same, before and behind a group of tests whose state the world is.
int world_open(void **state);
int world_close(void **state);
// The same world on a new device, with nothing in the renderer's memo. A world is the only device of
// its thread: GL calls go to the context made last.
void world_reopen_device(struct world *world);
// A new, empty scene on the same device.
void world_clear(struct world *world);

int32_t world_add_material(struct world *world, float albedo);
// Planar quad with corners in counter-clockwise order seen from its front, cut into cells x cells.
int32_t world_add_quad(struct world *world, int32_t material, const double corners[4][3],
                       uint32_t cells);
// Triangles with given positions and unit normals, 3 floats a vertex.
int32_t world_add_mesh(struct world *world, int32_t material, const float *positions,
                       const float *normals, uint32_t vertex_count, const uint32_t *indices,
                       uint32_t index_count);
// Places a mesh so many times more, all in one place.
void world_add_placements(struct world *world, int32_t mesh, uint32_t count);
// The six inward faces of the box [-half, half]^3 about `centre`.
void world_add_box_room(struct world *world, int32_t material, const double centre[3], double half);
// Inward sphere about the origin with 20 * 4^subdivisions triangles and exact normals.
void world_add_sphere_room(struct world *world, int32_t material, double radius,
                           uint32_t subdivisions);

// Intensity in cd, or lux for directional. Direction need not be unit.
int32_t world_add_light(struct world *world, enum bd_light_kind kind, const double position[3],
                        const double direction[3], float intensity);
int32_t world_add_camera(struct world *world, const double position[3], const double target[3],
                         double yfov);
// An orthographic camera a little off the point `at`, looking against `normal`, as wide as
// `width_m`: a one-pixel picture of it sees the surface there.
int32_t world_add_probe(struct world *world, const double at[3], const double normal[3],
                        double width_m);

// What was added is all there is: derives the rest of the scene, once.
void world_finish(struct world *world);
// Renders with `layers` (bits); `settings` is a list of KEY=VALUE ended by NULL, or NULL. Fails
// the test on any error. `camera` is the index among placed cameras.
void world_render(struct world *world, const char *technique, uint32_t camera, uint32_t width_px,
                  uint32_t height_px, uint32_t layers, const char *const *settings,
                  struct bd_image *out[BD_LAYER_COUNT]);
void world_free_layers(struct bd_image *layers[BD_LAYER_COUNT]);

// A frame that stands, freed by the caller.
struct world_picture {
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
};
// Fails the test on any error.
struct world_picture world_picture_of(struct world *world, const struct bd_frame_request *request);
void world_picture_free(struct world_picture *picture);
// Sub-frames that ran a pass of the camera's side.
uint32_t world_times_run(const struct bd_report *report, const char *pass);
// The same layers, byte for byte, of as many rays.
void world_assert_same(const struct world_picture *a, const struct world_picture *b);

// Red of the single pixel of a probe's layer.
float world_probe(struct world *world, const char *technique, uint32_t camera, enum bd_layer layer,
                  const char *const *settings);

// Fails the test, printing both values, if |value / expected - 1| > tolerance.
#define ASSERT_REL(value, expected, tolerance)                                                     \
    assert_relative(__FILE__, __LINE__, #value, (value), (expected), (tolerance))
void assert_relative(const char *file, int line, const char *what, double value, double expected,
                     double tolerance);

#endif
