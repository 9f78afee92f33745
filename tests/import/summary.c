// Imports a file as the daemon does and prints what came of it, as JSON: for the lists, and for
// eyes. `summary PROGRAM|--in-process|--round-trip FILE`; the files beside a .gltf are found in its
// folder. With --round-trip, in this process, and then through an export and back.
//
// Exit 0: loaded; 4: refused, with the error in the JSON; 2: usage or no such file.

#include <fcntl.h>
#include <jansson.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/hash.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "tests/import/round_trip.h"

static struct bd_import_file map_file(const char *path, const char *uri)
{
    struct bd_import_file file = {uri, "", 0};
    struct stat info;
    int fd = open(path, O_RDONLY | O_NONBLOCK);
    if (fd < 0 || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        fprintf(stderr, "cannot read %s\n", path);
        exit(2);
    }
    file.size_bytes = (size_t)info.st_size;
    if (file.size_bytes) file.bytes = mmap(NULL, file.size_bytes, PROT_READ, MAP_PRIVATE, fd, 0);
    close(fd);
    return file;
}

static void percent_decode(char *text)
{
    char *out = text;
    for (; *text; text++) {
        unsigned code;
        if (*text == '%' && sscanf(text + 1, "%2x", &code) == 1) {
            *out++ = (char)code;
            text += 2;
        } else {
            *out++ = *text;
        }
    }
    *out = 0;
}

// As the client will: no scheme, not absolute, inside the folder.
static bool is_local(const char *uri)
{
    return uri[0] && uri[0] != '/' && !strchr(uri, ':') && !strstr(uri, "..");
}

static uint32_t add_uris(const json_t *document, const char *key, const char *folder,
                         struct bd_import_file *files, uint32_t count)
{
    size_t i;
    json_t *item;
    json_array_foreach(json_object_get(document, key), i, item)
    {
        const char *uri = json_string_value(json_object_get(item, "uri"));
        if (!uri || !is_local(uri) || count == 64) continue;
        char relative[1024], path[4096];
        snprintf(relative, sizeof relative, "%s", uri);
        percent_decode(relative);
        snprintf(path, sizeof path, "%s/%s", folder, relative);
        if (access(path, R_OK) == 0) files[count++] = map_file(path, uri);
    }
    return count;
}

// The uris live in `document`; NULL for a .glb.
static uint32_t find_files(const char *path, struct bd_import_file files[64], json_t **out)
{
    files[0] = map_file(path, path);
    json_t *document =
        json_loadb(files[0].bytes, files[0].size_bytes, JSON_REJECT_DUPLICATES, NULL);
    *out = document;
    char *copy = strdup(path);
    uint32_t count = add_uris(document, "buffers", dirname(copy), files, 1);
    free(copy);
    copy = strdup(path);
    count = add_uris(document, "images", dirname(copy), files, count);
    free(copy);
    return count;
}

static json_t *vec(bd_dvec3 v)
{
    return json_pack("[f,f,f]", v.x, v.y, v.z);
}

static json_t *placements(const struct bd_placement *placed, uint32_t count)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; i++)
        json_array_append_new(list, json_pack("{s:i,s:i,s:o,s:o}", "node", placed[i].node, "object",
                                              placed[i].object, "position", vec(placed[i].position),
                                              "axis_z", vec(placed[i].axis_z)));
    return list;
}

static json_t *features(const struct bd_features *f)
{
    return json_pack(
        "{s:I,s:i,s:i,s:[i,i,i],s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,s:b,"
        "s:f,s:f,s:o,s:o,s:f}",
        "triangles", (json_int_t)f->triangle_count, "instances", f->instance_count, "primitives",
        f->primitive_count, "lights", f->light_count[0], f->light_count[1], f->light_count[2],
        "base_color_map", f->has_base_color_map, "metallic_roughness_map",
        f->has_metallic_roughness_map, "normal_map", f->has_normal_map, "emissive_map",
        f->has_emissive_map, "vertex_color", f->has_vertex_color, "uv1", f->has_uv1, "mask",
        f->has_mask, "blend", f->has_blend, "single_sided", f->has_single_sided, "metal",
        f->has_metal, "glossy", f->has_glossy, "specular", f->has_mirror, "transmissive",
        f->has_transmissive, "emissive", f->has_emissive, "unlit", f->has_unlit, "punctual_flux_lm",
        f->punctual_flux_lm, "emissive_flux_lm", f->emissive_flux_lm, "bounds_min",
        vec(f->bounds_min), "bounds_max", vec(f->bounds_max), "diagonal_m", f->diagonal_m);
}

static json_t *flags(const struct bd_scene_flags *in)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < in->count; i++) json_array_append_new(list, json_string(in->text[i]));
    return list;
}

static json_t *scene_json(const struct bd_scene *scene)
{
    char hex[BD_SHA256_HEX];
    bd_sha256_hex(scene->content_sha256, hex);
    return json_pack("{s:s,s:s,s:i,s:i,s:i,s:i,s:i,s:i,s:i,s:o,s:o,s:o,s:o}", "verdict", "load",
                     "sha256", hex, "nodes", scene->node_count, "meshes", scene->mesh_count,
                     "materials", scene->material_count, "textures", scene->texture_count,
                     "pictures", scene->picture_count, "lights", scene->light_count, "cameras",
                     scene->camera_count, "placed_lights",
                     placements(scene->placed_lights, scene->placed_light_count), "placed_cameras",
                     placements(scene->placed_cameras, scene->placed_camera_count), "features",
                     features(&scene->features), "flags", flags(&scene->flags));
}

static json_t *error_json(const struct bd_err_detail *detail)
{
    return json_pack("{s:s,s:s,s:s,s:s}", "verdict", "refuse", "error", bd_err_name(detail->err),
                     "field", detail->field, "message", detail->message);
}

static enum bd_err import(const char *program, const struct bd_import_file *files, uint32_t count,
                          struct bd_scene **scene, struct bd_err_detail *detail)
{
    if (program) {
        struct bd_import_pool *pool = bd_import_pool_create(program, 0);
        enum bd_err err = bd_import(pool, files, count, &bd_import_default_limits, scene, detail);
        bd_import_pool_destroy(&pool);
        return err;
    }
    enum bd_err err = bd_gltf_read(files, count, &bd_import_default_limits, scene, detail);
    return err == BD_ERR_OK ? bd_scene_finish(*scene, detail) : err;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: summary PROGRAM|--in-process|--round-trip FILE\n");
        return 2;
    }
    bool is_trip = strcmp(argv[1], "--round-trip") == 0;
    const char *program = is_trip || strcmp(argv[1], "--in-process") == 0 ? NULL : argv[1];
    struct bd_import_file files[64];
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    json_t *document;
    uint32_t count = find_files(argv[2], files, &document);
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = import(program, files, count, &scene, &detail);
    json_t *summary = err == BD_ERR_OK ? scene_json(scene) : error_json(&detail);
    json_object_set_new(summary, "import_ms", json_real(bd_ms_since(start_ns)));
    if (is_trip && err == BD_ERR_OK)
        json_object_set_new(summary, "round_trip", round_trip_json(scene));
    json_dumpf(summary, stdout, JSON_INDENT(1) | JSON_ENSURE_ASCII | JSON_REAL_PRECISION(9));
    puts("");
    json_decref(summary);
    json_decref(document);
    bd_scene_release(&scene);
    return err == BD_ERR_OK ? 0 : 4;
}
