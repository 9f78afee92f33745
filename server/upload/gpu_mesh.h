// Meshes and pictures on the GPU, shared by content hash (upload/gpu_scene.h).

#ifndef BD_UPLOAD_GPU_MESH_H
#define BD_UPLOAD_GPU_MESH_H

#include "upload/gpu_scene.h"

// Between two pieces of an upload: asks whether to stop. What happens in it is not counted to
// `upload_ms`.
BD_MUST_CHECK
enum bd_err bd_uploader_pause(struct bd_uploader *uploader);

// Finds or makes the GPU copy; the caller holds one reference.
BD_MUST_CHECK
enum bd_err bd_gpu_mesh_acquire(struct bd_uploader *uploader, const struct bd_mesh *mesh,
                                struct bd_gpu_mesh **out, struct bd_err_detail *detail);
void bd_gpu_mesh_drop(struct bd_uploader *uploader, struct bd_gpu_mesh **mesh);

BD_MUST_CHECK
enum bd_err bd_gpu_picture_acquire(struct bd_uploader *uploader, const struct bd_picture *picture,
                                   bool srgb, struct bd_gpu_picture **out,
                                   struct bd_err_detail *detail);
void bd_gpu_picture_drop(struct bd_uploader *uploader, struct bd_gpu_picture **picture);

#endif
