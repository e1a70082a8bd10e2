#include "core/sha256.h"

#include <errno.h>
#include <fcntl.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define PIECE_BYTES (1u << 20)

static enum shef_err fail_crypto(const char *path, struct shef_error *err)
{
    return shef_fail(err, SHEF_ERR_NO_MEMORY, "SHA-256 of '%s': libcrypto refused", path);
}

static void write_digits(const uint8_t *digest, char out_text[SHEF_SHA256_TEXT_BYTES])
{
    for (int i = 0; i < (SHEF_SHA256_TEXT_BYTES - 1) / 2; i++)
        snprintf(out_text + 2 * i, 3, "%02x", digest[i]);
}

enum shef_err shef_sha256_bytes(const void *bytes, size_t n_bytes,
                                char out_text[SHEF_SHA256_TEXT_BYTES], struct shef_error *err)
{
    uint8_t digest[EVP_MAX_MD_SIZE];

    if (EVP_Digest(bytes, n_bytes, digest, NULL, EVP_sha256(), NULL) != 1)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "SHA-256: libcrypto refused");
    write_digits(digest, out_text);
    return SHEF_OK;
}

static enum shef_err hash_open_file(int fd, EVP_MD_CTX *hash, uint8_t *piece, const char *path,
                                    shef_go_on_fn *go_on, void *context, struct shef_error *err)
{
    ssize_t n_read;

    if (EVP_DigestInit_ex(hash, EVP_sha256(), NULL) != 1)
        return fail_crypto(path, err);
    while ((n_read = read(fd, piece, PIECE_BYTES)) != 0) {
        if (n_read < 0 && errno == EINTR)
            continue;
        if (n_read < 0)
            return shef_fail_os(err, errno, "read '%s'", path);
        if (EVP_DigestUpdate(hash, piece, (size_t)n_read) != 1)
            return fail_crypto(path, err);
        if (go_on && !go_on(context, (uint64_t)n_read))
            return shef_fail(err, SHEF_ERR_GONE, "SHA-256 of '%s': stopped", path);
    }
    return SHEF_OK;
}

enum shef_err shef_sha256_file(const char *path, shef_go_on_fn *go_on, void *context,
                               char out_text[SHEF_SHA256_TEXT_BYTES], struct shef_error *err)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);

    if (fd < 0)
        return shef_fail_os(err, errno, "read '%s'", path);

    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    uint8_t *piece = malloc(PIECE_BYTES);
    uint8_t digest[EVP_MAX_MD_SIZE];
    enum shef_err code = SHEF_OK;

    if (!hash || !piece)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "SHA-256 of '%s': out of memory", path);
    if (code == SHEF_OK)
        code = hash_open_file(fd, hash, piece, path, go_on, context, err);
    if (code == SHEF_OK && EVP_DigestFinal_ex(hash, digest, NULL) != 1)
        code = fail_crypto(path, err);
    if (code == SHEF_OK)
        write_digits(digest, out_text);
    EVP_MD_CTX_free(hash);
    free(piece);
    close(fd);
    return code;
}
