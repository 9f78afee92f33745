#include "base/hash.h"

#include <openssl/evp.h>
#include <stdio.h>
#include <xxhash.h>

#include "base/assert.h"

uint64_t bd_hash64(const void *bytes, size_t size, uint64_t seed)
{
    return XXH3_64bits_withSeed(bytes, size, seed);
}

// The struct is never defined: it is libcrypto's context under our name.
struct bd_sha256 *bd_sha256_create(void)
{
    EVP_MD_CTX *context = EVP_MD_CTX_new();
    BD_ASSERT(context && EVP_DigestInit_ex(context, EVP_sha256(), NULL) == 1);
    return (struct bd_sha256 *)context;
}

void bd_sha256_update(struct bd_sha256 *sha, const void *bytes, size_t size)
{
    BD_ASSERT(EVP_DigestUpdate((EVP_MD_CTX *)sha, bytes, size) == 1);
}

void bd_sha256_finish(struct bd_sha256 **sha, uint8_t digest[BD_SHA256_BYTES])
{
    BD_ASSERT(EVP_DigestFinal_ex((EVP_MD_CTX *)*sha, digest, NULL) == 1);
    bd_sha256_destroy(sha);
}

void bd_sha256_destroy(struct bd_sha256 **sha)
{
    EVP_MD_CTX_free((EVP_MD_CTX *)*sha);
    *sha = NULL;
}

void bd_sha256_of(const void *bytes, size_t size, uint8_t digest[BD_SHA256_BYTES])
{
    struct bd_sha256 *sha = bd_sha256_create();
    bd_sha256_update(sha, bytes, size);
    bd_sha256_finish(&sha, digest);
}

void bd_sha256_hex(const uint8_t digest[BD_SHA256_BYTES], char hex[BD_SHA256_HEX])
{
    for (int i = 0; i < BD_SHA256_BYTES; i++) snprintf(hex + 2 * i, 3, "%02x", digest[i]);
}
