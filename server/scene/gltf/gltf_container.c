#include "scene/gltf/gltf_container.h"

#include <stdlib.h>
#include <string.h>

enum { HEADER_BYTES = 12, CHUNK_HEADER_BYTES = 8 };

static const uint32_t json_type = 0x4e4f534a, bin_type = 0x004e4942;

struct chunk {
    uint32_t size_bytes, type;
    size_t offset, next; // of its content, of the next chunk
};

static uint32_t word_at(const struct bd_gltf_text *text, size_t offset)
{
    uint32_t word;
    memcpy(&word, text->bytes + offset, sizeof word);
    return word;
}

static enum bd_err bad(struct bd_err_detail *detail, const char *message)
{
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "glb", "%s", message);
}

static enum bd_err read_chunk(const struct bd_gltf_text *text, size_t at, struct chunk *out,
                              struct bd_err_detail *detail)
{
    if (text->size - at < CHUNK_HEADER_BYTES) return bad(detail, "file ends in a chunk's header");
    *out = (struct chunk){word_at(text, at), word_at(text, at + 4), at + CHUNK_HEADER_BYTES, 0};
    if (out->size_bytes > text->size - out->offset)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "glb",
                          "chunk of %u bytes, %zu are left in the file", out->size_bytes,
                          text->size - out->offset);
    if (out->size_bytes % 4 != 0)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "glb", "chunk of %u bytes, not a multiple of 4",
                          out->size_bytes);
    out->next = out->offset + out->size_bytes;
    return BD_ERR_OK;
}

static enum bd_err check_header(const struct bd_gltf_text *text, struct bd_err_detail *detail)
{
    if (text->size < HEADER_BYTES) return bad(detail, "file ends in the header");
    uint32_t version = word_at(text, 4), length = word_at(text, 8);
    if (version != 2)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "glb", "container version %u, not 2",
                          version);
    if (length > text->size || length < HEADER_BYTES)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "glb", "header says %u bytes, the file has %zu",
                          length, text->size);
    return BD_ERR_OK;
}

static void cut(struct bd_gltf_text *text, size_t size)
{
    uint32_t length = (uint32_t)size;
    text->size = size;
    memcpy(text->bytes + 8, &length, sizeof length);
}

// After the JSON chunk: at most one BIN chunk, which comes first if it is there.
static enum bd_err check_rest(struct bd_gltf_text *text, size_t json_end,
                              struct bd_err_detail *detail)
{
    size_t keep = json_end;
    for (size_t at = json_end; at < text->size;) {
        struct chunk chunk = {0};
        enum bd_err err = read_chunk(text, at, &chunk, detail);
        if (err != BD_ERR_OK) return err;
        if (chunk.type == json_type) return bad(detail, "second JSON chunk");
        if (chunk.type == bin_type && at != json_end)
            return bad(detail, "BIN chunk is not the second chunk");
        if (chunk.type == bin_type && chunk.size_bytes > 0) keep = chunk.next;
        at = chunk.next;
    }
    cut(text, keep);
    return BD_ERR_OK;
}

static enum bd_err open_glb(struct bd_gltf_text *text, struct bd_gltf_json_range *json,
                            struct bd_err_detail *detail)
{
    struct chunk first = {0};
    enum bd_err err = check_header(text, detail);
    if (err != BD_ERR_OK) return err;
    text->size = word_at(text, 8); // what follows is not the scene's
    err = read_chunk(text, HEADER_BYTES, &first, detail);
    if (err != BD_ERR_OK) return err;
    if (first.type != json_type) return bad(detail, "first chunk is not JSON");
    *json = (struct bd_gltf_json_range){first.offset, first.size_bytes};
    return check_rest(text, first.next, detail);
}

enum bd_err bd_gltf_open_container(struct bd_gltf_text *text, struct bd_gltf_json_range *json,
                                   struct bd_err_detail *detail)
{
    text->is_glb = text->size >= 4 && memcmp(text->bytes, "glTF", 4) == 0;
    if (text->is_glb) return open_glb(text, json, detail);
    *json = (struct bd_gltf_json_range){0, text->size};
    return BD_ERR_OK;
}

static void put_word(uint8_t *at, size_t word)
{
    uint32_t value = (uint32_t)word;
    memcpy(at, &value, sizeof value);
}

enum bd_err bd_gltf_wrap(struct bd_gltf_text *text, size_t zero_bytes, struct bd_err_detail *detail)
{
    size_t json_bytes = (text->size + 3) & ~(size_t)3, bin_bytes = (zero_bytes + 3) & ~(size_t)3;
    size_t size = HEADER_BYTES + 2 * CHUNK_HEADER_BYTES + json_bytes + bin_bytes;
    uint8_t *glb = calloc(1, size);
    if (!glb) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the file");
    uint8_t *json = glb + HEADER_BYTES + CHUNK_HEADER_BYTES, *bin = json + json_bytes;
    memcpy(glb, "glTF", 4);
    put_word(glb + 4, 2);
    put_word(glb + 8, size);
    put_word(json - 8, json_bytes);
    put_word(json - 4, json_type);
    memset(json, ' ', json_bytes);
    memcpy(json, text->bytes, text->size);
    put_word(bin, bin_bytes);
    put_word(bin + 4, bin_type);
    free(text->bytes);
    text->bytes = glb;
    text->size = size;
    text->is_glb = true;
    return BD_ERR_OK;
}
