// No exception leaves this file, and no type of the library's.

#include "image/exr_lossy.h"

#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

namespace
{

struct memory : Imf::IStream {
    memory(const void *its_bytes, size_t its_size)
        : Imf::IStream("memory"), bytes(static_cast<const char *>(its_bytes)), size(its_size)
    {
    }
    bool isMemoryMapped() const override
    {
        return false;
    }
    bool read(char to[], int count) override
    {
        if (count < 0 || size_t(count) > size - at) throw std::runtime_error("the file ends early");
        std::memcpy(to, bytes + at, size_t(count));
        at += size_t(count);
        return at < size;
    }
    uint64_t tellg() override
    {
        return at;
    }
    void seekg(uint64_t to) override
    {
        if (to > size) throw std::runtime_error("the file ends early");
        at = size_t(to);
    }
    const char *bytes;
    size_t size, at = 0;
};

Imf::FrameBuffer planes_of(struct bd_exr *exr, int left_px, int top_px)
{
    Imf::FrameBuffer planes;
    const size_t row_bytes = sizeof(float) * exr->width_px;
    for (uint32_t i = 0; i < exr->channel_count; i++) {
        // The library counts from the picture's origin, which may lie outside.
        const intptr_t before = intptr_t(sizeof(float)) * left_px + intptr_t(row_bytes) * top_px;
        const intptr_t base = reinterpret_cast<intptr_t>(exr->channels[i].samples) - before;
        planes.insert(exr->channels[i].name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char *>(base),
                                                        sizeof(float), row_bytes));
    }
    return planes;
}

// Without threads of the library's, and without a search for chunks where their table is damaged.
void read_pixels(memory &file, struct bd_exr *exr, int left_px, int top_px)
{
    Imf::MultiPartInputFile parts(file, 0, false);
    const auto window = parts.header(0).dataWindow();
    if (window.min.x != left_px || window.min.y != top_px ||
        uint64_t(int64_t(window.max.x) - left_px + 1) != exr->width_px ||
        uint64_t(int64_t(window.max.y) - top_px + 1) != exr->height_px)
        throw std::runtime_error("two data windows");
    if (!parts.partComplete(0)) throw std::runtime_error("chunks are missing");
    Imf::InputPart part(parts, 0);
    part.setFrameBuffer(planes_of(exr, left_px, top_px));
    part.readPixels(window.min.y, window.max.y);
}

} // namespace

enum bd_err bd_exr_lossy_read(const void *bytes, size_t size_bytes, int left_px, int top_px,
                              struct bd_exr *exr, char *why, size_t why_bytes)
{
    try {
        memory file(bytes, size_bytes);
        read_pixels(file, exr, left_px, top_px);
        return BD_ERR_OK;
    } catch (const std::bad_alloc &) {
        snprintf(why, why_bytes, "no memory");
        return BD_ERR_NO_MEMORY;
    } catch (const std::exception &e) {
        snprintf(why, why_bytes, "%s", e.what());
    } catch (...) {
        snprintf(why, why_bytes, "OpenEXR gave up");
    }
    return BD_ERR_BAD_INPUT;
}
