// The file of `bounce reference`: sums over samples, to which pieces are added, and its form on
// disk.
//
// A piece is what the daemon answers for a range of samples: an EXR with both halves, variances and
// guides (protocol/bounced.proto, FrameRequest.layers). Pieces are added as exact weighted means,
// in double; a file read back is one more piece. What a file says about its making is the daemon's
// manifest, with the samples of all pieces. A file that was resumed equals an uninterrupted one up
// to the rounding of 32-bit floats.
//
// A pixel takes about 750 bytes while the file is encoded: sums in double, and copies of 54 planes
// of 32 bits.
//
// Thread: main.

#ifndef BD_CLI_REFERENCE_FILE_H
#define BD_CLI_REFERENCE_FILE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "image/bytes.h"

#define BD_CLI_REFERENCE_LAYERS                                                                    \
    "direct", "indirect", "emission", "albedo", "normal", "depth", "halves", "variance",           \
        "normal_length"

struct bd_cli_reference_file;

struct bd_cli_reference_file *bd_cli_reference_file_create(void);
void bd_cli_reference_file_destroy(struct bd_cli_reference_file **file);

// Samples a pixel, both halves together, that are in it; 0 for a new one.
uint32_t bd_cli_reference_file_spp(const struct bd_cli_reference_file *file);

// Whether its layers of light are filtered (image/light_filter.h) where it is written; halves,
// variances and sums never are, so that samples can be added all the same. A file that is read
// begins as it was.
bool bd_cli_reference_file_filters(const struct bd_cli_reference_file *file);
void bd_cli_reference_file_set_filters(struct bd_cli_reference_file *file, bool filters);

// Of a parameter of the technique, a key or "KEY=VALUE", that the file itself decides on (how many
// samples it has, whether it is filtered): what a user has instead. NULL for the others.
const char *bd_cli_reference_file_decides(const char *parameter);
// What the file says of that key; false for those that it does not decide on.
#define BD_CLI_OWN_MAX 16
bool bd_cli_reference_file_own(const struct bd_cli_reference_file *file, const char *key,
                               char text[BD_CLI_OWN_MAX]);
// Whether a manifest's parameters say that the picture is filtered.
bool bd_cli_parameters_filter(const char *parameters);

// Adds a piece: the bytes of an EXR. Its samples must follow those that are there. BD_ERR_BAD_INPUT
// for what is none, with the channel or entry that is missing.
BD_MUST_CHECK
enum bd_err bd_cli_reference_file_add(struct bd_cli_reference_file *file, const void *bytes,
                                      size_t size_bytes, struct bd_err_detail *detail);

// What the manifest says: "scene", "seed", ...; "" where it says nothing. Of "parameters" without
// those that the file decides on. Valid until the next add.
const char *bd_cli_reference_file_says(const struct bd_cli_reference_file *file, const char *key);
void bd_cli_reference_file_size(const struct bd_cli_reference_file *file, uint32_t *width_px,
                                uint32_t *height_px);

// The whole as the bytes of an EXR; `*out` must be empty.
BD_MUST_CHECK
enum bd_err bd_cli_reference_file_encode(const struct bd_cli_reference_file *file,
                                         struct bd_bytes *out, struct bd_err_detail *detail);

#endif
