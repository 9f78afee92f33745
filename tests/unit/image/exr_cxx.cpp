#include "tests/unit/image/exr_cxx.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTiledOutputPart.h>

#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace
{

struct memory_out : Imf::OStream {
    memory_out() : Imf::OStream("memory") {}
    void write(const char c[], int n) override
    {
        if (bytes.size() < at + size_t(n)) bytes.resize(at + size_t(n));
        std::memcpy(bytes.data() + at, c, size_t(n));
        at += size_t(n);
    }
    uint64_t tellp() override
    {
        return at;
    }
    void seekp(uint64_t pos) override
    {
        at = pos;
    }
    std::vector<char> bytes;
    size_t at = 0;
};

struct memory_in : Imf::IStream {
    memory_in(const unsigned char *b, size_t n) : Imf::IStream("memory"), bytes(b), size(n) {}
    bool read(char c[], int n) override
    {
        if (size_t(n) > size - at) throw std::runtime_error("end of file");
        std::memcpy(c, bytes + at, size_t(n));
        at += size_t(n);
        return at < size;
    }
    uint64_t tellg() override
    {
        return at;
    }
    void seekg(uint64_t pos) override
    {
        at = pos < size ? pos : size;
    }
    const unsigned char *bytes;
    size_t size, at = 0;
};

// The samples of all channels as the file's types, and where they are.
struct typed {
    std::vector<std::vector<uint32_t>> uints;
    std::vector<std::vector<half>> halves;
    Imf::FrameBuffer buffer;
};

void add_channel(const exr_cxx_picture &picture, const exr_cxx_channel &channel, typed &out)
{
    const size_t count = size_t(picture.width_px) * size_t(picture.height_px);
    const size_t before =
        size_t(picture.top_px) * size_t(picture.width_px) + size_t(picture.left_px);
    char *base = reinterpret_cast<char *>(const_cast<float *>(channel.samples));
    size_t size = 4;
    if (channel.type == 0) {
        out.uints.emplace_back(channel.samples, channel.samples + count);
        base = reinterpret_cast<char *>(out.uints.back().data());
    }
    if (channel.type == 1) {
        out.halves.emplace_back(channel.samples, channel.samples + count);
        base = reinterpret_cast<char *>(out.halves.back().data());
        size = 2;
    }
    out.buffer.insert(channel.name, Imf::Slice(Imf::PixelType(channel.type), base - before * size,
                                               size, size * size_t(picture.width_px)));
}

Imf::Header header_of(const exr_cxx_picture &picture, const char *name)
{
    using namespace IMATH_NAMESPACE;
    const Box2i window(
        V2i(picture.left_px, picture.top_px),
        V2i(picture.left_px + picture.width_px - 1, picture.top_px + picture.height_px - 1));
    Imf::Header header(window, window, 1, V2f(0, 0), 1, Imf::INCREASING_Y,
                       Imf::Compression(picture.compression));
    for (int c = 0; c < picture.channel_count; c++)
        header.channels().insert(picture.channels[c].name,
                                 Imf::Channel(Imf::PixelType(picture.channels[c].type)));
    header.setName(name);
    header.setType(picture.tile_px ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    if (picture.tile_px)
        header.setTileDescription(Imf::TileDescription(unsigned(picture.tile_px),
                                                       unsigned(picture.tile_px), Imf::ONE_LEVEL));
    return header;
}

void write_part(Imf::MultiPartOutputFile &file, int part, const exr_cxx_picture &picture,
                const Imf::FrameBuffer &buffer)
{
    if (picture.tile_px) {
        Imf::TiledOutputPart out(file, part);
        out.setFrameBuffer(buffer);
        out.writeTiles(0, out.numXTiles() - 1, 0, out.numYTiles() - 1);
    } else {
        Imf::OutputPart out(file, part);
        out.setFrameBuffer(buffer);
        out.writePixels(picture.height_px);
    }
}

} // namespace

unsigned char *exr_cxx_write(const exr_cxx_picture *picture, size_t *size_bytes)
{
    memory_out out;
    typed samples;
    for (int c = 0; c < picture->channel_count; c++)
        add_channel(*picture, picture->channels[c], samples);
    std::vector<Imf::Header> headers{header_of(*picture, "first")};
    if (picture->second_part) headers.push_back(header_of(*picture, "second"));
    {
        Imf::MultiPartOutputFile file(out, headers.data(), int(headers.size()));
        for (int part = 0; part < int(headers.size()); part++)
            write_part(file, part, *picture, samples.buffer);
    }
    *size_bytes = out.bytes.size();
    auto *bytes = static_cast<unsigned char *>(std::malloc(out.bytes.size()));
    std::memcpy(bytes, out.bytes.data(), out.bytes.size());
    return bytes;
}

bool exr_cxx_read(const unsigned char *bytes, size_t size_bytes, const char *channel, float *out)
{
    try {
        memory_in in(bytes, size_bytes);
        Imf::MultiPartInputFile file(in);
        Imf::InputPart part(file, 0);
        const auto window = part.header().dataWindow();
        const size_t width = size_t(window.max.x - window.min.x) + 1;
        const ptrdiff_t before = ptrdiff_t(window.min.y) * ptrdiff_t(width) + window.min.x;
        Imf::FrameBuffer buffer;
        buffer.insert(channel, Imf::Slice(Imf::FLOAT, reinterpret_cast<char *>(out) - before * 4, 4,
                                          4 * width));
        part.setFrameBuffer(buffer);
        part.readPixels(window.min.y, window.max.y);
        return true;
    } catch (const std::exception &) {
        return false;
    }
}
