#include "scene/model/flat.h"

#include "base/assert.h"
#include "base/hash.h"
#include "scene/model/derive.h"
#include "scene/model/flat_io.h"

static const char whole_magic[8] = {'B', 'D', 'F', 'L', 'A', 'T', '0', '3'};
static const char index_magic[8] = {'B', 'D', 'I', 'N', 'D', 'X', '0', '1'};

// Without the empty slots at the end, and without what bd_scene_finish appended.
#define TRIM(count, items, is_removed_at)                                                          \
    while ((count) > 0 && (items)[(count)-1] is_removed_at) (count)--

static struct bd_scene_counts written_counts(const struct bd_scene *scene)
{
    struct bd_scene_counts n = bd_scene_slots(scene);
    TRIM(n.nodes, scene->nodes, .is_removed);
    TRIM(n.meshes, scene->meshes, ->is_removed);
    TRIM(n.materials, scene->materials, .is_removed);
    TRIM(n.textures, scene->textures, .is_removed);
    TRIM(n.pictures, scene->pictures, ->is_removed);
    TRIM(n.lights, scene->lights, .is_removed);
    TRIM(n.cameras, scene->cameras, .is_removed);
    return n;
}

static void visit_flags(struct bd_flat_io *io, struct bd_scene *scene)
{
    struct bd_scene_flags *flags = &scene->flags;
    uint32_t count = bd_scene_is_finished(scene) ? scene->authored_flag_count : flags->count;
    bd_flat_enter(io, "flags");
    bd_flat_u32(io, &count);
    if (count > BD_SCENE_FLAG_MAX) {
        count = 0;
        bd_flat_fail(io);
    }
    for (uint32_t i = 0; i < count; i++) bd_flat_text(io, flags->text[i], sizeof flags->text[i]);
    if (io->reading) flags->count = count;
}

// The count is the scene's only once it was read, item by item: of what is written, `n` may count
// less, and what was promised and never came is not looked at when the scene is given up.
#define VISIT_ITEMS(io, part, n, count, items, flat_bytes_min, visit)                              \
    do {                                                                                           \
        bool counted_ =                                                                            \
            bd_flat_items(io, part, &(n), (void **)&(items), sizeof *(items), flat_bytes_min);     \
        if ((io)->reading) (count) = 0;                                                            \
        for (uint32_t i = 0; counted_ && i < (n) && !(io)->failed; i++) {                          \
            if (!bd_flat_room(io, (void **)&(items), sizeof *(items), i, n)) break;                \
            if ((io)->reading) (count) = i + 1;                                                    \
            visit;                                                                                 \
        }                                                                                          \
    } while (0)

// Bigger things refer to smaller ones by index, so those come first: when an index is read, the
// count that bounds it is known. Nodes come last.
static void visit_scene(struct bd_flat_io *io, struct bd_scene *scene)
{
    struct bd_scene_counts n = {0};
    if (!io->reading) n = written_counts(scene);
    bd_flat_magic(io, io->is_index ? index_magic : whole_magic);
    VISIT_ITEMS(io, "pictures", n.pictures, scene->picture_count, scene->pictures, 1,
                bd_flat_picture(io, &scene->pictures[i]));
    VISIT_ITEMS(io, "textures", n.textures, scene->texture_count, scene->textures, 14,
                bd_flat_texture(io, &scene->textures[i], &n));
    VISIT_ITEMS(io, "materials", n.materials, scene->material_count, scene->materials, 303,
                bd_flat_material(io, &scene->materials[i], &n));
    VISIT_ITEMS(io, "lights", n.lights, scene->light_count, scene->lights, 97,
                bd_flat_light(io, &scene->lights[i]));
    VISIT_ITEMS(io, "cameras", n.cameras, scene->camera_count, scene->cameras, 86,
                bd_flat_camera(io, &scene->cameras[i]));
    VISIT_ITEMS(io, "meshes", n.meshes, scene->mesh_count, scene->meshes, 69,
                bd_flat_mesh(io, &scene->meshes[i], &n));
    VISIT_ITEMS(io, "nodes", n.nodes, scene->node_count, scene->nodes, 211,
                bd_flat_node(io, &scene->nodes[i], &n));
    bd_flat_environment(io, &scene->environment);
    visit_flags(io, scene);
}

static bool write_scene(const struct bd_scene *scene, bool is_index, bd_flat_sink sink, void *user)
{
    struct bd_flat_io io;
    bd_flat_io_write_to(&io, sink, user);
    io.is_index = is_index;
    // The visitor is shared with reading and so not const; when writing it changes nothing.
    visit_scene(&io, (struct bd_scene *)scene);
    return bd_flat_io_flush(&io);
}

bool bd_flat_write(const struct bd_scene *scene, bd_flat_sink sink, void *user)
{
    return write_scene(scene, false, sink, user);
}

bool bd_flat_write_index(const struct bd_scene *scene, bd_flat_sink sink, void *user)
{
    return write_scene(scene, true, sink, user);
}

bool bd_flat_write_fetching(const struct bd_scene *scene, bd_flat_texels texels, void *texels_user,
                            bd_flat_sink sink, void *user)
{
    struct bd_flat_io io;
    bd_flat_io_write_to(&io, sink, user);
    io.texels = texels;
    io.texels_user = texels_user;
    visit_scene(&io, (struct bd_scene *)scene);
    return bd_flat_io_flush(&io);
}

static enum bd_err read_scene(struct bd_flat_io *io, struct bd_scene **out,
                              struct bd_err_detail *detail)
{
    struct bd_scene *scene = bd_scene_create();
    visit_scene(io, scene);
    enum bd_err err = bd_flat_io_verdict(io, "flat scene", detail);
    if (err == BD_ERR_OK) err = bd_scene_check_references(scene, detail);
    if (err != BD_ERR_OK) bd_scene_release(&scene);
    *out = scene;
    return err;
}

enum bd_err bd_flat_read(const void *bytes, size_t size, struct bd_scene **out,
                         struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    bd_flat_io_read_from(&io, bytes, size);
    return read_scene(&io, out, detail);
}

enum bd_err bd_flat_receive(bd_flat_source source, void *user, uint64_t size_max,
                            struct bd_scene **out, struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    bd_flat_io_read_source(&io, source, user, size_max);
    return read_scene(&io, out, detail);
}

enum bd_err bd_flat_read_index(const void *bytes, size_t size, bd_content_find find, void *user,
                               struct bd_scene **out, struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    bd_flat_io_read_from(&io, bytes, size);
    io.is_index = true;
    io.find = find;
    io.find_user = user;
    enum bd_err err = read_scene(&io, out, detail);
    if (err == BD_ERR_OK) bd_scene_set_hash(*out);
    return err;
}

void bd_scene_set_hash(struct bd_scene *scene)
{
    struct bd_sha256 *sha = bd_sha256_create();
    bool written = bd_flat_write_index(scene, bd_flat_to_sha256, sha);
    BD_ASSERT(written); // the sink refuses nothing, and what a scene holds is in range
    bd_sha256_finish(&sha, scene->content_sha256);
}
