#include "tests/fuzz/batch.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/edit_heavy.h"
#include "net/wire/edit_decode.h"
#include "protocol/json.h"
#include "protocol/limits.h"
#include "protocol/wire.h"

// --- messages -------------------------------------------------------------------------------

Bounced__EditBatch *batch_from_json(const uint8_t *text, size_t size)
{
    ProtobufCMessage *message = NULL;
    struct bd_err_detail detail = {0};
    if (!bd_json_text_to_message((const char *)text, size, &bounced__edit_batch__descriptor,
                                 &message, &detail))
        return (Bounced__EditBatch *)message;
    BD_ASSERT(detail.message[0]);
    return NULL;
}

Bounced__EditBatch *batch_from_bytes(const uint8_t *bytes, size_t size)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(size));
    return bounced__edit_batch__unpack(&alloc.allocator, size, bytes);
}

void batch_free(Bounced__EditBatch *batch)
{
    if (batch) bounced__edit_batch__free_unpacked(batch, NULL);
}

// --- carried out ----------------------------------------------------------------------------

static enum bd_err decode(const Bounced__EditBatch *batch, struct bd_edit_op *ops,
                          struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < batch->n_ops; i++)
        err = bd_edit_decode(i, batch->ops[i], &ops[i], detail);
    return err;
}

static enum bd_err read_heavy(const Bounced__EditBatch *batch, const struct batch_inputs *inputs,
                              const struct bd_scene *base, struct bd_edit_op *ops,
                              struct bd_err_detail *detail)
{
    struct bd_edit_budget budget = bd_edit_budget(&bd_limits_default, UINT64_MAX);
    const struct bd_edit_heavy_inputs heavy = {.blobs = inputs->blobs,
                                               .limits = &bd_limits_default,
                                               .budget = &budget,
                                               .base = base,
                                               .payload = inputs->payload,
                                               .payload_bytes = inputs->payload_bytes};
    struct bd_edit_flags flags = {0};
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < batch->n_ops; i++)
        err = bd_edit_heavy_read(&heavy, i, batch->ops[i], ops, &flags, detail);
    return err;
}

static enum bd_err check_count(const Bounced__EditBatch *batch, struct bd_err_detail *detail)
{
    if (batch->n_ops > 0 && batch->n_ops <= bd_edit_default_limits.ops) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "ops", "%zu operations", batch->n_ops);
}

enum bd_err batch_check(const Bounced__EditBatch *batch, const struct batch_inputs *inputs,
                        const struct bd_scene *base, struct bd_delta *out, int32_t **ids,
                        struct bd_err_detail *detail)
{
    *out = (struct bd_delta){0};
    enum bd_err err = check_count(batch, detail);
    if (err) return err;
    struct bd_edit_op *ops = calloc(batch->n_ops, sizeof *ops);
    int32_t *added = calloc(batch->n_ops, sizeof *added);
    BD_ASSERT(ops && added);
    err = decode(batch, ops, detail);
    if (!err) err = read_heavy(batch, inputs, base, ops, detail);
    if (!err)
        err = bd_edit_check(base, ops, (uint32_t)batch->n_ops, &bd_edit_default_limits, out, added,
                            detail);
    for (size_t i = 0; i < batch->n_ops; i++) bd_edit_heavy_release(&ops[i]); // decoded or not
    free(ops);
    if (ids) *ids = added;
    if (!ids) free(added);
    return err;
}

// --- the small scene ------------------------------------------------------------------------

static const char small_scene[] =
    "{\"ops\":["
    "{\"add_material\":{\"name\":\"red\",\"base_color\":[0.8,0.1,0.1,1],\"roughness\":0.9}},"
    "{\"add_material\":{\"name\":\"lamp\",\"emissive\":[5,5,4],\"double_sided\":true}},"
    "{\"add_material\":{\"name\":\"glass\",\"transmission\":1,\"roughness\":0,\"ior\":1.4,"
    "\"thickness\":0.1,\"attenuation_distance\":2,\"alpha_mode\":\"mask\"}},"
    "{\"add_mesh\":{\"name\":\"quad\",\"primitives\":[{\"material\":-2,"
    "\"positions\":{\"values\":[0,0,0,1,0,0,1,1,0,0,1,0]},"
    "\"uv0\":{\"values\":[0,0,1,0,1,1,0,1]},"
    "\"colors\":{\"values\":[1,1,1,1,1,0,0,1,0,1,0,1,0,0,1,1]},"
    "\"indices\":{\"values\":[0,1,2,0,2,3]}}]}},"
    "{\"add_mesh\":{\"name\":\"two\",\"primitives\":["
    "{\"material\":-3,\"positions\":{\"values\":[0,0,0,1,0,0,0,1,0]}},"
    "{\"material\":-4,\"positions\":{\"values\":[0,0,1,1,0,1,0,1,1]}}]}},"
    "{\"add_light\":{\"name\":\"bulb\",\"kind\":\"point\",\"intensity\":10}},"
    "{\"add_light\":{\"name\":\"spot\",\"kind\":\"spot\",\"intensity\":20,\"cone_outer\":0.7}},"
    "{\"add_light\":{\"name\":\"sun\",\"kind\":\"directional\",\"intensity\":3}},"
    "{\"add_camera\":{\"name\":\"front\",\"yfov\":0.8,\"near\":0.1}},"
    "{\"add_camera\":{\"name\":\"plan\",\"orthographic\":true,\"xmag\":2,\"ymag\":2,"
    "\"near\":0.1,\"far\":10}},"
    "{\"add_node\":{\"name\":\"room\"}},"
    "{\"add_node\":{\"name\":\"floor\",\"parent\":-12,\"mesh\":-5}},"
    "{\"add_node\":{\"name\":\"things\",\"parent\":-12,\"mesh\":-6,"
    "\"transform\":{\"translation\":[0,0,1],\"scale\":[1,2,1]}}},"
    "{\"add_node\":{\"name\":\"bulb\",\"parent\":-12,\"light\":-7,"
    "\"transform\":{\"translation\":[0.5,0.5,2]}}},"
    "{\"add_node\":{\"name\":\"spot\",\"parent\":-14,\"light\":-8}},"
    "{\"add_node\":{\"name\":\"sun\",\"light\":-9,\"shown\":false}},"
    "{\"add_node\":{\"name\":\"front\",\"camera\":-10,"
    "\"transform\":{\"translation\":[0.5,0.5,4]}}},"
    "{\"add_node\":{\"name\":\"plan\",\"camera\":-11}},"
    "{\"set_environment\":{\"radiance\":[0.1,0.1,0.2]}}]}";

static struct bd_scene *empty_scene(void)
{
    struct bd_scene *scene = bd_scene_create();
    enum bd_err err = bd_scene_finish(scene, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    bd_scene_set_hash(scene);
    return scene;
}

struct bd_scene *batch_small_scene(void)
{
    const struct batch_inputs inputs = {0};
    struct bd_scene *empty = empty_scene(), *scene = NULL;
    struct bd_delta delta;
    Bounced__EditBatch *batch = batch_from_json((const uint8_t *)small_scene, strlen(small_scene));
    BD_ASSERT(batch);
    enum bd_err err = batch_check(batch, &inputs, empty, &delta, NULL, NULL);
    if (!err) err = bd_delta_apply(empty, &delta, &scene, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    bd_delta_finish(&delta);
    bd_scene_release(&empty);
    batch_free(batch);
    return scene;
}
