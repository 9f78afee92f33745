// What lies transient over what is durable: a layer an author.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "scene/model/delta_parts.h"
#include "scene/store/store_parts.h"

static void finish(struct bd_layer *layer)
{
    bd_delta_finish(&layer->before);
    bd_delta_finish(&layer->after);
}

static void take_out(struct bd_slot *slot, uint32_t index)
{
    struct bd_layer *at = slot->layers + index;
    memmove(at, at + 1, (--slot->layer_count - index) * sizeof *at);
}

static void drop(struct bd_slot *slot, uint32_t index)
{
    finish(&slot->layers[index]);
    take_out(slot, index);
}

// An author's, empty and on top of the others.
static struct bd_layer *append(struct bd_slot *slot, const char *author)
{
    struct bd_layer *layers = realloc(slot->layers, (slot->layer_count + 1) * sizeof *slot->layers);
    BD_ASSERT(layers);
    slot->layers = layers;
    struct bd_layer *layer = &layers[slot->layer_count++];
    memset(layer, 0, sizeof *layer);
    bd_batch_set_text(layer->author, sizeof layer->author, author);
    return layer;
}

void bd_layers_drop(struct bd_slot *slot)
{
    for (uint32_t i = 0; i < slot->layer_count; i++) finish(&slot->layers[i]);
    free(slot->layers);
    slot->layers = NULL;
    slot->layer_count = 0;
}

struct bd_layer *bd_layers_find(const struct bd_slot *slot, const char *author)
{
    struct bd_layer *found = NULL;
    for (uint32_t i = 0; i < slot->layer_count; i++) {
        struct bd_layer *layer = &slot->layers[i];
        if (layer->batch || (author && strcmp(layer->author, author) != 0)) continue;
        if (!found || layer->laid_ns < found->laid_ns) found = layer;
    }
    return found;
}

uint64_t bd_layers_batches(const struct bd_slot *slot)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < slot->layer_count; i++) count += slot->layers[i].batches;
    return count;
}

uint64_t bd_layers_objects(const struct bd_slot *slot)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < slot->layer_count; i++)
        if (!slot->layers[i].batch) count += slot->layers[i].after.count;
    return count;
}

// --- laying ---------------------------------------------------------------------------------

// States that are new to a list, or all of another.
static bool add_unknown(struct bd_delta *list, const struct bd_delta *more)
{
    struct bd_delta unknown = {0}, merged = {0};
    bool ok = true;
    for (uint32_t i = 0; ok && i < more->count; i++) {
        const struct bd_change *change = &more->changes[i];
        if (bd_delta_get(list, change->kind, change->id)) continue;
        ok = bd_delta_append(&unknown, change);
        if (ok) bd_change_retain(change);
    }
    ok = ok && bd_delta_merge(list, &unknown, &merged);
    bd_delta_finish(&unknown);
    if (!ok) return false;
    bd_delta_finish(list);
    *list = merged;
    return true;
}

// What of it the layer has already goes on from there; the rest begins. False, and nothing
// changed, without memory.
static bool fold(struct bd_layer *layer, const struct bd_delta *before,
                 const struct bd_delta *after)
{
    struct bd_delta from = {0}, to = {0};
    struct bd_clash none = {0};
    bool ok = add_unknown(&from, &layer->before) && add_unknown(&to, &layer->after);
    for (uint32_t i = 0; ok && i < after->count; i++) {
        const struct bd_change *next = &after->changes[i];
        struct bd_change *known = bd_delta_find(&to, next->kind, next->id);
        if (known) bd_change_carry(known, &before->changes[i], next, &none);
    }
    ok = ok && add_unknown(&from, before) && add_unknown(&to, after);
    if (ok) finish(layer);
    if (!ok) bd_delta_finish(&from);
    if (!ok) bd_delta_finish(&to);
    if (!ok) return false;
    layer->before = from;
    layer->after = to;
    return true;
}

bool bd_layers_add(struct bd_slot *slot, const char *author, const struct bd_delta *delta)
{
    struct bd_delta before = {0};
    if (!bd_delta_invert(slot->shown.scene, delta, &before)) return false;
    struct bd_layer *layer = bd_layers_find(slot, author);
    if (!layer) layer = append(slot, author);
    const bool ok = fold(layer, &before, delta);
    bd_delta_finish(&before);
    if (ok) layer->batches++;
    if (ok) layer->laid_ns = bd_clock_ns();
    if (!ok && layer->batches == 0) drop(slot, (uint32_t)(layer - slot->layers));
    return ok;
}

bool bd_layers_over(const struct bd_slot *slot, const struct bd_scene *scene, struct bd_delta *out)
{
    struct bd_clash none = {0};
    bool ok = true;
    *out = (struct bd_delta){0};
    for (uint32_t i = 0; ok && i < slot->layer_count; i++)
        ok = bd_delta_carry(scene, &slot->layers[i].before, &slot->layers[i].after, out, &none);
    return ok;
}

// --- commits --------------------------------------------------------------------------------

void bd_layers_begin_commit(struct bd_slot *slot, struct bd_layer *layer, struct bd_batch *batch)
{
    struct bd_layer moved = *layer;
    uint32_t to = 0;
    take_out(slot, (uint32_t)(layer - slot->layers));
    while (to < slot->layer_count && slot->layers[to].batch) to++;
    struct bd_layer *at = slot->layers + to;
    memmove(at + 1, at, (slot->layer_count++ - to) * sizeof *at);
    moved.batch = batch;
    *at = moved;
    slot->committing_count++;
    batch->was_transient = true;
}

// What its author has laid meanwhile goes on top of it. Without memory it stays by itself.
static void give_back(struct bd_slot *slot, struct bd_layer *layer)
{
    struct bd_layer *newer = bd_layers_find(slot, layer->author);
    layer->batch = NULL;
    if (!newer || !fold(layer, &newer->before, &newer->after)) return;
    layer->batches += newer->batches;
    layer->laid_ns = newer->laid_ns;
    drop(slot, (uint32_t)(newer - slot->layers));
}

void bd_layers_end_commit(struct bd_slot *slot, const struct bd_batch *batch, bool failed)
{
    slot->committing_count--;
    for (uint32_t i = 0; i < slot->layer_count; i++) {
        if (slot->layers[i].batch != batch) continue;
        if (failed)
            give_back(slot, &slot->layers[i]);
        else
            drop(slot, i);
        return;
    }
}

// --- what is newer --------------------------------------------------------------------------

// Of an ordered list, in place.
static void forget(struct bd_delta *list, const struct bd_delta *touched)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        struct bd_change *change = &list->changes[i];
        if (bd_delta_get(touched, change->kind, change->id))
            bd_change_finish(change);
        else
            list->changes[kept++] = *change;
    }
    list->count = kept;
}

void bd_layers_forget(struct bd_slot *slot, const struct bd_delta *delta)
{
    for (uint32_t i = slot->layer_count; i-- > 0;) {
        struct bd_layer *layer = &slot->layers[i];
        if (layer->batch) continue;
        forget(&layer->before, delta);
        forget(&layer->after, delta);
        if (layer->after.count == 0) drop(slot, i);
    }
}
