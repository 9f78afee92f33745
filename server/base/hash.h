// Hashes: a fast one for keys and for sums that find damage, and SHA-256 for names of content.

#ifndef BD_BASE_HASH_H
#define BD_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

// XXH3, 64 bits, a fixed function: files may keep it. Chained by the previous result as `seed`.
uint64_t bd_hash64(const void *bytes, size_t size, uint64_t seed);

#define BD_SHA256_BYTES 32
#define BD_SHA256_HEX   65 // with the final zero

struct bd_sha256;
struct bd_sha256 *bd_sha256_create(void);
void bd_sha256_update(struct bd_sha256 *sha, const void *bytes, size_t size);
// Writes the digest and destroys `*sha`.
void bd_sha256_finish(struct bd_sha256 **sha, uint8_t digest[BD_SHA256_BYTES]);
void bd_sha256_destroy(struct bd_sha256 **sha);

void bd_sha256_of(const void *bytes, size_t size, uint8_t digest[BD_SHA256_BYTES]);
// Lower-case hexadecimal.
void bd_sha256_hex(const uint8_t digest[BD_SHA256_BYTES], char hex[BD_SHA256_HEX]);

#endif
