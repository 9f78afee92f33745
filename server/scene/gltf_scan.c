#include "scene/gltf_scan.h"

#include <stdlib.h>
#include <string.h>

enum bd_err bd_gltf_scan(const void *bytes, size_t size, struct bd_gltf_text *out,
                         struct bd_fault *fault)
{
    *out = (struct bd_gltf_text){NULL, size, false};
    if (size < 4) return bd_fault_set(fault, BD_ERR_BAD_INPUT, "", "file of %zu bytes", size);
    out->bytes = malloc(size);
    if (!out->bytes) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the file");
    memcpy(out->bytes, bytes, size);
    out->is_glb = memcmp(bytes, "glTF", 4) == 0;
    return BD_ERR_OK;
}

void bd_gltf_text_free(struct bd_gltf_text *text)
{
    free(text->bytes);
    text->bytes = NULL;
}

bool bd_gltf_extension_is_supported(const char *name)
{
    static const char *const supported[] = {
        "KHR_lights_punctual",        "KHR_materials_emissive_strength",
        "KHR_materials_ior",          "KHR_materials_unlit",
        "KHR_materials_transmission", "KHR_materials_volume",
        "KHR_texture_transform",      "KHR_mesh_quantization"};
    for (size_t i = 0; i < sizeof supported / sizeof supported[0]; i++)
        if (strcmp(name, supported[i]) == 0) return true;
    return false;
}
